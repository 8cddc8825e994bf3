"""A stack of QP tasks under limits, solved once per tick."""

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from wbc_suite.arguments import check_array, check_number
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.array_table import ArrayTable
from wbc_suite.qp.acceleration_limit import AccelerationLimit
from wbc_suite.qp.bending import RowBending
from wbc_suite.qp.bounds import LimitKind
from wbc_suite.qp.constraints import Constraints
from wbc_suite.qp.equality import Equality
from wbc_suite.qp.escape import Escape
from wbc_suite.qp.fallback import checked_solve, retreat
from wbc_suite.qp.frame_task import FrameTask
from wbc_suite.qp.level import Level
from wbc_suite.qp.limit import BoxLimit, JointBounds, Limit
from wbc_suite.qp.lower_levels import LowerLevels
from wbc_suite.qp.parts import check_parts
from wbc_suite.qp.position_limit import PositionLimit
from wbc_suite.qp.problem import Problem
from wbc_suite.qp.report import TaskReport, TickRecord
from wbc_suite.qp.solution import Fallback, Solution
from wbc_suite.qp.solver import make_solver
from wbc_suite.qp.task import Task
from wbc_suite.qp.tick import LOST, SOLVED, STATED, TOLERANCE, BoxField, tick
from wbc_suite.qp.velocity_limit import VelocityLimit
from wbc_suite.typing import Array, Indices, Matrix, Vector

__all__ = ["TaskStack"]

