"""The solution of one tick of a stack."""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from wbc_suite.qp.motion_reasons import Motion, reasons_to_move
from wbc_suite.qp.report import ActiveLimit, TaskReport, TickRecord
from wbc_suite.typing import Vector


class Fallback(IntEnum):
    """Which easier problem a tick had to solve, mildest first.

    `str` says what was done: limit rows were relaxed, and so on.
    """

    NONE = 0
    LEVEL = 1
    LIMITS = 2
    """By the least that accelerations allow."""
    SLACK = 3
    """The bounds of joints are kept."""
    BOX = 4
    """Damped least squares."""
    HOLD = 5
    """Inputs or results are not finite."""

    def __str__(self) -> str:
        return _SENTENCES[self]


_SENTENCES = (
    "solved as stated",
    "a lower level could not be solved and was left out",
    "limit rows were relaxed",
    "equality and limit rows were relaxed",
    "rows were left out, bounds of joints are kept",
    "the robot holds still",
)


class Solution(NamedTuple):
    """The step of one tick; `print` shows what each task lacks, and what holds it.

    It is a named tuple, because a frozen dataclass takes 3 us to make, which is more
    than the QP of an arm.

    Attributes:
        dq: Step in the tangent space, shape (nv,); integrate it, never add it to q.
        v: Velocity `dq / dt`, shape (nv,).
        fallback: Which easier problem was solved.
        residual: By how much the worst kept constraint is violated, in its own unit.
        held: Tasks whose target was not finite; what they control stands still.
        conflicts: Names of the equality rows and limits that could not be kept.
        record: What explains the tick.
    """

    dq: Vector
    v: Vector
    fallback: Fallback
    residual: float
    held: tuple[str, ...]
    conflicts: tuple[str, ...]
    record: TickRecord

    @property
    def active(self) -> tuple[ActiveLimit, ...]:
        """Limits that hold joints back, hardest pressed first."""
        return self.record.active()

    @property
    def ok(self) -> bool:
        """Whether the problem was solved as stated."""
        return self.fallback is Fallback.NONE and not self.held

    @property
    def motion(self) -> tuple[Motion, ...]:
        """Why the robot moves; empty while all joints stand.

        A joint that stands is no faster than 0.005 rad/s or m/s, so that between ticks
        with an empty `motion` no speed changes by more than 0.01.
        """
        return tuple(reasons_to_move(self.record, self.conflicts))

    def explain(
        self, *, position_tolerance: float = 1e-3, orientation_tolerance: float = 5e-3
    ) -> dict[str, TaskReport]:
        """Report every task with rows; see `TickRecord.explain`."""
        return self.record.explain(
            position_tolerance=position_tolerance,
            orientation_tolerance=orientation_tolerance,
        )

    def __str__(self) -> str:
        """Return the fallback, the fastest joint, every task and every active limit."""
        lines = [f"Solution: {self.fallback} (residual {self.residual:.1g})"]
        layout = self.record.layout
        if len(self.v):
            k = int(np.argmax(np.abs(self.v)))
            speed = f"{abs(self.v[k]):.3g} {layout.units[k]}/s"
            lines.append(f"  fastest joint: {layout.joints[k]}, {speed}")
        lines += [f"  {report}" for report in self.explain().values()]
        lines += [f"  moves: {reason}" for reason in self.motion]
        lines += [f"  active: {limit}" for limit in self.active]
        lines += [f"  not kept: {name}" for name in self.conflicts]
        lines += [f"  target not finite: {name}" for name in self.held]
        return "\n".join(lines)
