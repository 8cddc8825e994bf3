"""The tasks that share one strict level, and their buffers."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from wbc_suite.compiling import as_argument, by_address
from wbc_suite.kinematics import Configuration
from wbc_suite.qp.active_set import QpArrays, make_qp_arrays
from wbc_suite.qp.constraints import Constraints, with_rows
from wbc_suite.qp.frame_task import FrameTask
from wbc_suite.qp.kernel import Kernel, kernel_of
from wbc_suite.qp.limit import unlimited_bounds
from wbc_suite.qp.problem import Problem
from wbc_suite.qp.strict_level import LevelArrays
from wbc_suite.qp.task import JointTask, RowTask, Task
from wbc_suite.qp.task_kernels import TaskArrays, com_error, no_com
from wbc_suite.typing import Indices, Matrix, Records, Vector


@dataclass(frozen=True, slots=True)
class TickLayout:
    """Names of a stack's joints and rows, and where its results are in one buffer."""

    joints: tuple[str, ...]  # names of the velocities
    units: tuple[str, ...]  # of their positions
    equalities: Sequence[tuple[str, int]]  # name and number of rows of each
    inequalities: int  # number of rows
    levels: tuple[list[tuple[RowTask, slice]], ...]  # row tasks, each with its rows
    dtype: np.dtype[np.void]  # of all results; begins with "x" and "v"

    def results(self, buffer: Vector) -> Records:
        """Return a view of a buffer as a record, with one field for each level."""
        return buffer.view(self.dtype).reshape(())


