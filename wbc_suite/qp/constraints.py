"""The rows of a stack's limits and equalities: written, named, and told apart."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from wbc_suite.compiling import compiled
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.bounds import LimitKind
from wbc_suite.qp.equality import Equality
from wbc_suite.qp.limit import Limit, RowLimit
from wbc_suite.qp.problem import Problem
from wbc_suite.qp.solution import Pressure
from wbc_suite.typing import Array, Indices, Matrix, Vector

__all__ = ["Constraints"]


class Constraints:
    """Inequality rows, then equality rows, in the order in which a problem has them.

    Args:
        configuration: The robot; the rows are bound to it here.
        limits: Limits; those with rows are used.
        equalities: Equality rows.

    Attributes:
        inequalities: Number of inequality rows.
        dim: Number of equality rows.
    """

    def __init__(
        self,
        configuration: Configuration,
        limits: Sequence[Limit],
        equalities: Sequence[Equality],
    ) -> None:
        self._limits = [x for x in limits if isinstance(x, RowLimit)]
        self._equalities = tuple(equalities)
        for bound in (*self._limits, *self._equalities):
            bound.bind(configuration)
        self.inequalities = sum(x.dim for x in self._limits)
        self.dim = sum(x.dim for x in self._equalities)
        self._gives_way: Vector = np.repeat(
            [x.gives_way for x in self._limits], [x.dim for x in self._limits]
        )
        self._b: Vector = np.zeros(self.dim)
        self._names = configuration.velocity_names()

    def reset(self) -> None:
        """Let limits that remember how the robot moved forget it."""
        for limit in self._limits:
            limit.reset()

    def write(self, configuration: Configuration, dt: float, problem: Problem) -> bool:
        """Fill the rows of a problem; return whether a row is outside its limit.

        A row that is outside its limit does not bind to come back, or rows could demand
        more than joints can do: it wants to, softly, and binds to go no further out. So
        a robot that stands is never asked to move. Far outside it may give way, see
        `RowLimit.gives_way`.
        """
        row, outside = 0, False
        for limit in self._limits:
            rows = slice(row, row + limit.dim)
            limit.rows(configuration, dt, problem.G[rows], problem.h[rows])
            row = rows.stop
        if self._limits:
            outside = _let_out(problem.h, problem.wanted, self._gives_way, dt)
        row = 0
        for equality in self._equalities:
            rows = slice(row, row + equality.dim)
            equality.rows(configuration, dt, problem.A[rows], self._b[rows])
            row = rows.stop
        if self._equalities:
            problem.set_equalities(self._b)
        return outside

    def broken(self, problem: Problem, x: Vector, tolerance: float) -> tuple[str, ...]:
        """Return the names of the rows that a step does not keep."""
        names, row = list[str](), 0
        missed = np.abs(problem.A @ x - problem.b) > tolerance
        for equality in self._equalities:
            if missed[row : row + equality.dim].any():
                names.append(equality.name)
            row += equality.dim
        over = np.flatnonzero(problem.G @ x - problem.h > tolerance)
        return (*names, *(self._label(int(i))[1] for i in over))

    def press(
        self, levels: Sequence[Vector], kinds: Array | Indices
    ) -> Callable[[], Pressure]:
        """Return what tells how limits are pressed.

        Rows are named at once: the next tick may give them other words.

        Args:
            levels: Multipliers of each level's bounds and rows.
            kinds: The `LimitKind` of lower and upper bounds, 2 nv numbers.
        """
        tell, nv = partial(self.pressure, levels, kinds), len(self._names)
        rows = slice(nv, nv + self.inequalities)
        if not self.inequalities or not any(
            np.count_nonzero(level[rows]) for level in levels
        ):
            return tell
        pressure = tell()
        return lambda: pressure

    def pressure(self, levels: Sequence[Vector], kinds: Array | Indices) -> Pressure:
        """Merge the multipliers of levels, the greatest of each kept; see `press`."""
        nv = len(self._names)
        rows = nv + self.inequalities
        merged: Vector = levels[0][:rows] if levels else np.zeros(rows)
        for multipliers in levels[1:]:
            greater = np.abs(multipliers[:rows]) > np.abs(merged)
            merged = np.where(greater, multipliers[:rows], merged)
        labels: dict[int, tuple[LimitKind, str]] = {}
        if self.inequalities:
            pressed = merged[nv:].nonzero()[0]
            labels = {int(i): self._label(int(i)) for i in pressed}
        kinds = kinds.reshape(2, nv).astype(np.int64)
        return Pressure(merged, kinds, self._names, labels)

    def opponents(
        self, rows: Matrix, multipliers: Vector, kinds: Indices, *, first: bool
    ) -> Callable[[], Iterator[tuple[str, Vector]]]:
        """Return what yields words and force on the joints of what is pressed.

        Rows are named and copied at once, as by `press`.

        Args:
            rows: Of one level's problem.
            multipliers: Of its bounds and rows.
            kinds: See `pressure`.
            first: Whether the equality rows are these; else they stand for the levels
                above.
        """
        pressure = self.pressure([multipliers], kinds)
        copied = rows.copy()
        return lambda: self._opponents(pressure, multipliers, copied, first=first)

    def _opponents(
        self, pressure: Pressure, multipliers: Vector, rows: Matrix, *, first: bool
    ) -> Iterator[tuple[str, Vector]]:
        nv = rows.shape[1]
        for i in pressure.multipliers.nonzero()[0].tolist():
            row = np.eye(nv)[i] if i < nv else rows[i - nv]
            yield str(pressure.limit(i)), multipliers[i] * row
        n = self.inequalities
        forces = multipliers[nv + n :, None] * rows[n:]
        if not first:
            yield "conflict: tasks of a higher level", forces.sum(axis=0)
            return
        row = 0
        for equality in self._equalities:
            force = forces[row : row + equality.dim].sum(axis=0)
            yield f"conflict: {equality.name}", force
            row += equality.dim

    def _label(self, row: int) -> tuple[LimitKind, str]:
        """Return kind and words of an inequality row."""
        for limit in self._limits:
            if row < limit.dim:
                return limit.kind, limit.label(row)
            row -= limit.dim
        raise IndexError(row)


@compiled
def _let_out(h: Vector, wanted: Vector, gives_way: Vector, dt: float) -> bool:
    """Let rows want what they were to bind to; return whether any wants more.

    Args:
        h: In and out, what rows bind to, shape (n,).
        wanted: Output, what they lead to.
        gives_way: See `RowLimit.gives_way`, for each row.
        dt: Step, s.
    """
    outside = False
    for i in range(h.shape[0]):
        wanted[i] = h[i]
        h[i] = max(h[i], 0.0, -2.0 * (wanted[i] + gives_way[i] * dt))
        outside |= wanted[i] < h[i]
    return outside
