"""What a whole-body composite asks of an inverse-kinematics solver."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, Protocol, TypeAlias

from wbc_suite.typing import Matrix, Vector

__all__ = ["Explanation", "IkBackend", "IkStep", "Limits"]

Limits: TypeAlias = tuple[tuple[str | None, str], ...]
Explanation: TypeAlias = Callable[[], Mapping[str, Sequence[str]]]


class IkStep(NamedTuple):
    """The answer to one solve, made anew each time: see `qp.solution`.

    Attributes:
        v: Velocity, Pinocchio's conventions, shape (nv,).
        limits: Tells the limits that hold joints back: joint name or None, and words.
        ok: Whether the problem was solved as stated.
        record: Keeps what the solver knows, until the next solve; what it returns tells
            at any later time what holds each frame back, weightiest first. None where
            only `limits` are known.
    """

    v: Vector
    limits: Callable[[], Limits] = tuple
    ok: bool = True
    record: Callable[[], Explanation] | None = None


class IkBackend(Protocol):
    """Differential inverse kinematics of one robot at its commanded configuration.

    It is made with that configuration, which its owner moves. Configurations and
    velocities are Pinocchio's, of the reduced robot.
    """

    def reset(self) -> None:
        """Forget the past; held frames are held where they are."""
        ...

    def set_targets(self, targets: Matrix) -> None:
        """Set the targets of all controlled frames.

        Args:
            targets: Poses, [R p] row by row, shape (n, 12). Only the position counts
                for the centre of mass.
        """
        ...

    def set_posture(self, q: Vector) -> None:
        """Set the posture to prefer."""
        ...

    def solve(self, dt: float) -> IkStep:
        """Return the velocity towards the targets for dt seconds; never raises."""
        ...

    def solve_posture(self, posture: Vector, dt: float) -> IkStep:
        """Return the velocity that takes joints to a configuration within dt.

        Limits and held frames are kept, controlled frames are left out.
        """
        ...
