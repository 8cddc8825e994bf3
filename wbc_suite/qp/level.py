"""The tasks that share one strict level, and their buffers."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from wbc_suite.compiling import as_argument
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.active_set import QpArrays, make_qp_arrays
from wbc_suite.qp.constraints import Constraints
from wbc_suite.qp.frame_task import FrameTask
from wbc_suite.qp.kernel import Kernel, kernel_of
from wbc_suite.qp.limit import JointBounds
from wbc_suite.qp.problem import Problem
from wbc_suite.qp.strict_level import LevelArrays
from wbc_suite.qp.task import JointTask, RowTask, Task
from wbc_suite.qp.task_kernels import TaskArrays
from wbc_suite.typing import Array, Indices, Matrix, Vector


@dataclass(frozen=True, slots=True)
class LevelLayout:
    """Names of a level's row tasks, and where its results are in the stack's buffer.

    Attributes:
        names: The row tasks.
        units: Unit of each one's error.
        slices: Where each one's rows are.
        shapes: Shape of each array of results, in the order of the buffer.
        start: Where the first one begins.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    slices: tuple[slice, ...]
    shapes: Mapping[str, tuple[int, ...]]
    start: int

    @property
    def end(self) -> int:
        """Where the results end."""
        return self.start + sum(math.prod(shape) for shape in self.shapes.values())

    def views(self, buffer: Vector) -> dict[str, Array]:
        """Return the arrays of results in the stack's buffer, by name."""
        found: dict[str, Array] = {}
        start = self.start
        for name, shape in self.shapes.items():
            end = start + math.prod(shape)
            found[name] = buffer[start:end].reshape(shape)
            start = end
        return found


@dataclass(frozen=True, slots=True)
class TickLayout:
    """Names of a stack's joints and rows, and where its results are in one buffer.

    Attributes:
        joints: Names of the velocities.
        units: Their units.
        equalities: Name and number of rows of each equality.
        inequalities: Number of inequality rows.
        levels: Layouts of the levels.
    """

    joints: tuple[str, ...]
    units: tuple[str, ...]
    equalities: Sequence[tuple[str, int]]
    inequalities: int
    levels: tuple[LevelLayout, ...]


