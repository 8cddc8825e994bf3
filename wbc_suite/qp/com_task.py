"""Bring the centre of mass to a point."""

import numpy as np

from wbc_suite.arguments import check_array
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.rows import saturate
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
        self._costs = cost_vector(name, cost, 3)[:, None]
        self.max_speed = check_speed(name, max_speed)
        self.target: Vector | None = None
        if target is not None:
            self.set_target(target)

    def set_target(self, target: Vector) -> None:
        """Set the point p*, m, shape (3,).

        Raises:
            ConfigError: If the shape is wrong.
        """
        what = f"Task '{self.name}': the target"
        self.target = check_array(what, target, (3,)).copy()

    def bind(self, configuration: Configuration) -> None:
        """Without a target, hold the present point."""
        if self.target is None:
            self.target = configuration.com.copy()

    def error(self, configuration: Configuration) -> Vector:
        """Return `p* - p_com`, m, shape (3,)."""
        assert self.target is not None
        return self.target - configuration.com

    def jacobian(self, configuration: Configuration) -> Matrix:
        """Return the derivative J of the error, `d(e) = -J dq`, shape (3, nv)."""
        return configuration.com_jacobian

    def rows(
        self, configuration: Configuration, dt: float, W: Matrix, e: Vector
    ) -> Vector:
        """Write the weighted rows."""
        error = self.error(configuration)
        np.multiply(self._costs, configuration.com_jacobian, out=W)
        if np.isfinite(error).all():
            np.multiply(error, self.gain, out=e)
            saturate(e, self.max_speed * dt)
            e *= self._costs[:, 0]
        else:
            e[:] = 0.0
        return error
