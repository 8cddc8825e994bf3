"""The rows of all tasks that share one strict level."""

from collections.abc import Sequence

import numpy as np

from wbc_suite.kinematics import Configuration
from wbc_suite.qp.frame_task import FrameTask
from wbc_suite.qp.problem import Problem
from wbc_suite.qp.rows import PACKED, frame_rows, normal_equations
from wbc_suite.qp.task import DiagonalTask, RowTask, Task
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["Level"]


class Level:
    """Buffers and row layout of one level: `H = W^T W + D`, `c = -W^T e - d`.

    Frame tasks are written together by one compiled kernel, other row tasks by their
    own `rows`, and diagonal tasks never become rows at all.

    Attributes:
        row_tasks: Tasks with rows, in the order of the rows.
        diagonal_tasks: Tasks on single joints.
        W: Weighted rows, shape (m, nv).
        e: Weighted steps, shape (m,).
        slices: Where each row task's rows are.
        errors: Error before saturation of row tasks that are not plain frame tasks.
        held: Names of the tasks whose target was not finite at the last tick.
    """

    def __init__(self, configuration: Configuration, tasks: Sequence[Task]) -> None:
        for task in tasks:
            task.bind(configuration)
        self.row_tasks = [t for t in tasks if isinstance(t, RowTask)]
        self.diagonal_tasks = [t for t in tasks if isinstance(t, DiagonalTask)]
        self._starts = np.cumsum([0] + [t.dim for t in self.row_tasks])
        self.slices = [
            slice(a, b)
            for a, b in zip(self._starts[:-1], self._starts[1:], strict=True)
        ]
        self.W: Matrix = np.zeros((int(self._starts[-1]), configuration.nv))
        self.e: Vector = np.zeros(len(self.W))
        self.diagonal: Matrix = np.zeros((2, configuration.nv))
        self.held: list[str] = []
        self.errors: dict[str, Vector] = {}
        self._support = _concatenate([t.support(configuration) for t in self.row_tasks])
        self._others = [
            (t, self.W[s], self.e[s])
            for t, s in zip(self.row_tasks, self.slices, strict=True)
            if type(t) is not FrameTask
        ]
        self._bind_frames(configuration)

    def _bind_frames(self, configuration: Configuration) -> None:
        model = configuration.model
        pairs = [
            (t, s.start)
            for t, s in zip(self.row_tasks, self.slices, strict=True)
            if type(t) is FrameTask
        ]
        self._frames = [t for t, _ in pairs]
        frames = [model.frames[t.frame_index] for t in self._frames]
        self._joints = np.array([f.parentJoint for f in frames], dtype=np.int64)
        self._offsets = np.array(
            [[*f.placement.rotation.ravel(), *f.placement.translation] for f in frames]
        ).reshape(len(frames), 12)
        self._first_row = np.array([row for _, row in pairs], dtype=np.int64)
        self._frame_support = _concatenate(
            [t.support(configuration) for t in self._frames]
        )
        self._packed: Matrix = np.zeros((len(frames), PACKED))
        self.frame_errors: Matrix = np.zeros((len(frames), 2))

    def assemble(
        self,
        configuration: Configuration,
        dt: float,
        problem: Problem,
        *,
        damping: float,
        curvature: float,
        bias: Matrix | None = None,
    ) -> float:
        """Fill the cost of a problem; return mu of `normal_equations`.

        A bias, shape (2, nv), adds squared costs and weighted steps on single joints.
        """
        self.held.clear()
        self.errors.clear()
        if self._frames:
            self._write_frames(configuration, dt)
        for task, W, e in self._others:
            error = task.rows(configuration, dt, W, e)
            self.errors[task.name] = error
            if not np.isfinite(error).all():
                self.held.append(task.name)
        self.diagonal[:] = 0.0
        for task in self.diagonal_tasks:
            if not task.diagonal(configuration, dt, *self.diagonal):
                self.held.append(task.name)
        if bias is not None:
            self.diagonal += bias
        return normal_equations(
            self.W,
            self.e,
            self._starts,
            *self._support,
            self.diagonal,
            damping,
            curvature,
            problem.H,
            problem.c,
        )

    def error_of(self, task: RowTask) -> tuple[float, float]:
        """Return position (m) and orientation error (rad) of a task at the last tick.

        Tasks with fewer than six rows have one error, in their own unit.
        """
        if type(task) is FrameTask:
            position, angle = self.frame_errors[self._frames.index(task)]
            return float(position), float(angle)
        error = self.errors[task.name]
        return float(np.linalg.norm(error[:3])), float(np.linalg.norm(error[3:]))

    def _write_frames(self, configuration: Configuration, dt: float) -> None:
        for packed, task in zip(self._packed, self._frames, strict=True):
            packed[:] = task.packed
        finite = frame_rows(
            configuration.placements,
            configuration.joint_jacobians,
            self._joints,
            self._offsets,
            self._packed,
            self._first_row,
            *self._frame_support,
            dt,
            self.W,
            self.e,
            self.frame_errors,
        )
        if not finite:
            bad = ~np.isfinite(self.frame_errors[:, 0])
            self.held += [t.name for t, b in zip(self._frames, bad, strict=True) if b]


def _concatenate(lists: Sequence[Indices]) -> tuple[Indices, Indices]:
    """Return where each list begins in the concatenation, and the concatenation."""
    starts = np.cumsum([0] + [len(x) for x in lists]).astype(np.int64)
    joined = np.concatenate(lists) if lists else np.zeros(0)
    return starts, joined.astype(np.int64)
