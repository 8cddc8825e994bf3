"""What every QP task has in common."""

from collections.abc import Mapping
from typing import Any, ClassVar, TypeAlias

import numpy as np

from wbc_suite.arguments import check_array, check_count, check_number
from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.limit import joint_values
from wbc_suite.qp.part import SharedRow, run_kernel
from wbc_suite.typing import Indices, Matrix, Vector


class RowTask:
    """One term `|| W (J dq - gain e) ||^2` of a stack's cost, with a few dense rows.

    `e` is the task's error and `J` its derivative: `d(e) = -J dq`. The wanted step
    `gain e` is shortened to the task's greatest speed, because errors without bound
    are what makes joints flip at limits. `W` is the diagonal of costs.

    A subclass writes `evaluate`, or names a `kernel` and its numbers, as the guide of
    QP stacks shows; weights, saturation, damping and reports are the stack's work.

    Args:
        name: How reports call the task.
        dim: Number of rows.
        cost: [cost] per unit of the error, one number or one per row.
        gain: Fraction of the error that one step should remove, in (0, 1].
        level: Strict priority; level 0 is served first, and level 1 moves only in ways
            that leave the rows of level 0 as they are.
        max_speed: Greatest speed asked for, in the error's unit per second.
        max_angular_speed: The same for the rows from `angular_start` on, rad/s.
        angular_start: First row that is an angle; `dim` when absent.

    Attributes:
        kernel: What computes Jacobian and error, see `part`. Subclasses inherit it,
            unless they override `evaluate`; see `part.kernel_of`.
        target_row: Target of a task with a kernel, which follows `set` at once.
        unit: Unit of the rows before `angular_start`, for reports.

    Raises:
        ConfigError: If a cost, the gain, the level or a speed is out of range.
    """

    kernel: ClassVar[Any] = None
    unit: str = "m"

    def __init__(
        self,
        name: str,
        *,
        dim: int,
        cost: float | Vector = 1.0,
        gain: float = 1.0,
        level: int = 0,
        max_speed: float = np.inf,
        max_angular_speed: float = np.inf,
        angular_start: int | None = None,
    ) -> None:
        self.name, self.target_row = str(name), SharedRow(0)
        self.gain, self.level = _priority(name, gain, level)
        self.dim = check_count(f"Task '{name}': dim", dim, least=1)
        self.cost_row = SharedRow(self.dim)
        self.cost_row.set(cost_vector(self.name, cost, self.dim))
        self.max_speeds = _speed(name, max_speed), _speed(name, max_angular_speed)
        self.angular_start = dim if angular_start is None else angular_start

    @property
    def cost(self) -> Vector:
        """Cost of each row, [cost] per unit of the error, shape (dim,). A view."""
        return self.cost_row.values

    def bind(self, configuration: Configuration) -> None:
        """Resolve names in a model. A stack calls it once.

        Raises:
            UnknownNameError: If the model lacks a frame or joint of this task.
        """

    def support(self, configuration: Configuration) -> Indices:
        """Return the velocity indices whose columns of J may differ from zero."""
        return np.arange(configuration.nv)

    def own(self, configuration: Configuration) -> Vector:
        """Return the numbers that the kernel reads; they end with `target_row`."""
        return self.target_row.values.copy()

    def evaluate(
        self, configuration: Configuration, error: Vector, jacobian: Matrix
    ) -> None:
        """Write the error, shape (dim,), and J, `d(error) = -J dq`, shape (dim, nv).

        An error that is not finite, or beyond 1e9, holds what the task controls, and is
        reported. J is finite in any case; it is zero before the first call.
        """
        own = self.own(configuration)
        run_kernel(self, configuration.robot, own, 0.0, jacobian, error)

    def error(self, configuration: Configuration) -> Vector:
        """Return the error, shape (dim,); NaN for a target that is not finite."""
        return self._evaluated(configuration)[0]

    def jacobian(self, configuration: Configuration) -> Matrix:
        """Return the derivative J of the error, `d(e) = -J dq`, shape (dim, nv)."""
        return self._evaluated(configuration)[1]

    def _evaluated(self, configuration: Configuration) -> tuple[Vector, Matrix]:
        error, jacobian = np.zeros(self.dim), np.zeros((self.dim, configuration.nv))
        self.evaluate(configuration, error, jacobian)
        return error, jacobian


class JointTask:
    """A term of a stack's cost whose Jacobian is the identity: one row per velocity.

    Other arguments and attributes are those of `RowTask`.

    Args:
        cost: [cost]/rad or [cost]/m for all joints; free and planar roots have cost
            zero unless named.
        costs: Costs of single joints by name, in place of `cost`.
        max_speed: Greatest speed of each joint, rad/s or m/s.

    Attributes:
        squared_costs: Squared cost of each velocity once bound, shape (nv,).
    """

    kernel: ClassVar[Any] = None

    def __init__(
        self,
        name: str,
        *,
        cost: float,
        costs: Mapping[str, float] | None = None,
        gain: float = 1.0,
        level: int = 0,
        max_speed: float = np.inf,
    ) -> None:
        self.name, self.target_row = str(name), SharedRow(0)
        self.gain, self.level = _priority(name, gain, level)
        self.cost, self.costs = cost, dict(costs or {})
        for value in (cost, *self.costs.values()):
            cost_vector(name, value, 1)
        self.max_speed = _speed(name, max_speed)

    def bind(self, configuration: Configuration) -> None:
        """Resolve joint names."""
        self.squared_costs = joint_values(configuration, self.cost, self.costs) ** 2

    def own(self, configuration: Configuration) -> Vector:
        """Return the numbers that the kernel reads; they end with `target_row`."""
        return self.target_row.values.copy()

    def evaluate(self, configuration: Configuration, error: Vector) -> None:
        """Write the error of each velocity, shape (nv,).

        Values that are not finite hold all joints of the task, and are reported.
        """
        own, none = self.own(configuration), np.zeros((0, configuration.nv))
        run_kernel(self, configuration.robot, own, 0.0, none, error)

    def error(self, configuration: Configuration) -> Vector:
        """Return the error of each velocity, rad or m, shape (nv,)."""
        error = np.zeros(configuration.nv)
        self.evaluate(configuration, error)
        return error


Task: TypeAlias = RowTask | JointTask
"""What a stack takes as a task."""


def _priority(name: str, gain: float, level: int) -> tuple[float, int]:
    """Return gain and strict level of a task, checked."""
    return (
        check_number(f"Task '{name}': gain", gain, above=0.0, most=1.0),
        check_count(f"Task '{name}': level", level),
    )


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


def _speed(name: str, speed: object) -> float:
    """Return the greatest speed a task asks for, checked; infinity is no limit."""
    what = f"Task '{name}': the greatest speed"
    return check_number(what, speed, above=0.0, allow_inf=True)