class Level:
    """Tasks of one strict level with their arrays, and the arrays of their problem.

    Tasks are bound here. Layout and results are those of the stack, in which this is
    level k.

    Attributes:
        tasks: Arrays of the tasks.
        qp: Arrays of the problem.
        arrays: What the kernels of `tick` read and write.
        python_parts: Tasks without a kernel.
    """

    def __init__(
        self,
        configuration: Configuration,
        tasks: Sequence[Task],
        layout: TickLayout,
        results: Records,
        *,
        k: int,
    ) -> None:
        for task in tasks:
            task.bind(configuration)
        above = sum(size for _, size in layout.equalities)
        above += sum(task.dim for level in layout.levels[:k] for task, _ in level)
        own, p, nv = results[f"level {k}"], layout.inequalities, configuration.nv
        multipliers = own["multipliers"]
        self._rows = layout.levels[k]
        self._joint_tasks = [t for t in tasks if isinstance(t, JointTask)]
        rows, finite = [task for task, _ in self._rows], results["all_finite"]
        self.tasks = _task_arrays(configuration, rows, self._joint_tasks, own, finite)
        self.qp: QpArrays = make_qp_arrays(
            self.tasks.W,
            self.tasks.e,
            self.tasks.diagonal,
            self.tasks.mu,
            inequalities=p,
            equalities=len(multipliers) - nv - p,
            x=own["x"],
            multipliers=multipliers,
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
        kernels = *self.tasks.kernel, *self.tasks.joint_kernel
        pairs = zip((*rows, *self._joint_tasks), kernels, strict=True)
        self.python_parts = [task for task, kernel in pairs if not kernel]
        self.evaluate(configuration, Kernel.CONSTANT)

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
        tasks = *(task for task, _ in self._rows), *self._joint_tasks
        held = *np.isnan(self.tasks.distances[:, 0]), *(self.tasks.joint_finite == 0)
        return tuple(t.name for t, is_held in zip(tasks, held, strict=True) if is_held)

    def _attach_rows(self) -> list[Vector]:
        """Let targets and costs follow those of the tasks; return the copies."""
        tasks, copies = self.tasks, list[Vector]()
        for (task, rows), target in zip(self._rows, tasks.target, strict=True):
            copies += [tasks.cost[rows], target[: task.target_row.values.size]]
            task.cost_row.attach(copies[-2])
            task.target_row.attach(copies[-1])
        for task, target in zip(self._joint_tasks, tasks.joint_target, strict=True):
            copies.append(target[: task.target_row.values.size])
            task.target_row.attach(copies[-1])
        return copies

    def evaluate(self, configuration: Configuration, kernel: Kernel) -> None:
        """Evaluate all tasks of a kind in Python."""
        tasks = self.tasks
        for k in np.flatnonzero(tasks.kernel == kernel).tolist():
            task, rows = self._rows[k]
            task.evaluate(configuration, tasks.error[rows], tasks.jacobian[rows])
        for k in np.flatnonzero(tasks.joint_kernel == kernel).tolist():
            self._joint_tasks[k].evaluate(configuration, tasks.joint_error[k])


def tick_layout(
    configuration: Configuration, tasks: Sequence[Task], rows: Constraints
) -> TickLayout:
    """Return the names of a stack, and where its results are in one buffer."""
    nv, levels = configuration.nv, list[list[tuple[RowTask, slice]]]()
    fields: list[Any] = [
        ("x", float, (nv,)),
        ("v", float, (nv,)),
        ("residual", float, (1,)),
        ("all_finite", float, (1,)),
        ("overshoot_damping", float, (1,)),
        ("before", float, (2, nv)),
    ]
    for k, own in enumerate(by_level(tasks)):
        level, m = with_rows([task for task in own if isinstance(task, RowTask)])
        levels.append(level)
        size = nv + rows.inequalities + (nv if k else rows.equalities)
        results = [
            ("distances", float, (len(level), 2)),
            ("W", float, (m, nv)),
            ("e", float, (m,)),
            ("diagonal", float, (2, nv)),
            ("x", float, (nv,)),
            ("multipliers", float, (size,)),
        ]
        fields.append((f"level {k}", results))
    return TickLayout(
        joints=configuration.velocity_names(),
        units=configuration.velocity_units(),
        equalities=rows.names,
        inequalities=rows.inequalities,
        levels=tuple(levels),
        dtype=np.dtype(fields),
    )


def by_level(tasks: Sequence[Task]) -> list[list[Task]]:
    """Return the tasks of each strict level, the first first."""
    numbers = sorted({task.level for task in tasks}) or [0]
    return [[task for task in tasks if task.level == k] for k in numbers]


def _task_arrays(
    configuration: Configuration,
    rows: Sequence[RowTask],
    joints: Sequence[JointTask],
    results: Records,
    all_finite: Vector,
) -> TaskArrays:
    """Return the arrays of bound tasks."""
    nv, nq, n, k = configuration.nv, configuration.nq, len(rows), len(joints)
    row_start = np.cumsum([0, *(task.dim for task in rows)], dtype=np.int64)
    angular = np.array([task.angular_start for task in rows], dtype=np.int64)
    m, supports = int(row_start[-1]), [task.support(configuration) for task in rows]
    q_index = unlimited_bounds(configuration).q_index
    joint, offset = np.zeros(n, dtype=np.int64), np.zeros((n, 12))
    for row, task in enumerate(rows):
        if isinstance(task, FrameTask):
            joint[row], offset[row] = task.joint, task.offset
    joint_kernel = [_joint_kernel(task, q_index) for task in joints]
    kernel = np.array([kernel_of(task) for task in rows], dtype=np.int64)
    com, vector = com_error if Kernel.COM in kernel else no_com, np.zeros(1)
    return TaskArrays(
        write_com=by_address(com, configuration.robot, vector, vector, np.eye(1)),
        kernel=kernel,
        joint=joint,
        offset=offset,
        target=np.zeros((n, 12)),
        row_start=row_start,
        angular_start=row_start[:-1] + angular,
        support_start=np.cumsum([0, *(len(s) for s in supports)], dtype=np.int64),
        support=np.concatenate([np.zeros(0), *supports]).astype(np.int64),
        error=np.zeros(m),
        jacobian=np.zeros((m, nv)),
        cost=np.zeros(m),
        gain=np.array([task.gain for task in rows], dtype=np.float64),
        max_speed=np.reshape([task.max_speeds for task in rows], (n, 2)),
        distances=results["distances"],
        joint_kernel=np.array(joint_kernel, dtype=np.int64),
        joint_target=np.zeros((k, nq)),
        joint_error=np.zeros((k, nv)),
        squared_cost=np.reshape([task.squared_costs for task in joints], (k, nv)),
        joint_gain=np.array([task.gain for task in joints], dtype=np.float64),
        joint_speed=np.array([task.max_speed for task in joints], dtype=np.float64),
        joint_finite=np.ones(k, dtype=np.int64),
        q_index=q_index,
        bias=np.zeros((2, nv)),
        W=results["W"],
        e=results["e"],
        diagonal=results["diagonal"],
        mu=np.zeros(1),
        all_finite=all_finite,
    )


def _joint_kernel(task: JointTask, q_index: Indices) -> Kernel:
    """Return the kernel of a task; joints with several parameters are Pinocchio's."""
    kernel, several = kernel_of(task), task.squared_costs[q_index < 0].any()
    return Kernel.PYTHON if kernel is Kernel.POSTURE and several else kernel
