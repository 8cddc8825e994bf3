"""A stack of QP tasks under limits, solved once per tick."""

from collections.abc import Sequence

import numpy as np

from wbc_suite.arguments import check_array, check_number
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.acceleration_limit import AccelerationLimit
from wbc_suite.qp.bending import RowBending
from wbc_suite.qp.bounds import LimitKind, merge_bounds
from wbc_suite.qp.constraints import Constraints
from wbc_suite.qp.equality import Equality
from wbc_suite.qp.escape import Escape
from wbc_suite.qp.fallback import checked_solve, retreat
from wbc_suite.qp.frame_task import FrameTask
from wbc_suite.qp.level import Level
from wbc_suite.qp.limit import BoxLimit, JointBounds, Limit
from wbc_suite.qp.parts import check_parts
from wbc_suite.qp.position_limit import PositionLimit
from wbc_suite.qp.problem import Problem
from wbc_suite.qp.report import TaskReport, level_reports
from wbc_suite.qp.row_space import DecidedDirections
from wbc_suite.qp.solution import Fallback, Solution
from wbc_suite.qp.solver import QpSolver, make_solver
from wbc_suite.qp.task import Task
from wbc_suite.qp.velocity_limit import VelocityLimit
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["TaskStack"]

_RETURN_WEIGHT = 1e2  # of a row that leads back, against the stiffest joint's cost
_TOLERANCE = 1e-7  # a row broken by more is reported as a conflict, m or rad