_RETURN_WEIGHT = 1e2  # of a row that leads back, against the stiffest joint's cost


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
        self._warm = solver == "daqp" if warm is None else warm
        rows = self._constraints.inequalities, self._constraints.dim
        self._problem = Problem(configuration.nv, *rows)
        self._solver = make_solver(solver)
        self._solved: list[tuple[Matrix, Vector, Vector]] = []
        self._bending = RowBending(self.curvature_damping)
        nv = configuration.nv
        self._side: Indices = np.zeros(nv, dtype=np.int64)
        self._kinds: Indices = np.zeros((2, nv), dtype=np.int64)
        self.v_previous: Vector = np.zeros(nv)
        self._arrays = self._make_table()
        self._box = self._arrays.table
        self._lower = LowerLevels(
            configuration,
            self._levels,
            self._problem,
            self._box,
            warm=self._warm,
            curvature=self.curvature_damping,
        )
        self._limits = tuple(limits)
        self._bias: Matrix | None = None
        frames = [t for t in tasks if isinstance(t, FrameTask)]
        self._escape = (
            Escape(configuration, frames, self._bounds, self._shadow)
            if escape and frames
            else None
        )
        self._is_plain = len(self._levels) == 1 and len(self._problem.rows) == 0
        # Python code that reads q comes before the kernel, which would say it is lost.
        self._looks_first = (
            self._escape is not None
            or len(self._problem.rows) > 0
            or any(level.is_interpreted for level in self._levels)
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
        self._lower.reset()
        self._side[:] = 0
        self._solved.clear()
        self._bending.forget()
        self._constraints.reset()
        if self._escape is not None:
            self._escape.reset()

    def solve(self, dt: float) -> Solution:
        """Return the step from the present configuration.

        Args:
            dt: Duration of the step, s.

        Raises:
            ConfigError: If dt is not positive and finite.
        """
        if not isinstance(dt, float) or not 0.0 < dt < math.inf:
            dt = check_number("TaskStack.solve: dt, a time,", dt, above=0.0)
        if self._looks_first and not self._look(dt):
            return self._stand(dt)
        problem, leading_back = self._problem, False
        if len(problem.rows):
            leading_back = self._constraints.write(self.configuration, dt, problem)
        outcome, residual = self._tick(dt, warm=self._warm and not leading_back)
        if outcome == LOST:
            return self._stand(dt)
        if outcome == SOLVED:
            answer, fallback = self._first.copy(), Fallback.NONE
            of_x, of_v, of_multipliers, of_kinds = self._parts
            x, v = answer[of_x], answer[of_v]
            multipliers, kinds = answer[of_multipliers], answer[of_kinds]
        else:
            x, multipliers, fallback = self._ask_solver(
                dt, stated=outcome == STATED, leading_back=leading_back
            )
            v, residual, kinds = x / dt, problem.violation(x), self._kinds.copy()
            self.v_previous[:] = v
        self._solved = [(problem.rows, x, multipliers)]
        if self._is_plain:
            press = partial(self._constraints.pressure, [multipliers], kinds)
            held = self._levels[0].held
            return Solution(x, v, fallback, residual, held, (), press)
        if len(problem.rows):
            kept = fallback is Fallback.NONE  # what is relaxed has its own damping
            pressing = multipliers[problem.nv :]
            first = self._levels[0]
            pulls = first.W, first.e, first.diagonal[1]
            self._bending.note(problem.rows, pressing, pulls, dt, kept=kept)
        if len(self._levels) > 1:
            x, fallback = self._solve_lower(x, fallback, dt)
            v, residual = x / dt, problem.violation(x)
            self.v_previous[:] = v
        return self._answer(x, v, fallback, residual, kinds)

    def _look(self, dt: float) -> bool:
        """Let the escape see the robot; False where q is not finite."""
        q = self.configuration.q
        if not math.isfinite(q.dot(q)):
            return False
        if self._escape is not None:
            self._bias = self._escape.bias(dt, self.v_previous, self._pressed)
        return True

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

        Costs some 50 us a task: meant for reports, not for every tick of a fast loop,
        which can keep a `record` and be told later.

        Args:
            position_tolerance: Distance that counts as reached, m.
            orientation_tolerance: Angle that counts as reached, rad.
        """
        return self.record().explain(
            position_tolerance=position_tolerance,
            orientation_tolerance=orientation_tolerance,
        )

    def record(self) -> TickRecord:
        """Return what explains the last tick, also after the next ones."""
        solved = zip(self._levels, self._solved, strict=False)
        return TickRecord(
            [
                (
                    level.record(),
                    x,
                    self._constraints.opponents(
                        rows, multipliers, self._kinds, first=k == 0
                    ),
                )
                for k, (level, (rows, x, multipliers)) in enumerate(solved)
            ]
        )

    def _make_table(self) -> ArrayTable:
        """Gather what the kernel `tick` reads and writes beside the first level."""
        bounds, problem, f = self._bounds, self._problem, BoxField
        nv, last = problem.nv, 2 * problem.nv + len(problem.upper)
        self._first: Vector = np.zeros(last + 2 * nv)
        self._parts = (
            slice(0, nv),
            slice(nv, 2 * nv),
            slice(2 * nv, last),
            slice(last, None),
        )
        return ArrayTable(
            BoxField,
            {
                f.Q_LOWER: bounds.q_lower,
                f.Q_UPPER: bounds.q_upper,
                f.V_MAX: bounds.v_max,
                f.A_MAX: bounds.a_max,
                f.V_PREVIOUS: self.v_previous,
                f.KINDS: self._kinds,
                f.H: problem.H,
                f.C: problem.c,
                f.ROWS: problem.rows,
                f.EQUALITIES: problem.A,
                f.LOWER: problem.lower,
                f.UPPER: problem.upper,
                f.SIDE: self._side,
                f.ANSWER: self._first,
                f.WANTED: problem.wanted,
            },
        )

    def _tick(self, dt: float, *, warm: bool) -> tuple[int, float]:
        """Run the kernel; return its outcome and by how much a bound is broken."""
        level = self._levels[0]
        level.prepare(self.configuration, dt, self._bias)
        outcome, mu, finite, residual = tick(
            self.configuration.table,
            level.table,
            self._box,
            dt,
            self._bounds.position_gain,
            self.damping + self._bending.value,
            self.curvature_damping,
            warm,
        )
        level.note(mu, finite=finite)
        return outcome, residual

    def _ask_solver(
        self, dt: float, *, stated: bool, leading_back: bool
    ) -> tuple[Vector, Vector, Fallback]:
        """Solve the first level as it is stated, or retreat."""
        problem = self._problem
        if stated:
            if leading_back:
                problem.weight = _RETURN_WEIGHT * self._levels[0].stiffness()
            result = checked_solve(self._solver, problem)
            if result is not None:
                return *result, Fallback.NONE
        return self._retreat(dt, finite=stated)

    def _retreat(self, dt: float, *, finite: bool) -> tuple[Vector, Vector, Fallback]:
        """Find a step where the first level has no solution."""
        problem, bounds = self._problem, self._bounds
        q, kinds = self.configuration.q, self._kinds
        lb, ub = bounds.without_acceleration(q, self.v_previous, dt, kinds)
        if not finite:
            still = np.clip(np.zeros(problem.nv), lb, ub)
            return still, np.zeros(len(problem.upper)), Fallback.HOLD
        problem.weight = _RETURN_WEIGHT * self._levels[0].stiffness()
        return retreat(self._solver, problem, lb=lb, ub=ub)

    def _solve_lower(
        self, x: Vector, fallback: Fallback, dt: float
    ) -> tuple[Vector, Fallback]:
        """Let the lower levels, one after another, improve on the first one's step."""
        for k in range(1, len(self._levels)):
            if fallback >= Fallback.BOX:
                break
            result = self._lower.solve(k, x, dt, self._solver)
            if result is None:
                return x, max(fallback, Fallback.LEVEL)
            x = result[1]
            self._solved.append(result)
        return x, fallback

    def _stand(self, dt: float) -> Solution:
        """Answer a position that is not finite."""
        self._solved.clear()
        still = np.zeros(self.configuration.nv)
        self.v_previous[:] = 0.0
        return self._answer(still, still / dt, Fallback.HOLD, 0.0, self._kinds.copy())

    def _answer(
        self,
        x: Vector,
        v: Vector,
        fallback: Fallback,
        residual: float,
        kinds: Array | Indices,
    ) -> Solution:
        """Tell what happened."""
        held = self._levels[0].held
        for level in self._levels[1:]:
            held += level.held
        conflicts: tuple[str, ...] = ()
        if fallback is not Fallback.NONE and fallback >= Fallback.LIMITS:
            conflicts = self._constraints.broken(self._problem, x, TOLERANCE)
        multipliers = [multipliers for _, _, multipliers in self._solved]
        press = self._constraints.press(multipliers, kinds)
        return Solution(x, v, fallback, residual, held, conflicts, press)
