"""A stack of QP tasks under limits, solved once per tick."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wbc_suite.arguments import check_array, check_number
from wbc_suite.compiling import as_argument
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.constraints import Constraints, check_parts
from wbc_suite.qp.equality import Equality
from wbc_suite.qp.escape import Escape
from wbc_suite.qp.fallback import LevelSolver
from wbc_suite.qp.frame_task import FrameTask
from wbc_suite.qp.joint_limits import AccelerationLimit, PositionLimit, VelocityLimit
from wbc_suite.qp.level import Level, by_level, tick_layout
from wbc_suite.qp.limit import BoxLimit, Limit, LimitKind, unlimited_bounds
from wbc_suite.qp.part import (
    MAX_LEVELS,
    STATE,
    Kernels,
    Numbers,
    log_python_parts,
)
from wbc_suite.qp.problem import Problem
from wbc_suite.qp.report import TaskReport, TickRecord
from wbc_suite.qp.solution import Fallback, Solution
from wbc_suite.qp.solver import make_solver
from wbc_suite.qp.task import Task
from wbc_suite.qp.task_rows import PartArrays
from wbc_suite.qp.tick import (
    TOLERANCE,
    Taken,
    TickArrays,
    TickStatus,
    bind_kernels,
    solve_tick,
)
from wbc_suite.typing import Indices, Matrix, Records, Vector

_SOLVED = TickStatus.SOLVED.value
_JOINT_LIMITS = PositionLimit, VelocityLimit, AccelerationLimit


class TaskStack:
    """Tasks, limits and equality rows over one configuration.

    `solve` finds the step dq that minimises, level after level,

        sum_i || W_i (J_i dq - gain_i e_i) ||^2 + damping || dq ||^2
        subject to  A dq = b,  G dq <= h,  lb <= dq <= ub,

    each level within what leaves the rows of the levels above as they are. It never
    raises on what a robot or an operator may do: targets that are not finite hold what
    they control, rows that contradict each other are relaxed, and the `Solution`
    reports it.

    A tick is one compiled call of `tick.solve_tick`, which compiled loops may call with
    `arrays` themselves. The solver runs where it does not converge.

    Args:
        configuration: The robot; `solve` reads it, the caller moves it.
        tasks: They are bound: frames are resolved, targets that were not set hold the
            present pose.
        limits: Limits beside those of joints. One of `PositionLimit`, `VelocityLimit`
            and `AccelerationLimit` here takes the place of the default of its class.
        joint_limits: Whether the defaults of these three are added; without them the
            stack keeps `limits` alone.
        equalities: Rows that are kept exactly, before all tasks.
        solver: "daqp", or a name of qpsolvers.
        damping: Tikhonov term, [cost]^2/rad^2. 1e-3 removes the flutter at singular
            postures and does not move the point of rest.
        curvature_damping: Factor of a damping that follows the tasks' errors, see
            `task_rows.write_tasks`: it keeps targets that cannot be reached from
            making the robot flutter, and vanishes at targets that can. 0 is without.
        escape: Whether the stack may lead the robot out of postures from which no small
            step leads nearer to a frame's target; see `escape`.
        warm: Whether the active set of the last tick is tried before the solver; it
            solves most ticks, exactly. By default with daqp, so that a solver chosen
            by name is the one that runs.

    Attributes:
        v_previous: Velocity of the last tick, shape (nv,); write to set it.
        arrays: The argument of `solve_tick`.
        is_compiled: Whether a tick needs no Python: all parts have a kernel.

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
        limits: Sequence[Limit] = (),
        joint_limits: bool = True,
        equalities: Sequence[Equality] = (),
        solver: str = "daqp",
        damping: float = 1e-3,
        curvature_damping: float = 1.0,
        escape: bool = True,
        warm: bool | None = None,
    ) -> None:
        check_parts(configuration, tasks, limits, equalities)
        if joint_limits:
            missing = [x for x in _JOINT_LIMITS if not _has(limits, x)]
            limits = (*(kind() for kind in missing), *limits)
        self.configuration = configuration
        self.tasks, self.equalities = tuple(tasks), tuple(equalities)
        self.solver, self._limits = solver, tuple(limits)
        self.damping = check_number("TaskStack: damping", damping, above=0.0)
        self.curvature_damping = check_number(
            "TaskStack: curvature_damping", curvature_damping, least=0.0
        )
        self.bounds = unlimited_bounds(configuration)
        for limit in limits:
            if isinstance(limit, BoxLimit):
                limit.apply(configuration, self.bounds)
        qp = make_solver(solver)
        rows = self._constraints = Constraints(configuration, limits, self.equalities)
        for task in self.tasks:
            task.bind(configuration)
        parts = [*self.tasks, *self.equalities]
        numbers = Numbers(parts, [part.own(configuration) for part in parts])
        kernels = Kernels()
        self._layout = tick_layout(configuration, tasks, rows)
        self._buffer: Vector = np.zeros(self._layout.dtype.itemsize // 8)
        results = self._layout.results(self._buffer)
        self.levels = [
            Level(configuration, own, self._layout, results, kernels, numbers, k=k)
            for k, own in enumerate(by_level(tasks))
        ]
        rows.fill_constants(self.levels[0].qp)
        self._numbers = numbers  # targets follow their tasks as long as it exists
        self._tick = self._make_arrays(results, kernels, numbers, warm=warm)
        own = [part for x in (rows, *self.levels) for part in x.python_parts]
        self.is_compiled = not own
        self._state["alone"] = self._state["prepared"] = self.is_compiled
        log_python_parts(own)
        self.v_previous: Vector = self._tick.v
        self._level_solver = LevelSolver(configuration.q, self.levels, self._tick, qp)
        self.arrays = as_argument(self._tick)
        frames = [t for t in tasks if isinstance(t, FrameTask)]
        self._escape: Escape | None = None
        if escape and frames:
            self._escape = Escape(self, frames)
        self._is_alone = self._escape is None and self.is_compiled
        self._last: Solution | None = None

    def _make_arrays(
        self, results: Records, kernels: Kernels, numbers: Numbers, *, warm: bool | None
    ) -> TickArrays:
        """Gather what the kernel reads and writes."""
        rows, robot = self._constraints, self.configuration.robot
        records, own = rows.records(self.configuration, kernels, numbers)
        state = self._state = results["state"].view(STATE)
        state["levels"], state["damping"] = len(self.levels), self.damping
        state["curvature"] = self.curvature_damping
        state["warm"] = self.solver == "daqp" if warm is None else warm
        addresses = kernels.addresses(robot)
        levels = tuple(as_argument(level.arrays) for level in self.levels)
        levels += levels[-1:] * (MAX_LEVELS - len(levels))
        parts = PartArrays(
            robot=robot,
            kernels=addresses,
            own=tuple(own),
            rows=records,
            state=state,
            x=results["x"],
            levels=levels,
        )
        kernels_of_tick = bind_kernels(
            robot,
            as_argument(parts),
            levels[0],
            as_argument(self.levels[0].qp),
            has_rows=len(records) > 0,
            is_strict=len(self.levels) > 1,
        )
        return TickArrays(
            **kernels_of_tick,
            robot=robot,
            parts=parts,
            bounds=np.asarray(self.bounds),
            kinds=np.zeros(2 * self.configuration.nv, dtype=np.int64),
            v=results["v"],
            x=results["x"],
            before=results["before"],
            targets=np.zeros(len(numbers.values)),
        )

    def reset(self, v: Vector | None = None) -> None:
        """Discard the past, warm starts too; set the previous velocity, shape (nv,).

        After it the same inputs give bit-equal solutions.
        """
        what, shape = "TaskStack.reset: v", self.v_previous.shape
        self.v_previous[:] = 0.0 if v is None else check_array(what, v, shape)
        for part in (self._level_solver, *self.levels, self._constraints, self._escape):
            if part is not None:
                part.reset()
        for values in self._past:
            values[:] = 0.0
        self._last = None

    @property
    def memory(self) -> tuple[NDArray[Any], ...]:
        """What a tick leaves for the next one, as views; all else is set before it."""
        past = [x for level in self.levels for x in (level.qp.side, level.qp.mu)]
        limits = [x for limit in self._limits for x in getattr(limit, "memory", ())]
        return self._tick.v, *past, *self._past, self._numbers.values, *limits

    @property
    def _past(self) -> tuple[NDArray[Any], ...]:
        """Damping of earlier ticks, and what it follows from."""
        names = "pressure_damping", "overshoot_damping", "at_rest"
        state, tick = self._state, self._tick
        return *(state[name] for name in names), tick.before, tick.targets

    def target_of(self, task: Task) -> int:
        """Return the first number of a task's target, as compiled loops write it."""
        return self._numbers.of(task)[1] - task.target_row.values.size

    def prepare(self, dt: float) -> None:
        """Evaluate tasks, limits and equalities that have no kernel."""
        if not self.is_compiled:
            for level in self.levels:
                level.evaluate(self.configuration)
            self._constraints.prepare(self.configuration, dt, self.levels[0].qp)
        self._state["prepared"] = 1

    def solve(self, dt: float) -> Solution:
        """Return the step from the present configuration, which takes dt seconds.

        Raises:
            ConfigError: If dt is not positive and finite.
        """
        if not isinstance(dt, float) or not 0.0 < dt < math.inf:
            dt = check_number("TaskStack.solve: dt, a time,", dt, above=0.0)
        if not self._is_alone:
            q = self.configuration.q
            if math.isfinite(q.dot(q)):
                if self._escape is not None:
                    self._escape.update(dt)
                self.prepare(dt)
            self._state["prepared"] = 1
        status, k = solve_tick(self.arrays, dt, 0)
        if status == _SOLVED:
            self._last = self._read(Fallback.NONE)
            return self._last
        return self.complete(dt, status, k)

    def complete(self, dt: float, status: int, k: int) -> Solution:
        """Return the solution of a tick, after doing what the kernel could not do.

        Status and level k are those that `solve_tick` returned.
        """
        fallback = Fallback.NONE
        if status == TickStatus.NEEDS_PYTHON:
            self.prepare(dt)
            status, k = solve_tick(self.arrays, dt, 0)
        while status != TickStatus.SOLVED:
            if status == TickStatus.BAD_POSITION:
                self._tick.x[:] = self._tick.v[:] = 0.0
                fallback = Fallback.HOLD
                break
            is_finite = status != TickStatus.BAD_ROWS
            result = self._level_solver.solve_level(k, dt, is_finite=is_finite)
            fallback = max(fallback, result)
            taken = Taken.BY_PYTHON if result is Fallback.NONE else Taken.RELAXED
            self._state["taken"] = Taken.NOT if result is Fallback.LEVEL else taken
            if result is Fallback.LEVEL or result >= Fallback.BOX:
                k = len(self.levels) - 1  # the levels below are left out
            status, k = solve_tick(self.arrays, dt, k + 1)
        self._last = self._read(fallback)
        return self._last

    def problem(self) -> Problem:
        """Return the QP of the first level at the last tick, a buffer.

        Rows outside their limit are soft, see `Problem`.
        """
        problem, _ = self._level_solver.problem(0)
        self.levels[0].state(problem)
        return problem

    def solution(self) -> Solution:
        """Return the solution of the last tick, also of one that a kernel solved."""
        return self._read(Fallback.NONE)

    def _read(self, fallback: Fallback) -> Solution:
        """Copy the step and what explains it."""
        tick, nv = self._tick, self.configuration.nv
        values, solved = self._buffer.copy(), int(self._state["solved"][0])
        held: tuple[tuple[str, ...], ...] = ((),) * solved
        if not values[2 * nv + 1]:
            held = tuple(level.held() for level in self.levels[:solved])
        pressed: tuple[tuple[Indices, Matrix], ...] = ()
        subjects: dict[int, tuple[LimitKind, object, str]] = {}
        conflicts: tuple[str, ...] = ()
        if len(self.levels[0].qp.rows) or solved > 1:
            rows, p = self._constraints, self._layout.inequalities
            pressed = tuple(level.pressed() for level in self.levels[:solved])
            active = {int(i) for found, _ in pressed for i in found if i < p}
            subjects = {row: rows.subject(row) for row in active}
            if fallback >= Fallback.LIMITS and solved:
                conflicts = rows.violated(self.levels[0].qp, tick.x, TOLERANCE)
        kinds = tick.kinds.copy()
        driven = self._escape.driven if self._escape is not None else ()
        record = TickRecord(
            self._layout, values, kinds, held, pressed, subjects, driven
        )
        return Solution(
            values[:nv],
            values[nv : 2 * nv],
            fallback,
            float(values[2 * nv]),
            tuple(name for names in held for name in names),
            conflicts,
            record,
        )

    def copy(self) -> "TaskStack":
        """Return a copy on a copy of the robot, with daqp and without escape."""
        return TaskStack(
            Configuration(self.configuration.model, self.configuration.q),
            self.tasks,
            limits=self._limits,
            joint_limits=False,
            equalities=self.equalities,
            damping=self.damping,
            curvature_damping=self.curvature_damping,
            escape=False,
        )

    def pressed(self) -> Indices:
        """Return the velocity indices pressed against position limits last tick."""
        if not self._state["solved"][0]:
            return np.zeros(0, dtype=np.int64)
        multipliers = self.levels[0].qp.multipliers[: self.configuration.nv]
        lower, upper = self._tick.kinds.reshape(2, -1) == LimitKind.POSITION
        pressed = (multipliers > 0.0) & upper | (multipliers < 0.0) & lower
        return pressed.nonzero()[0]

    def record(self) -> TickRecord:
        """Return what explains the last tick, also after the next ones."""
        return (self._last or self.solution()).record

    def explain(
        self, *, position_tolerance: float = 1e-3, orientation_tolerance: float = 5e-3
    ) -> dict[str, TaskReport]:
        """Report how each task with rows stood at the last tick, and why.

        Costs some 50 us a task: meant for reports, not for every tick of a fast loop,
        which can keep a `record` and explain it later. See `TickRecord.explain`.
        """
        return self.record().explain(
            position_tolerance=position_tolerance,
            orientation_tolerance=orientation_tolerance,
        )


def _has(limits: Sequence[Limit], kind: type[Limit]) -> bool:
    return any(isinstance(limit, kind) for limit in limits)
