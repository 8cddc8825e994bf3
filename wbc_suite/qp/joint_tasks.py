"""Tasks on joints: a posture, no motion, one joint that follows another."""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from wbc_suite.arguments import check_array, check_number
from wbc_suite.compiling import inner
from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.forward import RobotArrays
from wbc_suite.qp.part import SharedRow, nothing
from wbc_suite.qp.task import JointTask, RowTask
from wbc_suite.typing import Indices, Matrix, Vector


@inner
def posture_error(
    robot: RobotArrays, own: Vector, dt: float, rows: Matrix, values: Vector
) -> None:
    """Write how far joints of one parameter are from a posture, which own is."""
    q, joints = robot.q, robot.joints
    for j in range(1, joints.shape[0]):
        joint = joints[j]
        if joint.v_count == 1:
            values[joint.v_start] = own[joint.q_start] - q[joint.q_start]


class PostureTask(JointTask):
    """Pull joints to a posture q*: `e = q* (-) q`, `J = I`.

    Each joint's wanted step is shortened to `max_speed dt`.

    Args:
        target: Posture q*, shape (nq,); without one the posture at binding time.

    Other arguments are those of `JointTask`.
    """

    kernel: ClassVar[Any] = posture_error

    def __init__(
        self,
        cost: float = 1e-2,
        *,
        costs: Mapping[str, float] | None = None,
        target: Vector | None = None,
        gain: float = 1.0,
        level: int = 0,
        max_speed: float = 3.0,
        name: str = "posture",
    ) -> None:
        super().__init__(
            name, cost=cost, costs=costs, gain=gain, level=level, max_speed=max_speed
        )
        if target is not None:
            self.set_target(target)

    def set_target(self, target: Vector) -> None:
        """Set the posture q*; ConfigError if its shape is not (nq,)."""
        what = f"Task '{self.name}': the posture"
        is_set = self.target_row.is_set
        shape = self.target_row.values.shape if is_set else None
        posture = check_array(what, target, shape)
        if posture.ndim != 1:
            raise ConfigError(f"{what} is a vector, not shape {posture.shape}.")
        if not is_set:
            self.target_row = SharedRow(posture.size)
        self.target_row.set(posture)

    @property
    def target(self) -> Vector:
        """Posture q*, shape (nq,), once it is set or bound; a copy."""
        return self.target_row.values.copy()

    def bind(self, configuration: Configuration) -> None:
        """Resolve joint names; without a target, take the present posture."""
        super().bind(configuration)
        if not self.target_row.is_set:
            self.set_target(configuration.q)
        if self.target.shape != (configuration.nq,):
            raise ConfigError(
                f"Task '{self.name}': the posture has shape {self.target.shape}; "
                f"the model has nq {configuration.nq}."
            )

    def evaluate(self, configuration: Configuration, error: Vector) -> None:
        """Write `q* (-) q`, rad or m."""
        error[:] = configuration.difference(self.target_row.values)


class DampingTask(JointTask):
    """Prefer small steps: `e = 0`, `J = I`; arguments are those of `JointTask`."""

    kernel: ClassVar[Any] = nothing

    def __init__(
        self,
        cost: float,
        *,
        costs: Mapping[str, float] | None = None,
        level: int = 0,
        name: str = "damping",
    ) -> None:
        super().__init__(name, cost=cost, costs=costs, level=level)


class JointCouplingTask(RowTask):
    """Let a joint follow another: `e = ratio q_leader + offset - q_follower`.

    `J = d(q_follower) - ratio d(q_leader)`: finger synergies, gears, a waist that
    shares the bending of a hip.

    Args:
        ratio: Radians (or metres) of the follower per radian (or metre) of the leader.
        offset: The follower's position when the leader is at zero, rad or m.

    Other arguments are those of `RowTask`. Reports call it "follower - leader".
    """

    unit = "rad"

    def __init__(
        self,
        follower: str,
        leader: str,
        *,
        ratio: float = 1.0,
        offset: float = 0.0,
        cost: float = 10.0,
        gain: float = 1.0,
        level: int = 0,
        max_speed: float = 3.0,
        name: str | None = None,
    ) -> None:
        super().__init__(
            name or f"{follower} - {leader}",
            dim=1,
            cost=cost,
            gain=gain,
            level=level,
            max_speed=max_speed,
        )
        self.follower, self.leader = follower, leader
        self.ratio = check_number(f"Task '{self.name}': the ratio", ratio)
        self.offset = check_number(f"Task '{self.name}': the offset", offset)

    def bind(self, configuration: Configuration) -> None:
        """Resolve both joints; ConfigError if one has not exactly one parameter."""
        joints = [
            configuration.model.joints[configuration.joint_id(name)]
            for name in (self.follower, self.leader)
        ]
        if any(joint.nq != 1 for joint in joints):
            raise ConfigError(f"Task '{self.name}': joints need one parameter each.")
        self._q: Indices = np.array([joint.idx_q for joint in joints])
        self._v: Indices = np.array([joint.idx_v for joint in joints])

    def support(self, configuration: Configuration) -> Indices:
        """Return the two velocity indices."""
        return np.sort(self._v)

    def evaluate(
        self, configuration: Configuration, error: Vector, jacobian: Matrix
    ) -> None:
        """Write the deviation, rad or m, and its Jacobian."""
        follower, leader = configuration.q[self._q]
        error[0] = self.ratio * leader + self.offset - follower
        jacobian[0, self._v] = 1.0, -self.ratio
