"""The rows of a stack's limits and equalities: bound, evaluated and named."""

from collections.abc import Sequence
from itertools import pairwise
from types import UnionType
from typing import TypeVar, cast

import numpy as np

from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.active_set import QpArrays
from wbc_suite.qp.equality import Equality, LinearEquality
from wbc_suite.qp.limit import Limit, LimitKind, RowLimit
from wbc_suite.qp.part import (
    MAX_LEVELS,
    MOST_LIMITS,
    PART,
    Kernels,
    Numbers,
    kernel_of,
)
from wbc_suite.qp.task import RowTask, Task
from wbc_suite.typing import Records, Vector


class Constraints:
    """Inequality rows, then equality rows, in the order in which a problem has them.

    Parts without a kernel are evaluated by their own `rows` before each tick. All are
    bound here. Limits without rows are left out.

    Attributes:
        inequalities: Number of inequality rows.
        equalities: Number of equality rows.
        names: Name and number of rows of each equality.
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
        self._python_limits: list[tuple[RowLimit, slice]] = []
        self._python_equalities: list[tuple[Equality, slice]] = []

    @property
    def python_parts(self) -> list[RowLimit | Equality]:
        """Limits and equalities whose rows no kernel writes."""
        slow = *self._python_limits, *self._python_equalities
        return [part for part, _ in slow]

    def records(
        self, configuration: Configuration, kernels: Kernels, numbers: Numbers
    ) -> tuple[Records, list[Vector]]:
        """Return `PART` records, and the numbers of all parts with a kernel.

        The first are those of tasks and equalities; limits follow.
        """
        records = np.zeros(len(self._limits) + len(self._equalities), PART)
        own = [numbers.values]
        for record, (limit, rows) in zip(records, self._limits, strict=False):
            record["row"], record["end"] = rows.start, rows.stop
            record["relax_speed"] = limit.relax_speed
            kernel = kernel_of(limit) if len(own) < MOST_LIMITS else None
            record["kernel"], has_room = kernels.place(kernel)
            if has_room:
                record["own"] = len(own)
                own.append(limit.own(configuration))
                record["last"] = len(own[-1])
            else:
                self._python_limits.append((limit, rows))
        rest = records[len(self._limits) :]
        for record, (equality, rows) in zip(rest, self._equalities, strict=True):
            record["row"] = self.inequalities + rows.start
            record["end"] = self.inequalities + rows.stop
            record["relax_speed"] = np.nan
            record["first"], record["last"] = numbers.of(equality)
            record["kernel"], has_room = kernels.place(kernel_of(equality))
            if not has_room:
                self._python_equalities.append((equality, rows))
        return records, own + [np.zeros(0)] * (MOST_LIMITS - len(own))

    def fill_constants(self, qp: QpArrays) -> None:
        """Write the rows that never change."""
        for equality, rows in self._equalities:
            if isinstance(equality, LinearEquality):
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
