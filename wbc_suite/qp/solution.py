"""What one tick of a stack answers.

`Solution` and `Pressure` are named tuples: made anew at each tick, which as frozen
dataclasses costs 3 us, more than the QP of an arm.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Literal, NamedTuple

import numpy as np

from wbc_suite.qp.bounds import LimitKind
from wbc_suite.typing import Indices, Vector

__all__ = ["ActiveLimit", "Fallback", "Pressure", "Solution"]


class Fallback(IntEnum):
    """How far a tick had to retreat from the problem as stated, mildest first."""

    NONE = 0
    """Solved as stated."""
    LEVEL = 1
    """A lower level could not be solved and was left out."""
    LIMITS = 2
    """Inequality rows were relaxed, by the least that accelerations allow."""
    ACCELERATION = 3
    """Acceleration limits were dropped for this tick."""
    SLACK = 4
    """Equality and inequality rows were relaxed; bounds of joints are kept."""
    BOX = 5
    """Damped least squares within the bounds of joints, rows left out."""
    HOLD = 6
    """Nothing usable came in or out: the robot stands still."""


@dataclass(frozen=True, slots=True)
class ActiveLimit:
    """A limit that holds a joint back.

    Attributes:
        name: The joint's name, or a row limit's own words ("forearm - torso").
        side: Which bound is met.
        kind: What set it.
        multiplier: How hard the tasks push against it, [cost]^2 rad or m.
    """

    name: str
    side: Literal["lower", "upper"]
    kind: LimitKind
    multiplier: float

    def __str__(self) -> str:
        words = self.kind.name.lower().replace("_", "-")
        if self.kind in (
            LimitKind.SELF_COLLISION,
            LimitKind.BALANCE,
            LimitKind.EFFORT,
            LimitKind.FLOOR,
        ):
            return f"{words}: {self.name}"
        words = "joint" if self.kind is LimitKind.POSITION else words
        return f"{words} limit: {self.name} ({self.side})"


class Pressure(NamedTuple):
    """How hard the tasks press against bounds and inequality rows.

    Attributes:
        multipliers: One per velocity, then one per row; positive at an upper bound.
        kinds: The `LimitKind` of each lower and each upper bound, shape (2, nv).
        names: Names of the velocities.
        rows: Kind and words of the rows that are pressed, by row.
    """

    multipliers: Vector
    kinds: Indices
    names: tuple[str, ...]
    rows: Mapping[int, tuple[LimitKind, str]]

    def limits(self) -> tuple[ActiveLimit, ...]:
        """List the limits that are pressed, hardest first."""
        pressed = self.multipliers.nonzero()[0]
        order = np.argsort(-np.abs(self.multipliers[pressed]), kind="stable")
        return tuple(self.limit(int(i)) for i in pressed[order])

    def limit(self, i: int) -> ActiveLimit:
        """Describe one limit by its place among the multipliers."""
        value, nv = float(self.multipliers[i]), len(self.names)
        if i < nv:
            kind, name = LimitKind(int(self.kinds[int(value > 0.0), i])), self.names[i]
        else:
            kind, name = self.rows[i - nv]
        return ActiveLimit(
            name=name,
            side="upper" if value > 0.0 else "lower",
            kind=kind,
            multiplier=abs(value),
        )


class Solution(NamedTuple):
    """The step of one tick.

    Attributes:
        dq: Step in the tangent space, shape (nv,); integrate it, never add it to q.
        v: Velocity `dq / dt`, shape (nv,).
        fallback: How far the tick had to retreat.
        residual: By how much the worst kept constraint is broken, in its own unit.
        held: Tasks whose target was not finite; what they watch stands still.
        conflicts: Names of the equality rows that could not be kept.
        press: Tells what `active` is read off.
    """

    dq: Vector
    v: Vector
    fallback: Fallback
    residual: float
    held: tuple[str, ...]
    conflicts: tuple[str, ...]
    press: Callable[[], Pressure]

    @property
    def pressure(self) -> Pressure:
        """How hard the tasks press against bounds and inequality rows."""
        return self.press()

    @property
    def active(self) -> tuple[ActiveLimit, ...]:
        """Limits that hold joints back, hardest pressed first."""
        return self.pressure.limits()

    @property
    def ok(self) -> bool:
        """Whether the problem was solved as stated."""
        return self.fallback is Fallback.NONE and not self.held
