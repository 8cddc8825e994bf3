"""Bring the centre of mass to a point."""

from typing import ClassVar

from wbc_suite.arguments import check_array
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.forward import compute_joint_poses
from wbc_suite.qp.kernel import Kernel
from wbc_suite.qp.task import RowTask, SharedRow
from wbc_suite.qp.task_kernels import com_error
from wbc_suite.typing import Matrix, Vector


class ComTask(RowTask):
    """Bring the centre of mass to a point: `e = p* - p_com`, `J = J_com`, world axes.

    Args:
        cost: [cost]/m, one number or one per world axis.
        target: Point p*, m, shape (3,); without one the point at binding time.

    Other arguments are those of `RowTask`.
    """

    kernel: ClassVar[Kernel] = Kernel.COM

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
            self.set_target(configuration.com)

    def evaluate(
        self, configuration: Configuration, error: Vector, jacobian: Matrix
    ) -> None:
        """Write the error, m, and its Jacobian."""
        compute_joint_poses(configuration.robot)
        com_error(configuration.robot, self.target_row.values, error, jacobian)
