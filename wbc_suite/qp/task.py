"""What every QP task has in common."""

from abc import ABC, abstractmethod
from collections.abc import Mapping

import numpy as np

from wbc_suite.arguments import check_array, check_count, check_number
from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Configuration
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = [
    "DiagonalTask",
    "RowTask",
    "Task",
    "check_speed",
    "cost_vector",
    "joint_costs",
]


class Task(ABC):
    """One term `|| W (J dq - gain e) ||^2` of a stack's cost.

    `e` is the task's error and `J` its derivative: `d(e) = -J dq`. The wanted step
    `gain e` is shortened to the task's greatest speed, because errors without bound
    are what makes joints flip at limits. `W` is the diagonal of costs.

    Args:
        name: How reports call the task.
        gain: Fraction of the error that one step should remove, in (0, 1].
        level: Strict priority; level 0 is served first, and level 1 moves only in ways
            that leave the rows of level 0 as they are.

    Raises:
        ConfigError: If the gain or the level is out of range.
    """

    def __init__(self, name: str, *, gain: float = 1.0, level: int = 0) -> None:
        self.name = str(name)
        self.gain = check_number(f"Task '{name}': gain", gain, above=0.0, most=1.0)
        self.level = check_count(f"Task '{name}': level", level)

    @abstractmethod
    def bind(self, configuration: Configuration) -> None:
        """Resolve names in a model. A stack calls it once.

        Raises:
            UnknownNameError: If the model lacks a frame or joint of this task.
        """


class RowTask(Task):
    """A task with a few dense rows.

    Attributes:
        dim: Number of rows.
    """

    dim: int

    def support(self, configuration: Configuration) -> Indices:
        """Return the velocity indices whose columns may be other than zero."""
        return np.arange(configuration.nv)

    @abstractmethod
    def rows(
        self, configuration: Configuration, dt: float, W: Matrix, e: Vector
    ) -> Vector:
        """Write weighted rows `W J` and weighted steps `W gain e`, saturated.

        Args:
            configuration: Where the robot is.
            dt: Step, s.
            W: Output, shape (dim, nv); columns outside the support stay untouched.
            e: Output, shape (dim,).

        Returns:
            The error before gain and saturation; NaN where the target is not finite,
            and then the steps are zero: what the task watches is held.
        """


class DiagonalTask(Task):
    """A task whose Jacobian is the identity: one row per velocity."""

    @abstractmethod
    def diagonal(
        self, configuration: Configuration, dt: float, weights: Vector, steps: Vector
    ) -> bool:
        """Add squared costs to `weights` and squared costs times steps to `steps`.

        Args:
            configuration: Where the robot is.
            dt: Step, s.
            weights: In and out, [cost]^2, shape (nv,).
            steps: In and out, [cost]^2 rad or m, shape (nv,).

        Returns:
            False if the target is not finite; joints are then held.
        """


def cost_vector(owner: str, cost: float | Vector, size: int) -> Vector:
    """Return costs as a vector of the given size.

    Raises:
        ConfigError: If a cost is negative or not finite, or the shape is wrong.
    """
    vector = check_array(f"{owner}: the cost", cost, None)
    if vector.shape not in ((), (size,)):
        raise ConfigError(
            f"{owner}: a cost is one number or {size}, not shape {vector.shape}."
        )
    if not (np.isfinite(vector).all() and (vector >= 0.0).all()):
        raise ConfigError(f"{owner}: costs must be finite and not negative: {cost}.")
    return np.broadcast_to(vector, (size,)).copy()


def check_speed(owner: str, speed: object) -> float:
    """Return the greatest speed a task asks for; infinity is no limit.

    Raises:
        ConfigError: If it is not positive.
    """
    return check_number(
        f"Task '{owner}': the greatest speed", speed, above=0.0, endless=True
    )


def joint_costs(
    configuration: Configuration, cost: float, by_joint: Mapping[str, float]
) -> Vector:
    """Return one cost per velocity, zero for the root unless named.

    Raises:
        UnknownNameError: If a named joint is not in the model.
    """
    costs = np.full(configuration.nv, cost)
    costs[configuration.root_linear] = 0.0
    costs[configuration.root_angular] = 0.0
    for name, value in by_joint.items():
        joint = configuration.model.joints[configuration.joint_id(name)]
        costs[joint.idx_v : joint.idx_v + joint.nv] = value
    return costs
