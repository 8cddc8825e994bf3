"""Strict priorities: what the levels below the first may still decide."""

from collections.abc import Sequence
from enum import IntEnum

import numpy as np

from wbc_suite.compiling import compiled
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.array_table import ArrayTable, indices, matrix, vector
from wbc_suite.qp.active_set import solve_warm
from wbc_suite.qp.fallback import checked_solve
from wbc_suite.qp.level import Level
from wbc_suite.qp.problem import UNBOUNDED, Problem, clip_step, worst_violation
from wbc_suite.qp.row_space import decided_directions
from wbc_suite.qp.solver import QpSolver
from wbc_suite.qp.tick import (
    SOLVED,
    STATED,
    TOLERANCE,
    UNUSABLE,
    BoxField,
    RowField,
    write_rows,
)
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["LowerLevels"]

ROOM = 1e-11
"""m or rad; bounds are so much wider where the only steps that levels above allow lie
on them, and rounding decides whether there is any."""


class LowerField(IntEnum):
    """Arrays of a level below the first.

    Rows of all levels above; the rows of its own problem, inequalities above the basis
    of what is decided; their bounds; see `decided_directions`; the step of the level
    above; the active set; the answer, which is a step and multipliers.
    """

    ABOVE = 0
    ROWS = 1
    LOWER = 2
    UPPER = 3
    LENGTHS = 4
    KEPT = 5
    COUNTS = 6
    STEP = 7
    SIDE = 8
    ANSWER = 9


class LowerLevels:
    """Levels that are solved one after another within what those above leave open.

    Args:
        configuration: The robot.
        levels: All levels, the first too.
        first: The first level's problem.
        box: What `tick` knows about it, a table of `BoxField`.
        warm: Whether the active set of the last tick is tried before the solver.
        curvature: See `rows.damping_of_rows`.
    """

    def __init__(
        self,
        configuration: Configuration,
        levels: Sequence[Level],
        first: Problem,
        box: Indices,
        *,
        warm: bool,
        curvature: float,
    ) -> None:
        self._configuration, self._levels = configuration, levels
        self._first, self._box = first, box
        self._warm, self._curvature = warm, curvature
        above = np.cumsum([first.equalities, *(len(level.W) for level in levels)])
        self._buffers = [_Buffers(first, int(count)) for count in above[:-1]]
        self._problems: dict[tuple[int, int], tuple[Problem, QpSolver]] = {}

    def reset(self) -> None:
        """Forget the past."""
        self._problems.clear()
        for buffers in self._buffers:
            buffers.side[:] = 0
            buffers.counts[:] = 0

    def solve(
        self, k: int, x: Vector, dt: float, solver: QpSolver
    ) -> tuple[Matrix, Vector, Vector] | None:
        """Solve level k among the steps that all levels above rate like x.

        Those are `V dq = V x`, where V is an orthonormal basis of the equality rows and
        of all rows above. x itself is one of them, so the problem has a solution.

        Args:
            k: Which level, from 1.
            x: The step of the level above, shape (nv,).
            dt: Step, s.
            solver: A fresh one of its kind is made for each size of problem.

        Returns:
            The problem's rows, a view; its optimum and multipliers. None if it was not
            solved.
        """
        level, buffers = self._levels[k], self._buffers[k]
        upper = [self._first.A, *(above.W for above in self._levels[:k])]
        np.concatenate(upper, out=buffers.above)
        buffers.step[:] = x
        level.prepare(self._configuration, dt)
        outcome, mu, finite, rank = lower_tick(
            self._configuration.table,
            level.table,
            self._box,
            buffers.table,
            dt,
            self._levels[k - 1].mu,
            self._curvature,
            self._warm,
        )
        level.note(mu, finite=finite)
        if outcome == SOLVED:
            return buffers.answered(rank)
        return self._ask_solver(k, rank, solver) if outcome == STATED else None

    def _ask_solver(
        self, k: int, rank: int, solver: QpSolver
    ) -> tuple[Matrix, Vector, Vector] | None:
        """Solve a level as `lower_tick` has stated it."""
        buffers, first = self._buffers[k], self._first
        if (k, rank) not in self._problems:
            problem = Problem(first.nv, len(first.G), rank)
            self._problems[k, rank] = problem, solver.fresh()
        problem, solver = self._problems[k, rank]
        count = len(problem.rows)
        problem.rows[:] = buffers.rows[:count]
        problem.lower[:] = buffers.lower[: first.nv + count]
        problem.upper[:] = buffers.upper[: first.nv + count]
        self._levels[k].form(problem)
        result = checked_solve(solver, problem)
        if result is None:  # only just feasible: rounding may leave nothing
            bounds = slice(first.nv + len(first.G))
            problem.lower[bounds] -= ROOM
            problem.upper[bounds] += ROOM
            result = checked_solve(solver, problem)
        if result is None:
            return None
        # Clipped again: over a short tick, the room is a speed. Rows longer than 1 feel
        # more than their orthonormal basis.
        if not clip_step(result[0], first.rows, first.lower, first.upper, TOLERANCE):
            return None
        return problem.rows, *result


