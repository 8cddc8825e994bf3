"""The rows of a stack's limits and equalities: bound, evaluated and named."""

from collections.abc import Sequence
from itertools import pairwise
from types import UnionType
from typing import TypeVar, cast

import numpy as np

from wbc_suite.compiling import as_argument
from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.active_set import QpArrays
from wbc_suite.qp.equality import Equality, FrameEquality, HeldFrames, LinearEquality
from wbc_suite.qp.floor_limit import FloorLimit
from wbc_suite.qp.kernel import Kernel, kernel_of
from wbc_suite.qp.limit import Limit, LimitKind, RowLimit
from wbc_suite.qp.obstacle_limit import ObstacleLimit
from wbc_suite.qp.self_collision_limit import SelfCollisionLimit
from wbc_suite.qp.strict_level import MAX_LEVELS
from wbc_suite.qp.task import RowTask, Task
from wbc_suite.typing import Indices, Vector


class Constraints:
    """Inequality rows, then equality rows, in the order in which a problem has them.

    The first limits of self-collision, floor and obstacles and the equalities of this
    package are written by kernels; others by their own `rows` before each tick. All are
    bound here. Limits without rows are left out.

    Attributes:
        inequalities: Number of inequality rows.
        equalities: Number of equality rows.
        names: Name and number of rows of each equality.
        relax_speed: `RowLimit.relax_speed` of each inequality row.
        rate: Right-hand side per second of constant equality rows, NaN for others.
        held: Frames of the equality rows, for `hold_frames`.
        collision: The self-collision limit that a kernel writes.
        collision_rows: Its first inequality row and the end.
        floor: The floor limit that a kernel writes.
        floor_rows: Its first inequality row and the end.
        obstacles: The obstacle limit that a kernel writes.
        obstacle_rows: Its first inequality row and the end.
        python_parts: Limits and equalities whose rows no kernel writes.
    """

    def __init__(
        self,
        configuration: Configuration,
        limits: Sequence[Limit],
        equalities: Sequence[Equality],
    ) -> None:
        row_limits = [x for x in limits if isinstance(x, RowLimit)]
        for part in (*row_limits, *equalities):
            part.bind(configuration)
        self._limits, self.inequalities = with_rows(row_limits)
        self._equalities, self.equalities = with_rows(equalities)
        self.names = tuple((x.name, x.dim) for x in equalities)
        speeds = [limit.relax_speed for limit in row_limits for _ in range(limit.dim)]
        self.relax_speed: Vector = np.array(speeds, dtype=np.float64)
        self._python_limits: list[tuple[RowLimit, slice]] = []
        self._python_equalities: list[tuple[Equality, slice]] = []
        self._bind_limits(configuration)
        self._bind_equalities(configuration)
        slow = *self._python_limits, *self._python_equalities
        self.python_parts = [part for part, _ in slow]

    def _bind_limits(self, configuration: Configuration) -> None:
        """Choose what kernels write; limits without capsules and spheres write none."""
        self.collision, self.floor = SelfCollisionLimit((), ()), FloorLimit({})
        self.collision_rows: Indices = np.zeros(2, dtype=np.int64)
        self.floor_rows: Indices = np.zeros(2, dtype=np.int64)
        self.obstacles = ObstacleLimit((), ())
        self.obstacle_rows: Indices = np.zeros(2, dtype=np.int64)
        for limit, rows in self._limits:
            kernel, end = kernel_of(limit), (rows.start, rows.stop)
            is_first = not self.collision_rows.any()
            if isinstance(limit, SelfCollisionLimit) and kernel and is_first:
                self.collision, self.collision_rows[:] = limit, end
            elif isinstance(limit, FloorLimit) and kernel and not self.floor_rows.any():
                self.floor, self.floor_rows[:] = limit, end
            elif (
                isinstance(limit, ObstacleLimit)
                and kernel
                and not self.obstacle_rows.any()
            ):
                self.obstacles, self.obstacle_rows[:] = limit, end
            else:
                self._python_limits.append((limit, rows))
        self.collision.bind(configuration)
        self.floor.bind(configuration)
        self.obstacles.bind(configuration)

    def _bind_equalities(self, configuration: Configuration) -> None:
        self.rate: Vector = np.full(self.equalities, np.nan)
        self._constant: list[tuple[LinearEquality, slice]] = []
        frames: list[tuple[FrameEquality, int]] = []
        for equality, rows in self._equalities:
            kernel = kernel_of(equality)
            if isinstance(equality, FrameEquality) and kernel is Kernel.FRAME:
                frames.append((equality, rows.start))
            elif isinstance(equality, LinearEquality) and kernel is Kernel.CONSTANT:
                self._constant.append((equality, rows))
                self.rate[rows] = equality.rate
            else:
                self._python_equalities.append((equality, rows))
        held = self.held_arrays = HeldFrames.of(configuration, frames)
        self.held = as_argument(held)
        self._targets = list(held.target)  # copies live as long as these views
        for (equality, _), target in zip(frames, self._targets, strict=True):
            equality.target_row.attach(target)

    def fill_constants(self, qp: QpArrays) -> None:
        """Write the rows that never change."""
        for equality, rows in self._constant:
            qp.rows[self.inequalities :][rows] = equality.matrix

    def prepare(self, configuration: Configuration, dt: float, qp: QpArrays) -> None:
        """Write the rows that have no kernel."""
        nv, p = configuration.nv, self.inequalities
        G, h = qp.rows[:p], qp.upper[nv : nv + p]
        A, b = qp.rows[p:], qp.upper[nv + p :]
        for limit, rows in self._python_limits:
            limit.rows(configuration, dt, G[rows], h[rows])
        for equality, rows in self._python_equalities:
            equality.rows(configuration, dt, A[rows], b[rows])

    def reset(self) -> None:
        """Let limits discard their memory of earlier ticks."""
        for limit, _ in self._limits:
            limit.reset()

    def subject(self, row: int) -> tuple[LimitKind, object, str]:
        """Return kind, subject and unit of an inequality row of the last tick."""
        limit, rows = next(pair for pair in self._limits if row < pair[1].stop)
        return limit.kind, limit.subject(row - rows.start), limit.unit

    def violated(self, qp: QpArrays, x: Vector, tolerance: float) -> tuple[str, ...]:
        """Return the names of the rows that a step does not keep."""
        over, p = qp.rows @ x - qp.upper[len(x) :], self.inequalities
        missed = np.abs(over[p:]) > tolerance
        names = [part.name for part, rows in self._equalities if missed[rows].any()]
        rows = np.flatnonzero(over[:p] > tolerance)
        return (*names, *(str(self.subject(int(i))[1]) for i in rows))


