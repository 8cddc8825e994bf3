"""Prefer to stand still."""

from collections.abc import Mapping

from wbc_suite.kinematics import Configuration
from wbc_suite.qp.task import DiagonalTask, cost_vector, joint_costs
from wbc_suite.typing import Vector

__all__ = ["DampingTask"]


class DampingTask(DiagonalTask):
    """Prefer small steps: `e = 0`, `J = I`.

    Args:
        cost: [cost]/rad or [cost]/m for all joints; free and planar roots have cost
            zero unless named.
        costs: Costs of single joints by name, in place of `cost`.
        level: See `Task`.
        name: How reports call the task.
    """

    def __init__(
        self,
        cost: float,
        *,
        costs: Mapping[str, float] | None = None,
        level: int = 0,
        name: str = "damping",
    ) -> None:
        super().__init__(name, level=level)
        self.cost, self.costs = cost, dict(costs or {})
        for value in (cost, *self.costs.values()):
            cost_vector(name, value, 1)

    def bind(self, configuration: Configuration) -> None:
        """Resolve joint names."""
        self.squared_costs = joint_costs(configuration, self.cost, self.costs) ** 2

    def diagonal(
        self, configuration: Configuration, dt: float, weights: Vector, steps: Vector
    ) -> bool:
        """Add squared costs."""
        weights += self.squared_costs
        return True