class Level:
    """Tasks of one level with their arrays, and the arrays of their problem.

    Args:
        configuration: The robot.
        tasks: Tasks of this level; they are bound here.
        layout: Where the results are, see `tick_layout`.
        buffer: The results of the stack.
        inequalities: Number of inequality rows of the stack.
        above: Number of rows of all levels above, and of the stack's equalities.

    Attributes:
        tasks: Arrays of the tasks.
        qp: Arrays of the problem.
        arrays: What the kernels of `tick` read and write.
        is_compiled: Whether all tasks have a kernel.
    """

    def __init__(
        self,
        configuration: Configuration,
        tasks: Sequence[Task],
        layout: LevelLayout,
        buffer: Vector,
        *,
        inequalities: int,
        above: int,
    ) -> None:
        for task in tasks:
            task.bind(configuration)
        self._row_tasks = [t for t in tasks if isinstance(t, RowTask)]
        self._joint_tasks = [t for t in tasks if isinstance(t, JointTask)]
        self._slices, views = layout.slices, layout.views(buffer)
        nv = configuration.nv
        views["all_finite"] = buffer[2 * nv + 1 : 2 * nv + 2]
        self.tasks = _task_arrays(
            configuration, self._row_tasks, self._joint_tasks, views
        )
        self.qp: QpArrays = make_qp_arrays(
            self.tasks.W,
            self.tasks.e,
            self.tasks.diagonal,
            self.tasks.mu,
            inequalities=inequalities,
            equalities=len(views["multipliers"]) - nv - inequalities,
            x=views["x"],
            multipliers=views["multipliers"],
        )
        self._kept_counts: Indices = np.zeros(2, dtype=np.int64)
        self.arrays = LevelArrays(
            tasks=as_argument(self.tasks),
            qp=as_argument(self.qp),
            above=np.zeros((above, nv)),
            lengths=np.zeros(nv),
            kept=np.zeros((nv, nv)),
            kept_counts=self._kept_counts,
        )
        self._copies = self._attach_rows()
        self.is_compiled = not any(
            kernel == Kernel.PYTHON
            for kernel in (*self.tasks.kernel, *self.tasks.joint_kernel)
        )
        self._evaluate(configuration, Kernel.CONSTANT)

    def prepare(self, configuration: Configuration) -> None:
        """Evaluate what has no kernel."""
        if not self.is_compiled:
            self._evaluate(configuration, Kernel.PYTHON)

    def reset(self) -> None:
        """Discard the active set and the basis of the last tick."""
        self.qp.side[:] = 0
        self._kept_counts[:] = 0

    def state(self, problem: Problem) -> None:
        """Fill a problem of the right size with what a tick has stated."""
        tasks, qp = self.tasks, self.qp
        count, size = len(problem.rows), len(problem.upper)
        problem.H[:] = tasks.W.T @ tasks.W
        problem.H += np.diag(tasks.diagonal[0] + tasks.mu)
        problem.c[:] = -tasks.W.T @ tasks.e - tasks.diagonal[1]
        problem.rows[:], problem.wanted[:] = qp.rows[:count], qp.wanted
        problem.lower[:], problem.upper[:] = qp.lower[:size], qp.upper[:size]
        problem.weight = float(qp.weight[0])

    def pressed(self) -> tuple[Indices, Matrix]:
        """Return the rows with a multiplier other than zero, and copies of them."""
        pressed = self.qp.multipliers[len(self.qp.x) :].nonzero()[0]
        return pressed, self.qp.rows[pressed]

    def held(self) -> tuple[str, ...]:
        """Return the names of the tasks whose target was not finite."""
        distances, finite = self.tasks.distance, self.tasks.joint_finite
        rows = np.isnan(distances[:, 0])
        held = [t.name for t, bad in zip(self._row_tasks, rows, strict=True) if bad]
        held += [
            t.name for t, ok in zip(self._joint_tasks, finite, strict=True) if not ok
        ]
        return tuple(held)

    def _attach_rows(self) -> list[Vector]:
        """Let targets and costs follow those of the tasks; return the copies."""
        copies: list[Vector] = []
        for k, task in enumerate(self._row_tasks):
            cost = self.tasks.cost[self._slices[k]]
            target = self.tasks.target[k, : task.target_row.values.size]
            task.cost_row.attach(cost)
            task.target_row.attach(target)
            copies += [cost, target]
        for k, task in enumerate(self._joint_tasks):
            target = self.tasks.joint_target[k, : task.target_row.values.size]
            task.target_row.attach(target)
            copies.append(target)
        return copies

    def _evaluate(self, configuration: Configuration, kernel: Kernel) -> None:
        """Evaluate all tasks of a kind in Python."""
        tasks = self.tasks
        for k in np.flatnonzero(tasks.kernel == kernel).tolist():
            rows = self._slices[k]
            self._row_tasks[k].evaluate(
                configuration, tasks.error[rows], tasks.jacobian[rows]
            )
        for k in np.flatnonzero(tasks.joint_kernel == kernel).tolist():
            self._joint_tasks[k].evaluate(configuration, tasks.joint_error[k])


def tick_layout(
    configuration: Configuration, tasks: Sequence[Task], rows: Constraints
) -> TickLayout:
    """Return where the results of a stack are in one buffer.

    First are the step, the velocity, the residual, and whether all targets are finite.
    """
    nv, layouts = configuration.nv, list[LevelLayout]()
    start = 2 * nv + 2
    for own in _by_level(tasks):
        row_tasks = [task for task in own if isinstance(task, RowTask)]
        ends = np.cumsum([0, *(task.dim for task in row_tasks)]).tolist()
        size = rows.inequalities + (nv if layouts else rows.equalities)
        layout = LevelLayout(
            names=tuple(task.name for task in row_tasks),
            units=tuple(task.unit for task in row_tasks),
            slices=tuple(slice(a, b) for a, b in pairwise(ends)),
            shapes={
                "distances": (len(row_tasks), 2),
                "W": (ends[-1], nv),
                "e": (ends[-1],),
                "diagonal": (2, nv),
                "x": (nv,),
                "multipliers": (nv + size,),
            },
            start=start,
        )
        start = layout.end
        layouts.append(layout)
    return TickLayout(
        joints=configuration.velocity_names(),
        units=configuration.velocity_units(),
        equalities=rows.names,
        inequalities=rows.inequalities,
        levels=tuple(layouts),
    )