class _Buffers:
    """Arrays of one level, see `LowerField`."""

    def __init__(self, first: Problem, above: int) -> None:
        nv, rows = first.nv, len(first.G)
        self._nv, self._inequalities = nv, rows
        self.above: Matrix = np.zeros((above, nv))
        self.rows: Matrix = np.zeros((rows + nv, nv))
        self.lower: Vector = np.full(nv + rows + nv, -UNBOUNDED)
        self.upper: Vector = np.full(nv + rows + nv, UNBOUNDED)
        self.counts: Indices = np.zeros(2, dtype=np.int64)
        self.step: Vector = np.zeros(nv)
        self.side: Indices = np.zeros(nv, dtype=np.int64)
        self._answer: Vector = np.zeros(nv + len(self.upper))
        f = LowerField
        self._arrays = ArrayTable(
            LowerField,
            {
                f.ABOVE: self.above,
                f.ROWS: self.rows,
                f.LOWER: self.lower,
                f.UPPER: self.upper,
                f.LENGTHS: np.zeros(nv),
                f.KEPT: np.zeros((nv, nv)),
                f.COUNTS: self.counts,
                f.STEP: self.step,
                f.SIDE: self.side,
                f.ANSWER: self._answer,
            },
        )
        self.table = self._arrays.table

    def answered(self, rank: int) -> tuple[Matrix, Vector, Vector]:
        """Return rows, and copies of step and multipliers."""
        nv, rows = self._nv, self._inequalities + rank
        answer = self._answer[: 2 * nv + rows].copy()
        return self.rows[:rows], answer[:nv], answer[nv:]


@compiled
def lower_tick(
    robot: Indices,
    rows: Indices,
    box: Indices,
    lower: Indices,
    dt: float,
    damping: float,
    curvature: float,
    warm: bool,
) -> tuple[int, float, bool, int]:
    """State a level's problem, and answer it where the last active set leads there.

    Args:
        robot: Table of `RobotField`.
        rows: Table of `RowField`, of this level.
        box: Table of `BoxField`, of the first level.
        lower: Table of `LowerField`.
        dt: Step, s.
        damping: See `damping_of_rows`.
        curvature: See `damping_of_rows`.
        warm: Whether the last active set may answer.

    Returns:
        What came of it, see `tick`; mu of `damping_of_rows`; whether all targets were
        finite; how many directions the levels above decide.
    """
    own, G = matrix(lower, LowerField.ROWS), matrix(box, BoxField.ROWS)
    low, high = vector(lower, LowerField.LOWER), vector(lower, LowerField.UPPER)
    wanted, step = vector(box, BoxField.WANTED), vector(lower, LowerField.STEP)
    first_low, first_high = vector(box, BoxField.LOWER), vector(box, BoxField.UPPER)
    nv, n = step.shape[0], wanted.shape[0]
    V = own[n:]
    rank = decided_directions(
        matrix(lower, LowerField.ABOVE),
        V,
        vector(lower, LowerField.LENGTHS),
        matrix(lower, LowerField.KEPT),
        indices(lower, LowerField.COUNTS),
    )
    for i in range(nv):
        low[i], high[i] = first_low[i], first_high[i]
    for row in range(n + rank):
        y = 0.0
        for i in range(nv):
            if row < n:
                own[row, i] = G[row, i]
            y += own[row, i] * step[i]
        high[nv + row] = max(wanted[row], y) if row < n else y
        low[nv + row] = -UNBOUNDED if row < n else y
    mu, finite = write_rows(robot, rows, dt, damping, curvature)
    if not np.isfinite(mu):
        return UNUSABLE, mu, finite, rank
    if warm:
        answer = vector(lower, LowerField.ANSWER)
        for i in range(answer.shape[0]):
            answer[i] = 0.0
        x, end = answer[:nv], nv + n + rank
        answered = solve_warm(
            matrix(rows, RowField.W),
            vector(rows, RowField.E),
            V[:rank],
            high[nv + n : end],
            matrix(rows, RowField.DIAGONAL),
            mu,
            low[:nv],
            high[:nv],
            indices(lower, LowerField.SIDE),
            x,
            answer[nv : 2 * nv],
            answer[2 * nv + n : nv + end],
        )
        if answered:
            worst = worst_violation(x, own[: n + rank], low[:end], high[:end])
            # Rows longer than 1 feel more than their orthonormal basis.
            worst = max(worst, worst_violation(x, G, first_low, first_high))
            if worst <= TOLERANCE:
                return SOLVED, mu, finite, rank
    return STATED, mu, finite, rank
