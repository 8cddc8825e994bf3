"""Why a controlled frame is not at its goal: typed values that print themselves.

The reasons of a solver are in `qp.report`: `ActiveLimit`, `Conflict`, `OutOfReach`.
Here are those of the robot that follows its commands.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias, overload

from wbc_suite.qp import ActiveLimit, LimitKind
from wbc_suite.qp.report import Reason as SolverReason


@dataclass(frozen=True, slots=True)
class Contact:
    """A link of the robot presses on an object.

    Attributes:
        link: The link.
        other: Name of the body, or of the world's geom, such as `floor`.
        force: Sum of the normal forces, N.
    """

    link: str
    other: str
    force: float

    def __str__(self) -> str:
        """Return "contact: hand - table"."""
        return f"contact: {self.link} - {self.other}"


@dataclass(frozen=True, slots=True)
class TrackingError:
    """A joint does not reach its target.

    Attributes:
        joint: The joint.
        error: Distance from the target, rad or m.
    """

    joint: str
    error: float

    def __str__(self) -> str:
        """Return "lag: joint"."""
        return f"lag: {self.joint}"


@dataclass(frozen=True, slots=True)
class TorqueLimit:
    """A joint does not reach its target, and its motor is at its limit.

    Attributes:
        joint: The joint.
        error: Distance from the target, rad or m.
    """

    joint: str
    error: float

    def __str__(self) -> str:
        """Return "motor limit: joint"."""
        return f"motor limit: {self.joint}"


@dataclass(frozen=True, slots=True)
class InMotion:
    """The frame is moving to its goal."""

    def __str__(self) -> str:
        """Return the reason as text."""
        return "moving"


@dataclass(frozen=True, slots=True)
class NoSolution:
    """The solver found no solution."""

    def __str__(self) -> str:
        """Return the reason as text."""
        return "no solution"


Reason: TypeAlias = (
    SolverReason | Contact | TrackingError | TorqueLimit | InMotion | NoSolution
)


def is_transient(reason: Reason) -> bool:
    """Return whether a reason holds only while the frame moves."""
    if isinstance(reason, ActiveLimit):
        return reason.kind is LimitKind.ACCELERATION
    return isinstance(reason, InMotion)


class LazyReasons(Sequence[Reason]):
    """Reasons that are computed when they are first read; copies are plain lists.

    Args:
        compute: Returns the reasons, the same at any time.
    """

    def __init__(self, compute: Callable[[], Sequence[Reason]]) -> None:
        self._compute = compute
        self._found: Sequence[Reason] | None = None

    def _reasons(self) -> Sequence[Reason]:
        if self._found is None:
            self._found = tuple(self._compute())
        return self._found

    @overload
    def __getitem__(self, index: int) -> Reason: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Reason]: ...
    def __getitem__(self, index: int | slice) -> Reason | Sequence[Reason]:
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
