"""Bring the centre of mass to a point."""

import numpy as np

from wbc_suite.arguments import check_array
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.lie import is_usable, saturate
from wbc_suite.qp.rows import PACKED_COM
from wbc_suite.qp.task import RowTask, check_speed, cost_vector
from wbc_suite.typing import Matrix, Vector

__all__ = ["ComTask"]


class ComTask(RowTask):
    """Bring the centre of mass to a point: `e = p* - p_com`, `J = J_com`, world axes.

    Args:
        cost: [cost]/m, one number or one per world axis.
        target: Point p*, m, shape (3,); without one the point at binding time.
        gain: See `Task`.
        level: See `Task`.
        max_speed: Greatest speed asked for, m/s.
        name: How reports call the task.
    """

    dim = 3

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
        super().__init__(name, gain=gain, level=level)
        self.packed: Vector = np.zeros(PACKED_COM)
        self.packed[3:6] = cost_vector(name, cost, 3)
        self.packed[6:] = self.gain, check_speed(name, max_speed)
        self.has_target = target is not None
        if target is not None:
            self.set_target(target)

    def set_target(self, target: Vector) -> None:
        """Set the point p*, m, shape (3,).

        Raises:
            ConfigError: If the shape is wrong.
        """
        what = f"Task '{self.name}': the target"
        self.packed[:3] = check_array(what, target, (3,))
        self.has_target = True

    @property
    def target(self) -> Vector:
        """Point p*, m, a copy."""
        return self.packed[:3].copy()

    def bind(self, configuration: Configuration) -> None:
        """Without a target, hold the present point."""
        if not self.has_target:
            self.set_target(configuration.com)

    def error(self, configuration: Configuration) -> Vector:
        """Return `p* - p_com`, m, shape (3,)."""
        if not is_usable(self.packed[:3]):
            return np.full(3, np.nan)
        return self.packed[:3] - configuration.com

    def jacobian(self, configuration: Configuration) -> Matrix:
        """Return the derivative J of the error, `d(e) = -J dq`, shape (3, nv)."""
        return configuration.com_jacobian

    def rows(
        self, configuration: Configuration, dt: float, W: Matrix, e: Vector
    ) -> Vector:
        """Write the weighted rows; the readable form of the kernel `com_rows`."""
        error = self.error(configuration)
        costs, gain, speed = self.packed[3:6], self.packed[6], self.packed[7]
        step = gain * error if np.isfinite(error).all() else np.zeros(3)
        saturate(step, speed * dt)
        W[:] = costs[:, None] * configuration.com_jacobian
        e[:] = costs * step
        return error
