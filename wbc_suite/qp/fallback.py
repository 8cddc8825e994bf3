"""How a tick is solved where its active set is not found, or has no solution.

A solver runs first, and daqp where it gives up. Where the first level has no solution,
easier problems are tried, the mildest first: relax inequality rows with slack; relax
equality rows too; damped least squares within the joints' bounds; stand still. The
bounds of joints are kept in all of them, with the acceleration window: rows that nearly
depend on each other have solutions of any speed, and without the window a robot that
was to keep them was measured to jump by 37 rad/s in each tick.
"""

from collections.abc import Sequence

import numpy as np

from wbc_suite.qp.joint_window import merge_bounds
from wbc_suite.qp.level import Level
from wbc_suite.qp.problem import UNBOUNDED, Problem, clip_step
from wbc_suite.qp.solution import Fallback
from wbc_suite.qp.solver import DaqpSolver, QpSolver
from wbc_suite.qp.tick import RETURN_WEIGHT, TOLERANCE, TickArrays, stiffness
from wbc_suite.typing import Matrix, Vector

_SLACK_WEIGHT = 1e2  # of a relaxed row against one that is led back
_SWEEPS = 100
_ROOM = 1e-11  # m or rad; so much wider are bounds that rounding may make infeasible


class LevelSolver:
    """Solves the levels of a stack one by one, by a solver or a fallback.

    The levels are as `solve_tick` has stated them at the positions q. The solver is for
    the first level; a fresh one of its kind is made for each size of problem below.
    Damping of overshoot also damps relaxed rows.
    """

    def __init__(
        self,
        q: Vector,
        levels: Sequence[Level],
        tick: TickArrays,
        solver: QpSolver,
    ) -> None:
        self._q, self._levels, self._tick, self.solver = q, levels, tick, solver
        self._problems: dict[tuple[int, int], tuple[Problem, QpSolver]] = {}

    def reset(self) -> None:
        """Discard all warm starts."""
        self.solver = self.solver.fresh()
        self._problems.clear()

    def solve_level(self, k: int, dt: float, *, is_finite: bool) -> Fallback:
        """Write step and multipliers of level k into its arrays; return what it took.

        `Fallback.LEVEL` writes nothing. `is_finite` is whether the level's rows are.
        """
        if k > 0:
            return self._solve_lower(k) if is_finite else Fallback.LEVEL
        level, (problem, solver) = self._levels[0], self.problem(0)
        result, fallback = None, Fallback.NONE
        if is_finite:
            level.state(problem)
            result = checked_solve(solver, problem)
            result = result or checked_solve(DaqpSolver(), problem)
        if result is None:
            problem.weight = RETURN_WEIGHT * stiffness(level.qp)
            if is_finite:
                damping = float(self._tick.parts.state["overshoot_damping"][0])
                *result, fallback = solve_relaxed(problem, damping=damping)
            else:
                lb, ub = self._bounds_without_acceleration(dt)
                still = np.clip(np.zeros(problem.nv), lb, ub)
                result, fallback = (still, np.zeros(len(problem.upper))), Fallback.HOLD
        level.qp.x[:], level.qp.multipliers[:] = result
        return fallback

    def _bounds_without_acceleration(self, dt: float) -> tuple[Vector, Vector]:
        """Return the bounds of a step that may change speeds at once, shape (nv,)."""
        tick, lower, upper = self._tick, *np.empty((2, len(self._tick.v)))
        bounds = tick.bounds.copy()
        bounds["a_max"] = np.inf
        merge_bounds(bounds, self._q, tick.v, dt, lower, upper, tick.kinds)
        return lower, upper

    def _solve_lower(self, k: int) -> Fallback:
        """Solve a level below the first."""
        level, first = self._levels[k], self._levels[0].qp
        problem, solver = self.problem(k)
        level.state(problem)
        result = checked_solve(solver, problem)
        if result is None:  # the only steps that are left may lie on the bounds
            bounds = slice(problem.nv + len(problem.G))
            problem.lower[bounds] -= _ROOM
            problem.upper[bounds] += _ROOM
            result = checked_solve(DaqpSolver(), problem)
        # Clipped again: over a short tick, that margin is a speed. Long rows are
        # more sensitive than their orthonormal basis.
        if result is None or not clip_step(
            result[0], first.rows, first.lower, first.upper, TOLERANCE
        ):
            return Fallback.LEVEL
        level.qp.x[:] = result[0]
        level.qp.multipliers[:] = 0.0
        level.qp.multipliers[: len(result[1])] = result[1]
        return Fallback.NONE

    def problem(self, k: int) -> tuple[Problem, QpSolver]:
        """Return buffers and a solver for a level's present size of problem."""
        p, rank = (int(count) for count in self._levels[k].qp.counts)
        if (k, rank) not in self._problems:
            solver = self.solver if k == 0 else self.solver.fresh()
            problem = Problem(len(self._tick.v), p, rank)
            self._problems[k, rank] = problem, solver
        return self._problems[k, rank]


