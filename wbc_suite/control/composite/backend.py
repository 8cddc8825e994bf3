"""What a whole-body composite asks of an inverse-kinematics solver."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import pinocchio as pin

from wbc_suite.typing import Vector

__all__ = ["IkBackend", "IkStep"]


@dataclass(frozen=True, kw_only=True, slots=True)
class IkStep:
    """The answer to one solve.

    Attributes:
        v: Velocity, Pinocchio's conventions, shape (nv,).
        limits: Limits that hold joints back: joint name or None, and words.
        ok: Whether the problem was solved as stated.
        explain: Tells what holds each frame back, weightiest first, until the next
            solve; None where only `limits` are known.
    """

    v: Vector
    limits: tuple[tuple[str | None, str], ...] = ()
    ok: bool = True
    explain: Callable[[], Mapping[str, Sequence[str]]] | None = None


class IkBackend(Protocol):
    """Differential inverse kinematics of one robot.

    Configurations and velocities are Pinocchio's, of the reduced robot.
    """

    def reset(self, q: Vector) -> None:
        """Forget the past; held frames are held where q puts them."""
        ...

    def set_target(self, index: int, target: pin.SE3) -> None:
        """Set the target of the index-th controlled frame.

        Only the translation counts for the centre of mass.
        """
        ...

    def set_posture(self, q: Vector) -> None:
        """Set the posture to prefer."""
        ...

    def solve(self, q: Vector, dt: float) -> IkStep:
        """Return the velocity towards the targets for dt seconds; never raises."""
        ...

    def solve_posture(self, q: Vector, posture: Vector, dt: float) -> IkStep:
        """Return the velocity that takes joints to a configuration within dt.

        Limits and held frames are kept, controlled frames are left out.
        """
        ...
