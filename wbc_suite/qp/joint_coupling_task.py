"""Let one joint follow another."""

import numpy as np

from wbc_suite.arguments import check_number
from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.task import RowTask
from wbc_suite.typing import Indices, Matrix, Vector


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
