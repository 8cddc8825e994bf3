"""The rows of all tasks that share one strict level."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TypeVar

import numpy as np

from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.array_table import ArrayTable
from wbc_suite.qp.com_task import ComTask
from wbc_suite.qp.damping_task import DampingTask
from wbc_suite.qp.frame_task import FrameTask
from wbc_suite.qp.limit import JointBounds
from wbc_suite.qp.posture_task import PostureTask
from wbc_suite.qp.problem import Problem
from wbc_suite.qp.report import LevelRecord
from wbc_suite.qp.rows import normal_equations
from wbc_suite.qp.task import DiagonalTask, RowTask, Task
from wbc_suite.qp.tick import RowField
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["Level"]

AnyTask = TypeVar("AnyTask", bound=Task)


class Level:
    """Buffers and row layout of one level: `H = W^T W + D + mu I`, `c = -W^T e - d`.

    Frame, centre-of-mass and posture tasks are written by one compiled kernel, other
    tasks by their own `rows` and `diagonal` before it. A subclass of a compiled task
    counts as another: its methods are called.

    Args:
        configuration: The robot.
        tasks: Tasks of this level; they are bound here.

    Attributes:
        row_tasks: Tasks with rows, in the order of the rows.
        slices: Where each row task's rows are.
        W: Weighted rows, shape (m, nv).
        e: Weighted steps, shape (m,).
        diagonal: Squared weights and weighted steps of joints, shape (2, nv).
        mu: Damping of every joint at the last tick, see `rows.damping_of_rows`.
        held: Names of the tasks whose target was not finite at the last tick.
        is_interpreted: Whether there are tasks that are not compiled.
        table: What the kernels of `tick` read, by `RowField`.
    """

    def __init__(self, configuration: Configuration, tasks: Sequence[Task]) -> None:
        for task in tasks:
            task.bind(configuration)
        self.row_tasks = [t for t in tasks if isinstance(t, RowTask)]
        self._starts = np.cumsum([0] + [t.dim for t in self.row_tasks])
        self.slices = [
            slice(a, b)
            for a, b in zip(self._starts[:-1], self._starts[1:], strict=True)
        ]
        self.W: Matrix = np.zeros((int(self._starts[-1]), configuration.nv))
        self.e: Vector = np.zeros(len(self.W))
        self.held: tuple[str, ...] = ()
        self._support = _concatenate([t.support(configuration) for t in self.row_tasks])
        self._bind_frames(configuration)
        self._bind_coms()
        self._bind_joints(configuration, tasks)
        compiled = (*self._frames, *self._coms)
        self._others = [
            (t, self.W[s], self.e[s])
            for t, s in zip(self.row_tasks, self.slices, strict=True)
            if t not in compiled
        ]
        self.is_interpreted = len(self._others) + len(self._diagonals) > 0
        self._errors: dict[RowTask, Vector] = {}
        self.mu, self._biased = 0.0, False
        self._arrays = self._make_table()
        self.table = self._arrays.table

    def _rows_of(self, kind: type[AnyTask]) -> tuple[list[AnyTask], Indices]:
        """Return the tasks of exactly one class, and the first row of each."""
        found = [
            (t, s.start)
            for t, s in zip(self.row_tasks, self.slices, strict=True)
            if type(t) is kind
        ]
        return [t for t, _ in found], np.array(
            [row for _, row in found], dtype=np.int64
        )

    def _bind_frames(self, configuration: Configuration) -> None:
        self._frames, self._frame_row = self._rows_of(FrameTask)
        frames = [configuration.model.frames[t.frame_index] for t in self._frames]
        count = len(frames)
        self._joints = np.array([f.parentJoint for f in frames], dtype=np.int64)
        self._offsets: Matrix = np.array(
            [[*f.placement.rotation.ravel(), *f.placement.translation] for f in frames]
        ).reshape(count, 12)
        self._frame_support = _concatenate(
            [t.support(configuration) for t in self._frames]
        )
        self._frame_errors: Matrix = np.zeros((count, 2))

    def _bind_coms(self) -> None:
        self._coms, self._com_row = self._rows_of(ComTask)
        self._com_errors: Vector = np.zeros(len(self._coms))

    def _bind_joints(self, configuration: Configuration, tasks: Sequence[Task]) -> None:
        nv = configuration.nv
        self._q_index = JointBounds.unlimited(configuration).q_index
        many = self._q_index < 0  # joints with several parameters
        self._postures = [
            t
            for t in tasks
            if type(t) is PostureTask and not t.squared_costs[many].any()
        ]
        count = len(self._postures)
        self._posture_costs: Matrix = np.zeros((count, nv))
        self._posture_gains: Matrix = np.zeros((count, 2))
        for k, task in enumerate(self._postures):
            self._posture_costs[k] = task.squared_costs
            self._posture_gains[k] = task.gain, task.max_speed
        self._constant: Matrix = np.zeros((2, nv))
        self._diagonals: list[DiagonalTask] = []
        for task in tasks:
            if type(task) is DampingTask:
                self._constant[0] += task.squared_costs
            elif isinstance(task, DiagonalTask) and task not in self._postures:
                self._diagonals.append(task)
        self._given: Matrix = self._constant.copy()
        self.diagonal: Matrix = np.zeros((2, nv))

    def _make_table(self) -> ArrayTable:
        """Gather what the kernels read; targets where the tasks keep them."""
        f = RowField
        return ArrayTable(
            RowField,
            {
                f.FRAME_JOINTS: self._joints,
                f.FRAME_OFFSETS: self._offsets,
                f.FRAME_TASKS: _addresses([t.packed for t in self._frames]),
                f.FRAME_ROW: self._frame_row,
                f.FRAME_SUPPORT_START: self._frame_support[0],
                f.FRAME_SUPPORT: self._frame_support[1],
                f.FRAME_ERRORS: self._frame_errors,
                f.COM_TASKS: _addresses([t.packed for t in self._coms]),
                f.COM_ROW: self._com_row,
                f.COM_ERRORS: self._com_errors,
                f.Q_INDEX: self._q_index,
                f.POSTURE_COSTS: self._posture_costs,
                f.POSTURE_TARGETS: _addresses([t.target for t in self._postures]),
                f.POSTURE_GAINS: self._posture_gains,
                f.ROW_START: self._starts,
                f.SUPPORT_START: self._support[0],
                f.SUPPORT: self._support[1],
                f.W: self.W,
                f.E: self.e,
                f.GIVEN: self._given,
                f.DIAGONAL: self.diagonal,
            },
        )

    def prepare(
        self, configuration: Configuration, dt: float, bias: Matrix | None = None
    ) -> None:
        """Do what comes before the kernels: the terms of tasks that are not compiled.

        A bias, shape (2, nv), adds squared costs and weighted steps on single joints.
        """
        self.held = ()
        if self._biased or bias is not None or self._diagonals:
            self._given[:] = self._constant if bias is None else self._constant + bias
            self._biased = bias is not None
        if self.is_interpreted:
            self._write_others(configuration, dt)

    def note(self, mu: float, *, finite: bool) -> None:
        """Take in what a kernel has answered."""
        self.mu = mu
        if not finite:
            self._name_held()

    def record(self) -> Callable[[], LevelRecord]:
        """Return what tells of the last tick, also after the next ones.

        Few are ever asked, so the present only costs copies.
        """
        return partial(
            self._record,
            self.W.copy(),
            self.e.copy(),
            self.diagonal.copy(),
            self._frame_errors.copy(),
            self._com_errors.copy(),
            self._errors.copy(),
            self.held,
        )

    def _record(
        self,
        W: Matrix,
        e: Vector,
        diagonal: Matrix,
        of_frames: Matrix,
        of_coms: Vector,
        of_others: Mapping[RowTask, Vector],
        held: tuple[str, ...],
    ) -> LevelRecord:
        """Return the record of a tick from copies; errors are m and rad.

        Tasks with fewer than six rows have one error, in their own unit.
        """
        known: dict[RowTask, tuple[float, float]] = {
            task: (float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:])))
            for task, error in of_others.items()
        }
        frames = zip(self._frames, of_frames.tolist(), strict=True)
        known |= {task: (position, angle) for task, (position, angle) in frames}
        coms = zip(self._coms, of_coms.tolist(), strict=True)
        known |= {task: (distance, 0.0) for task, distance in coms}
        return LevelRecord(
            names=tuple(task.name for task in self.row_tasks),
            slices=self.slices,
            errors=[known[task] for task in self.row_tasks],
            held=held,
            W=W,
            e=e,
            diagonal=diagonal,
        )

    def stiffness(self) -> float:
        """Return the largest entry of H at the last tick, without damping."""
        squares = np.einsum("ij,ij->j", self.W, self.W) + self.diagonal[0]
        return max(1.0, float(squares.max()))

    def form(self, problem: Problem) -> None:
        """Fill H and c of a problem from the rows of the last tick."""
        normal_equations(
            self.W,
            self.e,
            self._starts,
            *self._support,
            self.diagonal,
            self.mu,
            problem.H,
            problem.c,
        )

    def _write_others(self, configuration: Configuration, dt: float) -> None:
        """Run the tasks outside the kernel."""
        for task in self._diagonals:
            if not task.diagonal(configuration, dt, *self._given):
                self.held += (task.name,)
        for task, W, e in self._others:
            error = task.rows(configuration, dt, W, e)
            self._errors[task] = error
            if not np.isfinite(error).all():
                self.held += (task.name,)

    def _name_held(self) -> None:
        for task, error in zip(self._frames, self._frame_errors, strict=True):
            if not np.isfinite(error[0]):
                self.held += (task.name,)
        for task, error in zip(self._coms, self._com_errors, strict=True):
            if not np.isfinite(error):
                self.held += (task.name,)
        for task, costs in zip(self._postures, self._posture_costs, strict=True):
            used = self._q_index[costs > 0.0]
            if not np.isfinite(task.target[used]).all():
                self.held += (task.name,)


def _concatenate(lists: Sequence[Indices]) -> tuple[Indices, Indices]:
    """Return where each list begins in the concatenation, and the concatenation."""
    starts = np.cumsum([0] + [len(x) for x in lists]).astype(np.int64)
    joined = np.concatenate(lists) if lists else np.zeros(0)
    return starts, joined.astype(np.int64)


def _addresses(arrays: Sequence[Vector]) -> Indices:
    return np.array([a.ctypes.data for a in arrays], dtype=np.int64)
