"""Why a controlled frame is not at its goal: typed values that print themselves.

The reasons of a solver are in `qp.report`: `ActiveLimit`, `Conflict`, `OutOfReach`.
Here are those of the robot that follows its commands.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeAlias

import numpy as np

from wbc_suite.qp import ActiveLimit, LimitKind
from wbc_suite.qp.report import Reason as SolverReason
from wbc_suite.typing import Matrix

SINGULAR = 1e-3  # of the greatest mobility, and m or rad per rad; less counts as none


@dataclass(frozen=True, slots=True)
class Contact:
    """A link of the robot presses on a body or a geom of the world, such as `floor`.

    The force is the sum of the normal forces, N.
    """

    link: str
    other: str
    force: float

    def __str__(self) -> str:
        return f"contact: {self.link} - {self.other}"


@dataclass(frozen=True, slots=True)
class TrackingError:
    """A joint does not reach its target; the error is the distance, rad or m."""

    joint: str
    error: float

    def __str__(self) -> str:
        return f"lag: {self.joint}"


@dataclass(frozen=True, slots=True)
class TorqueLimit:
    """A joint does not reach its target, and its motor is at its limit."""

    joint: str
    error: float

    def __str__(self) -> str:
        return f"motor limit: {self.joint}"


@dataclass(frozen=True, slots=True)
class FreeAxes:
    """An arm has too few joints to turn its hand about these axes of the hand.

    They are `rx`, `ry`, `rz`, in the present posture.
    """

    axes: tuple[str, ...]

    def __str__(self) -> str:
        return f"too few joints: {', '.join(self.axes)} of the hand are free"


@dataclass(frozen=True, slots=True)
class InMotion:
    """The frame is moving to its goal."""

    def __str__(self) -> str:
        return "moving"


@dataclass(frozen=True, slots=True)
class NoSolution:
    """The solver found no solution."""

    def __str__(self) -> str:
        return "no solution"


Reason: TypeAlias = (
    SolverReason
    | Contact
    | TrackingError
    | TorqueLimit
    | FreeAxes
    | InMotion
    | NoSolution
)


def free_axes(jacobian: Matrix) -> FreeAxes:
    """Return about which axes a hand cannot be turned while its position is kept.

    The Jacobian, shape (6, n), is in the axes of the hand. An axis is free if most of a
    turn about it is none that the joints can make.
    """
    _, values, rows = np.linalg.svd(jacobian[:3])
    kept = rows[int((values > SINGULAR * values[0]).sum()) :].T
    turns, values, _ = np.linalg.svd(jacobian[3:] @ kept, full_matrices=False)
    reached = turns[:, values > SINGULAR]
    shares = (reached**2).sum(axis=1)
    names = ("rx", "ry", "rz")
    return FreeAxes(tuple(x for x, own in zip(names, shares, strict=True) if own < 0.5))


def is_transient(reason: Reason) -> bool:
    """Return whether a reason holds only while the frame moves."""
    if isinstance(reason, ActiveLimit):
        return reason.kind is LimitKind.ACCELERATION
    return isinstance(reason, InMotion)


class LazyReasons(Sequence[Reason]):
    """Reasons that are computed when they are first read; copies are plain lists.

    The function returns the same ones at any time.
    """

    def __init__(self, compute: Callable[[], Sequence[Reason]]) -> None:
        self._reasons = cache(lambda: tuple(compute()))

    def __getitem__(self, index: Any) -> Any:
        return self._reasons()[index]

    def __len__(self) -> int:
        return len(self._reasons())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, list | LazyReasons) and list(self) == list(other)

    __hash__ = None  # type: ignore[assignment]  # as of lists

    def __repr__(self) -> str:
        return repr(list(self))

    def __reduce__(self) -> tuple[type[list[Reason]], tuple[list[Reason]]]:
        return list, (list(self),)