def make_levels(
    configuration: Configuration,
    tasks: Sequence[Task],
    layout: TickLayout,
    buffer: Vector,
) -> list[Level]:
    """Return the strict levels, the first first; tasks are bound."""
    levels: list[Level] = []
    above = sum(size for _, size in layout.equalities)
    for own, place in zip(_by_level(tasks), layout.levels, strict=True):
        levels.append(
            Level(
                configuration,
                own,
                place,
                buffer,
                inequalities=layout.inequalities,
                above=above if levels else 0,
            )
        )
        above += len(levels[-1].tasks.e)
    return levels


def _by_level(tasks: Sequence[Task]) -> list[list[Task]]:
    """Return the tasks of each strict level, the first first."""
    numbers = sorted({task.level for task in tasks}) or [0]
    return [[task for task in tasks if task.level == k] for k in numbers]


def _task_arrays(
    configuration: Configuration,
    rows: Sequence[RowTask],
    joints: Sequence[JointTask],
    views: Mapping[str, Array],
) -> TaskArrays:
    """Return the arrays of bound tasks; results are views of one buffer."""
    nv, nq, n, k = configuration.nv, configuration.nq, len(rows), len(joints)
    row_start = np.cumsum([0, *(task.dim for task in rows)], dtype=np.int64)
    m, supports = int(row_start[-1]), [task.support(configuration) for task in rows]
    q_index = JointBounds.unlimited(configuration).q_index
    frames = [task if isinstance(task, FrameTask) else None for task in rows]
    angular = [
        start + task.angular_start
        for start, task in zip(row_start.tolist(), rows, strict=False)
    ]
    return TaskArrays(
        kernel=np.array([kernel_of(task) for task in rows], dtype=np.int64),
        joint=np.array([f.joint if f else 0 for f in frames], dtype=np.int64),
        offset=np.array([f.offset if f else np.zeros(12) for f in frames]).reshape(
            n, 12
        ),
        target=np.zeros((n, 12)),
        row_start=row_start,
        angular_start=np.array(angular, dtype=np.int64),
        support_start=np.cumsum([0, *(len(s) for s in supports)], dtype=np.int64),
        support=np.concatenate([np.zeros(0), *supports]).astype(np.int64),
        error=np.zeros(m),
        jacobian=np.zeros((m, nv)),
        cost=np.zeros(m),
        gain=np.array([task.gain for task in rows], dtype=np.float64),
        max_speed=np.array([task.max_speeds for task in rows]).reshape(n, 2),
        distance=views["distances"],
        joint_kernel=np.array(list(_joint_kernels(q_index, joints)), dtype=np.int64),
        joint_target=np.zeros((k, nq)),
        joint_error=np.zeros((k, nv)),
        squared_cost=np.array([task.squared_costs for task in joints]).reshape(k, nv),
        joint_gain=np.array([task.gain for task in joints], dtype=np.float64),
        joint_speed=np.array([task.max_speed for task in joints], dtype=np.float64),
        joint_finite=np.ones(k, dtype=np.int64),
        q_index=q_index,
        bias=np.zeros((2, nv)),
        W=views["W"],
        e=views["e"],
        diagonal=views["diagonal"],
        mu=np.zeros(1),
        all_finite=views["all_finite"],
    )


def _joint_kernels(q_index: Indices, tasks: Sequence[JointTask]) -> Iterator[Kernel]:
    """Yield the kernel of each; joints with several parameters are Pinocchio's."""
    for task in tasks:
        kernel, several = kernel_of(task), task.squared_costs[q_index < 0].any()
        is_posture = kernel is Kernel.POSTURE
        yield Kernel.PYTHON if is_posture and several else kernel
