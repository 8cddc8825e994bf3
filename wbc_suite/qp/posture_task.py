"""Pull joints to a posture."""

from collections.abc import Mapping

import numpy as np

from wbc_suite.arguments import check_array
from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.task import DiagonalTask, check_speed, cost_vector, joint_costs
from wbc_suite.typing import Vector

__all__ = ["PostureTask"]


class PostureTask(DiagonalTask):
    """Pull joints to a posture q*: `e = q* (-) q`, `J = I`.

    Free and planar roots have cost zero unless named in `costs`. Each joint's wanted
    step is shortened to `max_speed dt`.

    Args:
        cost: [cost]/rad or [cost]/m, the same for all joints.
        costs: Costs of single joints by name, in place of `cost`.
        target: Posture q*, shape (nq,); without one the posture at binding time.
        gain: See `Task`.
        level: See `Task`.
        max_speed: Greatest speed asked for, rad/s or m/s.
        name: How reports call the task.
    """

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
        super().__init__(name, gain=gain, level=level)
        self.cost, self.costs = cost, dict(costs or {})
        for value in (cost, *self.costs.values()):
            cost_vector(name, value, 1)
        self.max_speed = check_speed(name, max_speed)
        self._target: Vector | None = None
        if target is not None:
            self.set_target(target)

    def set_target(self, target: Vector) -> None:
        """Set the posture q*, shape (nq,).

        Raises:
            ConfigError: If the shape is wrong.
        """
        what = f"Task '{self.name}': the posture"
        if self._target is None:
            self._target = check_array(what, target, None).copy()
        else:  # in place: kernels know where it is
            self._target[:] = check_array(what, target, self._target.shape)

    @property
    def target(self) -> Vector:
        """Posture q*, shape (nq,), known once it is set or bound. The task's own."""
        assert self._target is not None
        return self._target

    def bind(self, configuration: Configuration) -> None:
        """Resolve joint names; without a target, take the present posture."""
        self.squared_costs = joint_costs(configuration, self.cost, self.costs) ** 2
        if self._target is None:
            self.set_target(configuration.q)
        if self.target.shape != (configuration.nq,):
            raise ConfigError(
                f"Task '{self.name}': the posture has shape {self.target.shape}; "
                f"the model has nq {configuration.nq}."
            )

    def error(self, configuration: Configuration) -> Vector:
        """Return `q* (-) q`, rad or m, shape (nv,)."""
        return configuration.difference(self.target)

    def diagonal(
        self, configuration: Configuration, dt: float, weights: Vector, steps: Vector
    ) -> bool:
        """Add the terms; the readable form of the kernel `posture_terms`."""
        weights += self.squared_costs
        error = np.where(self.squared_costs > 0.0, self.error(configuration), 0.0)
        if not np.isfinite(error).all():
            return False
        limit = self.max_speed * dt
        steps += self.squared_costs * np.clip(self.gain * error, -limit, limit)
        return True