Part = TypeVar("Part", RowLimit, Equality, RowTask)


def with_rows(parts: Sequence[Part]) -> tuple[list[tuple[Part, slice]], int]:
    """Return each part with its rows, one after another, and their number."""
    ends = np.cumsum([0, *(part.dim for part in parts)]).tolist()
    slices = [slice(a, b) for a, b in pairwise(ends)]
    return list(zip(parts, slices, strict=True)), ends[-1]


def check_parts(
    configuration: object, tasks: object, limits: object, equalities: object
) -> None:
    """Raise ConfigError if a part is of another kind, or two tasks share a name."""
    if not isinstance(configuration, Configuration):
        raise ConfigError(
            f"TaskStack needs a Configuration, not {type(configuration).__name__}."
        )
    _check_list("limits", limits, "Limit", Limit)
    _check_list("equalities", equalities, "Equality", Equality)
    checked = cast("Sequence[Task]", _check_list("tasks", tasks, "Task", Task))
    levels = {task.level for task in checked}
    if len(levels) > MAX_LEVELS:
        raise ConfigError(
            f"TaskStack: {len(levels)} levels, but there may be at most {MAX_LEVELS}."
        )
    names = [task.name for task in checked if isinstance(task, RowTask)]
    for name in names:
        if names.count(name) > 1:
            raise ConfigError(
                f"TaskStack: two tasks are named '{name}', and reports go by name. "
                "Give one of them another name=..."
            )


def _check_list(
    what: str, given: object, name: str, kind: type | UnionType
) -> Sequence[object]:
    if not isinstance(given, Sequence) or isinstance(given, str):
        raise ConfigError(f"TaskStack: {what} must be a list, not {given!r:.60}.")
    items = cast("Sequence[object]", given)
    for x in items:
        if not isinstance(x, kind):
            raise ConfigError(
                f"TaskStack: {what} must be {name} objects, not {x!r:.60}."
            )
    return items
