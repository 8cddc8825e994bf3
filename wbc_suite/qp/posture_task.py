"""Tasks on all joints: pull them to a posture, or let them stand still."""

from collections.abc import Mapping
from typing import Any, ClassVar

from wbc_suite.arguments import check_array
from wbc_suite.compiling import inner
from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.forward import RobotArrays
from wbc_suite.qp.part import SharedRow, nothing
from wbc_suite.qp.task import JointTask
from wbc_suite.typing import Matrix, Vector


@inner
def posture_error(
    robot: RobotArrays, own: Vector, dt: float, rows: Matrix, values: Vector
) -> None:
    """Write how far joints of one parameter are from a posture, which own is."""
    q, q_start, v_start, v_count = robot.q, robot.q_start, robot.v_start, robot.v_count
    for j in range(1, q_start.shape[0]):
        if v_count[j] == 1:
            k = q_start[j]
            values[v_start[j]] = own[k] - q[k]


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
