"""Bring the centre of mass to a point."""

from typing import Any, ClassVar

import pinocchio as pin

from wbc_suite.arguments import check_array
from wbc_suite.compiling import inner
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.forward import RobotArrays, compute_com
from wbc_suite.qp.part import SharedRow
from wbc_suite.qp.task import RowTask
from wbc_suite.typing import Matrix, Vector


@inner
def com_error(
    robot: RobotArrays, own: Vector, dt: float, rows: Matrix, values: Vector
) -> None:
    """Write Jacobian and error of the centre of mass; own is the point."""
    compute_com(robot)
    com, columns = robot.com, robot.com_jacobian
    for i in range(3):
        for j in range(rows.shape[1]):
            rows[i, j] = columns[j, i]
        values[i] = own[i] - com[i]


class ComTask(RowTask):
    """Bring the centre of mass to a point: `e = p* - p_com`, `J = J_com`, world axes.

    Args:
        cost: [cost]/m, one number or one per world axis.
        target: Point p*, m, shape (3,); without one the point at binding time.

    Other arguments are those of `RowTask`.
    """

    kernel: ClassVar[Any] = com_error

    def __init__(
        self,
        cost: float | Vector = 1.0,
        *,
        target: Vector | None = None,
        gain: float = 1.0,
        level: int = 0,
        max_speed: float = 1.0,
        name: str = "com",
    ) -> None:
        super().__init__(
            name, dim=3, cost=cost, gain=gain, level=level, max_speed=max_speed
        )
        self.target_row = SharedRow(3)
        if target is not None:
            self.set_target(target)

    def set_target(self, target: Vector) -> None:
        """Set the point p*, m; ConfigError if its shape is not (3,)."""
        what = f"Task '{self.name}': the target"
        self.target_row.set(check_array(what, target, (3,)))

    @property
    def target(self) -> Vector:
        """Point p*, m, a copy."""
        return self.target_row.values.copy()

    def bind(self, configuration: Configuration) -> None:
        """Without a target, hold the present point."""
        if not self.target_row.is_set:
            model, data = configuration.model, configuration.data
            self.set_target(pin.centerOfMass(model, data, configuration.q).copy())