class TaskStack:
    """Tasks, limits and equality rows over one configuration.

    `solve` finds the step dq that minimises, level after level,

        sum_i || W_i (J_i dq - gain_i e_i) ||^2 + damping || dq ||^2
        subject to  A dq = b,  G dq <= h,  lb <= dq <= ub,

    each level within what leaves the rows of the levels above as they are. It never
    raises on what a robot or an operator may do: targets that are not finite hold what
    they watch, rows that contradict each other are relaxed, and the `Solution` says so.

    Args:
        configuration: The robot; `solve` reads it, the caller moves it.
        tasks: Tasks, see `Task.level` for priorities. The stack binds them: frames are
            resolved, and targets that were not set hold the present pose.
        limits: Limits; position, velocity and acceleration limits with their defaults
            when absent.
        equalities: Rows that are kept exactly, before all tasks.
        solver: "daqp", or a name that qpsolvers knows.
        damping: Tikhonov term, [cost]^2/rad^2. 1e-3 removes the flutter at singular
            postures and does not move the point of rest.
        curvature_damping: Factor of a damping that follows the tasks' errors, see
            `rows.normal_equations`: it keeps targets that cannot be reached from making
            the robot flutter, and vanishes at targets that can. 0 is without.
        escape: Whether the stack may lead the robot out of postures from which no small
            step leads nearer to a frame's target; see `escape`.
        warm: Whether the active set of the last tick is tried before the solver is
            asked; it answers most ticks, exactly. By default with daqp, so that a
            solver chosen by name is the one that runs.

    Raises:
        ConfigError: If an argument is out of range.
        UnknownNameError: If a frame, a joint or the solver is unknown.
        SolverError: If the solver is not installed.
    """

    def __init__(
        self,
        configuration: Configuration,
        tasks: Sequence[Task],
        *,
        limits: Sequence[Limit] | None = None,
        equalities: Sequence[Equality] = (),
        solver: str = "daqp",
        damping: float = 1e-3,
        curvature_damping: float = 1.0,
        escape: bool = True,
        warm: bool | None = None,
    ) -> None:
        check_parts(configuration, tasks, limits, equalities)
        if limits is None:
            limits = (PositionLimit(), VelocityLimit(), AccelerationLimit())
        self.configuration = configuration
        self.tasks, self.equalities = tuple(tasks), tuple(equalities)
        self.solver = solver
        self.damping = check_number("TaskStack: damping", damping, above=0.0)
        self.curvature_damping = check_number(
            "TaskStack: curvature_damping", curvature_damping, least=0.0
        )
        self._bounds = JointBounds.unlimited(configuration)
        for limit in limits:
            if isinstance(limit, BoxLimit):
                limit.apply(configuration, self._bounds)
        self._constraints = Constraints(configuration, limits, self.equalities)
        numbers = sorted({t.level for t in tasks}) or [0]
        self._levels = [
            Level(configuration, [t for t in tasks if t.level == k]) for k in numbers
        ]
        self._sides = [np.zeros(configuration.nv, dtype=np.int64) for _ in numbers]
        self._warm = solver == "daqp" if warm is None else warm
        rows = self._constraints.inequalities, self._constraints.dim
        self._problem = Problem(configuration.nv, *rows)
        self._solver = make_solver(solver)
        self._lower: dict[tuple[int, int], tuple[Problem, QpSolver]] = {}
        self._solved: list[tuple[Problem, Vector, Vector]] = []
        self._decided = [DecidedDirections(configuration.nv) for _ in numbers]
        self._bending = RowBending(self.curvature_damping)
        nv = configuration.nv
        self._kinds: Indices = np.zeros((2, nv), dtype=np.int64)
        self._no_window: Vector = np.full(nv, np.inf)
        self.v_previous: Vector = np.zeros(nv)
        bounds = self._bounds
        self._box = (
            configuration.q,
            bounds.q_index,
            bounds.q_lower,
            bounds.q_upper,
            bounds.position_gain,
            bounds.v_max,
            self.v_previous,
        )
        self._limits = tuple(limits)
        self._bias: Matrix | None = None
        frames = [t for t in tasks if isinstance(t, FrameTask)]
        self._escape = (
            Escape(configuration, frames, self._bounds, self._shadow)
            if escape and frames
            else None
        )

    def reset(self, v: Vector | None = None) -> None:
        """Forget the past, warm starts too; set the previous velocity, shape (nv,).

        After it the same inputs give bit-equal answers.
        """
        if v is None:
            self.v_previous[:] = 0.0
        else:
            shape = (self.configuration.nv,)
            self.v_previous[:] = check_array("TaskStack.reset: v", v, shape)
        self._solver = self._solver.fresh()
        self._lower.clear()
        self._solved.clear()
        for decided in self._decided:
            decided.forget()
        self._bending.forget()
        self._constraints.reset()
        for side in self._sides:
            side[:] = 0
        if self._escape is not None:
            self._escape.reset()

    def solve(self, dt: float) -> Solution:
        """Return the step from the present configuration.

        Args:
            dt: Duration of the step, s.

        Raises:
            ConfigError: If dt is not positive and finite.
        """
        if not isinstance(dt, float) or not 0.0 < dt < np.inf:
            dt = check_number("TaskStack.solve: dt, a time,", dt, above=0.0)
        problem = self._problem
        if not self._write_box(self._bounds.a_max, dt, problem.lb, problem.ub):
            still = np.zeros(self.configuration.nv)
            self._solved.clear()
            return self._answer(still, Fallback.HOLD, dt, 0.0)
        if self._escape is not None:
            self._bias = self._escape.bias(dt, self.v_previous, self._pressed)
        self._constraints.write(self.configuration, dt, self._problem)
        x, multipliers, fallback = self._solve_first(dt)
        if len(self._problem.rows):
            kept = fallback is Fallback.NONE  # what is relaxed has its own damping
            pressing = kept * multipliers[self._problem.nv :]
            self._bending.note(self._problem.rows, pressing, dt)
        self._solved = [(self._problem, x, multipliers)]
        for k in range(1, len(self._levels)):
            if fallback >= Fallback.BOX:
                break
            result = self._solve_lower(k, x, dt)
            if result is None:
                fallback = max(fallback, Fallback.LEVEL)
                break
            x = result[1]
            self._solved.append(result)
        return self._answer(x, fallback, dt, self._problem.violation(x))

    def problem(self) -> Problem:
        """Return the QP of the first level at the last tick: a view, valid until next.

        After a retreat its bounds are those without acceleration limits. What rows
        outside their limit want is beside it, see `Problem`.
        """
        self._levels[0].form(self._problem)
        return self._problem

    def step(self, dt: float, bias: Matrix | None) -> None:
        """Solve and move the configuration one step, with a bias on single joints."""
        self._bias = bias
        self.configuration.update(self.configuration.integrate(self.solve(dt).dq))

    def _shadow(self) -> "TaskStack":
        """Return a copy of the stack on a copy of the robot, where it is now."""
        return TaskStack(
            Configuration(self.configuration.model, self.configuration.q),
            self.tasks,
            limits=self._limits,
            equalities=self.equalities,
            solver=self.solver,
            damping=self.damping,
            curvature_damping=self.curvature_damping,
            escape=False,
            warm=self._warm,
        )

    def _pressed(self) -> Indices:
        """Return the velocity indices pressed against position limits last tick."""
        if not self._solved:
            return np.zeros(0, dtype=np.int64)
        multipliers = self._solved[0][2][: self._problem.nv]
        upper = multipliers > 0.0
        at_position = self._kinds == LimitKind.POSITION
        pressed = (upper & at_position[1]) | ((multipliers < 0.0) & at_position[0])
        return pressed.nonzero()[0]

    def explain(
        self, *, position_tolerance: float = 1e-3, orientation_tolerance: float = 5e-3
    ) -> dict[str, TaskReport]:
        """Tell how each task with rows stood at the last tick, and why.

        Costs some 50 us a task: meant for reports, not for every tick of a fast loop.

        Args:
            position_tolerance: Distance that counts as reached, m.
            orientation_tolerance: Angle that counts as reached, rad.
        """
        reports: dict[str, TaskReport] = {}
        for level, (problem, x, multipliers) in zip(
            self._levels, self._solved, strict=False
        ):
            first = problem is self._problem
            opponents = list(
                self._constraints.opponents(
                    problem, multipliers, self._kinds, first=first
                )
            )
            reports |= level_reports(
                level, x, opponents, position_tolerance, orientation_tolerance
            )
        return reports

    def _write_box(self, a_max: Vector, dt: float, lb: Vector, ub: Vector) -> bool:
        """Merge the joints' limits into bounds; False if q is not finite."""
        return merge_bounds(*self._box, a_max, dt, lb, ub, *self._kinds)

    def _write(self, k: int, dt: float) -> bool:
        """Write the rows of level k; what damps a level damps those below it too."""
        return self._levels[k].write(
            self.configuration,
            dt,
            damping=self._levels[k - 1].mu if k else self.damping + self._bending.value,
            curvature=self.curvature_damping,
            bias=None if k else self._bias,
        )

    def _optimum(
        self, level: Level, problem: Problem, solver: QpSolver, side: Indices
    ) -> tuple[Vector, Vector] | None:
        """Solve a level: by the active set of the last tick, else by the solver."""
        leading_back = self._constraints.inequalities > 0 and len(problem.soft()) > 0
        warm = self._warm and not leading_back
        result = level.warm_optimum(problem, side) if warm else None
        if result is not None and problem.violation(result[0]) <= _TOLERANCE:
            return result
        level.form(problem)
        if leading_back:
            problem.weight = _RETURN_WEIGHT * level.stiffness()
        return checked_solve(solver, problem)

    def _solve_first(self, dt: float) -> tuple[Vector, Vector, Fallback]:
        """Solve the first level under all constraints, or retreat."""
        problem, level = self._problem, self._levels[0]
        finite = self._write(0, dt)
        if finite:
            result = self._optimum(level, problem, self._solver, self._sides[0])
            if result is not None:
                return *result, Fallback.NONE
        lb, ub = np.empty(problem.nv), np.empty(problem.nv)
        self._write_box(self._no_window, dt, lb, ub)
        if not finite:
            still = np.clip(np.zeros(problem.nv), lb, ub)
            return still, np.zeros(len(problem.upper)), Fallback.HOLD
        problem.weight = _RETURN_WEIGHT * level.stiffness()
        return retreat(self._solver, problem, lb=lb, ub=ub)

    def _solve_lower(
        self, k: int, x: Vector, dt: float
    ) -> tuple[Problem, Vector, Vector] | None:
        """Solve level k among the steps that all levels above rate like x.

        Those are `V dq = V x`, where V is an orthonormal basis of the equality rows and
        of all rows above. x itself is one of them, so the problem has a solution.
        """
        first = self._problem
        above = [first.A, *(level.W for level in self._levels[:k])]
        V = self._decided[k].basis(np.concatenate(above))
        rank = len(V)
        if (k, rank) not in self._lower:
            problem = Problem(first.nv, len(first.G), rank)
            self._lower[k, rank] = problem, self._solver.fresh()
        problem, solver = self._lower[k, rank]
        problem.lb[:], problem.ub[:] = first.lb, first.ub
        problem.G[:], problem.h[:] = first.G, np.maximum(first.wanted, first.G @ x)
        problem.A[:] = V
        problem.set_equalities(V @ x)
        if not self._write(k, dt):
            return None
        result = self._optimum(self._levels[k], problem, solver, self._sides[k])
        if result is None or first.violation(result[0]) > _TOLERANCE:
            return None  # rows longer than 1 feel more than their orthonormal basis
        return problem, *result

    def _answer(
        self, x: Vector, fallback: Fallback, dt: float, residual: float
    ) -> Solution:
        """Remember the velocity and tell what happened."""
        v = x / dt
        self.v_previous[:] = v
        return Solution(
            dq=x,
            v=v,
            fallback=fallback,
            residual=residual,
            held=tuple([name for level in self._levels for name in level.held]),
            conflicts=self._constraints.broken(self._problem, x, _TOLERANCE)
            if fallback >= Fallback.LIMITS
            else (),
            pressure=self._constraints.pressure(
                [m for _, _, m in self._solved], self._kinds
            ),
        )