def checked_solve(solver: QpSolver, problem: Problem) -> tuple[Vector, Vector] | None:
    """Solve, and pass on only what is finite and keeps the constraints.

    The step is clipped to the bounds, which it may have missed by rounding.
    """
    soft = problem.soft()
    result = solver.solve(problem.with_slack(soft) if len(soft) else problem)
    if result is None:
        return None
    x, multipliers = result
    if len(soft):
        x = x[: problem.nv].copy()
        multipliers = np.delete(multipliers, problem.nv + np.arange(len(soft)))
    if not clip_step(x, problem.rows, problem.lower, problem.upper, TOLERANCE):
        return None
    return x, multipliers


def solve_relaxed(
    problem: Problem, *, damping: float = 0.0
) -> tuple[Vector, Vector, Fallback]:
    """Return step, multipliers and fallback for a problem that has no solution.

    Daqp solves them, whichever solver failed: others take milliseconds for each.
    `damping` is added to that of relaxed rows, m^2/rad^2; see `tick`.
    """
    if result := checked_solve(DaqpSolver(), _loosened(problem.copy())):
        return *result, Fallback.LIMITS
    if result := _solve_with_slack(problem, damping):
        return *result, Fallback.SLACK
    nothing = np.zeros(len(problem.upper))
    x = box_least_squares(problem.H, problem.c, problem.lb, problem.ub, _SWEEPS)
    if np.isfinite(x).all():
        return x, nothing, Fallback.BOX
    still = np.clip(np.zeros(problem.nv), problem.lb, problem.ub)
    return still, nothing, Fallback.HOLD


def _loosened(problem: Problem) -> Problem:
    """Return a problem with slack s >= 0 on its rows, `G dq <= h + s`."""
    np.minimum(problem.wanted, problem.h, out=problem.wanted)
    problem.h[:] = UNBOUNDED
    problem.weight *= _SLACK_WEIGHT
    return problem


def _solve_with_slack(problem: Problem, damping: float) -> tuple[Vector, Vector] | None:
    """Solve with equality rows as heavy tasks and slack s >= 0 on `G dq <= h + s`.

    Rows that cannot be kept have a residual, so what damps unreachable tasks is needed
    here too, see `task_rows.write_tasks`: without it a robot whose feet and links
    contradict each other was measured to swing at full speed, 9.6 rad/s between ticks.
    """
    relaxed = _loosened(problem.copy(equalities=False))
    A, b, weight = problem.A, problem.b, relaxed.weight
    mu = damping + np.abs(A).max(axis=1, initial=0.0) @ np.abs(b)
    broken = np.maximum(0.0, -problem.wanted)
    mu += np.abs(problem.G).max(axis=1, initial=0.0) @ broken
    relaxed.H += weight * (A.T @ A + mu * np.eye(problem.nv))
    relaxed.c -= weight * (A.T @ b)
    result = checked_solve(DaqpSolver(), relaxed)
    if result is None:
        return None
    x, multipliers = result
    return x, np.concatenate([multipliers, weight * (A @ x - b)])


def box_least_squares(
    H: Matrix, c: Vector, lb: Vector, ub: Vector, sweeps: int
) -> Vector:
    """Minimise `0.5 x^T H x + c^T x` within `lb <= x <= ub` by coordinate descent.

    Needs no factorisation and cannot fail: every sweep lowers the cost and stays in the
    box. Source: projected Gauss-Seidel, Bertsekas (1999), "Nonlinear Programming", 2.7.
    """
    x = np.clip(np.zeros(len(c)), lb, ub)
    for _ in range(sweeps):
        before = x.copy()
        for i in range(len(c)):
            step = (c[i] + H[i] @ x) / H[i, i]
            x[i] = min(max(x[i] - step, lb[i]), ub[i])
        if np.array_equal(x, before):
            break
    return x
