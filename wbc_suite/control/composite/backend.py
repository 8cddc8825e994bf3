"""The interface between a whole-body controller and an inverse-kinematics solver."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, Protocol, TypeAlias

from wbc_suite.control.memory import Parts
from wbc_suite.control.reasons import Reason
from wbc_suite.typing import Matrix, Vector

Explanation: TypeAlias = Callable[[], Mapping[str, Sequence[Reason]]]


class IkStep(NamedTuple):
    """The answer to one solve; a named tuple, since one is made in every tick.

    Attributes:
        v: Velocity, Pinocchio's conventions, shape (nv,).
        limits: Returns what holds joints back.
        ok: Whether the problem was solved as stated.
        record: Records the state of the solver. The record returns at any later time
            what holds each frame back, the most important first. None where only
            `limits` are known.
    """

    v: Vector
    limits: Callable[[], tuple[Reason, ...]] = tuple
    ok: bool = True
    record: Callable[[], Explanation] | None = None


class IkBackend(Protocol):
    """Differential inverse kinematics of one robot at its commanded configuration.

    Its owner moves that configuration. Configurations and velocities are Pinocchio's,
    of the reduced robot.
    """

    def reset(self) -> None:
        """Discard the state of earlier ticks; held frames stay where they are."""

    @property
    def memory(self) -> Parts:
        """What outlives a tick; views."""
        ...

    def resume(self) -> None:
        """Go on from values that were written into `memory`, after a reset."""

    def set_targets(self, targets: Matrix) -> None:
        """Set the targets of all controlled frames: poses, [R p] rows, shape (n, 12).

        Only the position counts for the centre of mass.
        """

    def set_posture(self, q: Vector) -> None:
        """Set the posture to prefer."""

    def solve(self, dt: float) -> IkStep:
        """Return the velocity towards the targets for dt seconds; never raises."""
        ...

    def solve_posture(self, posture: Vector, dt: float) -> IkStep:
        """Return the velocity that takes joints to a configuration within dt.

        Limits and held frames are kept, controlled frames are left out.
        """
        ...
