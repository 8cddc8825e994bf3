"""The tasks that share one strict level, and their buffers."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from wbc_suite.kinematics import Configuration
from wbc_suite.qp.active_set import QpArrays, make_qp_arrays
from wbc_suite.qp.constraints import Constraints, with_rows
from wbc_suite.qp.joint_tasks import posture_error
from wbc_suite.qp.limit import unlimited_bounds
from wbc_suite.qp.part import STATE, Kernels, Numbers, kernel_of
from wbc_suite.qp.problem import Problem
from wbc_suite.qp.task import JointTask, RowTask, Task
from wbc_suite.qp.task_rows import TASK, LevelArrays
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

    Layout and results are those of the stack, in which this is level k; kernels and
    numbers are those of all its parts.

    Attributes:
        qp: Arrays of the problem, with the weighted rows of the tasks.
        arrays: What the kernels of `tick` read and write.
        python_parts: Tasks without a kernel.
    """

    def __init__(
        self,
        configuration: Configuration,
        tasks: Sequence[Task],
        layout: TickLayout,
        results: Records,
        kernels: Kernels,
        numbers: Numbers,
        *,
        k: int,
    ) -> None:
        above = sum(size for _, size in layout.equalities)
        above += sum(task.dim for level in layout.levels[:k] for task, _ in level)
        own, p, nv = results[f"level {k}"], layout.inequalities, configuration.nv
        self._rows = layout.levels[k]
        self._joint_tasks = [t for t in tasks if isinstance(t, JointTask)]
        joints, m = self._joint_tasks, len(own["e"])
        self.qp: QpArrays = make_qp_arrays(
            own["W"],
            own["e"],
            own["diagonal"],
            np.zeros(1),
            inequalities=p,
            equalities=len(own["multipliers"]) - nv - p,
            x=own["x"],
            multipliers=own["multipliers"],
        )
        self.arrays = LevelArrays(
            tasks=_records([task for task, _ in self._rows], numbers),
            joint_tasks=_records(joints, numbers),
            error=np.zeros(m),
            jacobian=np.zeros((m, nv)),
            cost=np.zeros(m),
            distances=own["distances"],
            joint_error=np.zeros((len(joints), nv)),
            squared_cost=np.reshape([t.squared_costs for t in joints], (-1, nv)),
            bias=np.zeros((2, nv)),
            qp=self.qp,
            above=np.zeros((above, nv)),
            kept=np.zeros((nv, nv)),
            kept_counts=np.zeros(2, dtype=np.int64),
        )
        q_index = unlimited_bounds(configuration).q_index
        places = [(t, rows, kernel_of(t)) for t, rows in self._rows]
        places += [(t, k, _joint_kernel(t, q_index)) for k, t in enumerate(joints)]
        self._python: list[tuple[Task, Any]] = []
        records = *self.arrays.tasks, *self.arrays.joint_tasks
        for (task, place, kernel), record in zip(places, records, strict=True):
            record["kernel"], has_room = kernels.place(kernel)
            if not has_room:
                self._python.append((task, place))
        self.python_parts = [task for task, _ in self._python]
        self._copies = self._attach_costs()

    def reset(self) -> None:
        """Discard the active set and the basis of the last tick."""
        self.qp.side[:] = 0
        self.arrays.kept_counts[:] = 0

    def state(self, problem: Problem) -> None:
        """Fill a problem of the right size with what a tick has stated."""
        qp = self.qp
        count, size = len(problem.rows), len(problem.upper)
        problem.H[:] = qp.W.T @ qp.W
        problem.H += np.diag(qp.diagonal[0] + qp.mu)
        problem.c[:] = -qp.W.T @ qp.e - qp.diagonal[1]
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
        finite = [
            *self.arrays.tasks["is_finite"],
            *self.arrays.joint_tasks["is_finite"],
        ]
        return tuple(
            t.name for t, known in zip(tasks, finite, strict=True) if not known
        )

    def _attach_costs(self) -> list[Vector]:
        """Let costs follow those of the tasks; return the copies."""
        copies = [self.arrays.cost[rows] for _, rows in self._rows]
        for (task, _), copy in zip(self._rows, copies, strict=True):
            task.cost_row.attach(copy)
        return copies

    def evaluate(self, configuration: Configuration) -> None:
        """Evaluate the tasks that have no kernel."""
        arrays = self.arrays
        for task, place in self._python:
            if isinstance(task, JointTask):
                task.evaluate(configuration, arrays.joint_error[place])
            else:
                error, jacobian = arrays.error[place], arrays.jacobian[place]
                task.evaluate(configuration, error, jacobian)


def tick_layout(
    configuration: Configuration, tasks: Sequence[Task], rows: Constraints
) -> TickLayout:
    """Return the names of a stack, and where its results are in one buffer."""
    nv, levels = configuration.nv, list[list[tuple[RowTask, slice]]]()
    fields: list[Any] = [
        ("x", float, (nv,)),
        ("v", float, (nv,)),
        ("state", float, (STATE.itemsize // 8,)),
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


def _records(tasks: Sequence[Task], numbers: Numbers) -> Records:
    """Return `TASK` records without kernels."""
    records, row = np.zeros(len(tasks), TASK), 0
    for record, task in zip(records, tasks, strict=True):
        record["first"], record["last"] = numbers.of(task)
        record["gain"], record["is_finite"] = task.gain, 1
        if isinstance(task, JointTask):
            record["speed"] = task.max_speed
        else:
            record["row"], record["end"] = row, row + task.dim
            record["angle"] = row + task.angular_start
            record["speed"], row = task.max_speeds, row + task.dim
    return records


def _joint_kernel(task: JointTask, q_index: Indices) -> Any:
    """Return the kernel of a task; joints with several parameters are Pinocchio's."""
    kernel, several = kernel_of(task), task.squared_costs[q_index < 0].any()
    return None if kernel is posture_error and several else kernel
