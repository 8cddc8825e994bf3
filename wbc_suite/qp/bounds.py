"""One interval per joint out of position, velocity and acceleration limits."""

from enum import IntEnum

import numpy as np

from wbc_suite.compiling import compiled
from wbc_suite.typing import Indices, Vector

__all__ = ["LimitKind", "merge_bounds"]


class LimitKind(IntEnum):
    """What set a bound."""

    NONE = 0
    POSITION = 1
    VELOCITY = 2
    ACCELERATION = 3
    SELF_COLLISION = 4
    EQUALITY = 5
    BALANCE = 6
    EFFORT = 7
    FLOOR = 8


@compiled
def merge_bounds(  # noqa: C901, one flat loop is what compiles well
    q: Vector,
    q_index: Indices,
    q_lower: Vector,
    q_upper: Vector,
    position_gain: float,
    v_max: Vector,
    v_previous: Vector,
    a_max: Vector,
    dt: float,
    lower: Vector,
    upper: Vector,
    lower_kind: Indices,
    upper_kind: Indices,
) -> bool:
    """Write bounds of the step dq that are never empty.

    The acceleration window `v_previous dt -+ a dt^2` is clipped into the position
    interval, the result into the velocity interval `-+ v dt`. Clipping an interval into
    another keeps it non-empty, and is the intersection where there is one: velocity
    wins over position, position over acceleration. A joint outside a limit therefore
    returns at its greatest speed.

    The position interval is `gain (q_limit - q)`, cut by what can still be braked in
    the distance d that is left: `v dt + v^2 / (2 a) = d`, the discrete form of
    `v = sqrt(2 a d)`. Following it never conflicts with the window.

    Args:
        q: Joint positions, shape (nq,).
        q_index: Position index of each velocity, -1 where it has none, shape (nv,).
        q_lower: Lower position limits, -inf where there is none, shape (nv,).
        q_upper: Upper position limits.
        position_gain: Fraction of the distance that one step may cover, 0 to 1.
        v_max: Speed limits, inf where there is none, shape (nv,).
        v_previous: Velocity of the previous step, shape (nv,).
        a_max: Acceleration limits, inf where there is none, shape (nv,).
        dt: Step, s.
        lower: Output, least step, shape (nv,).
        upper: Output, greatest step, shape (nv,).
        lower_kind: Output, the `LimitKind` that set each lower bound.
        upper_kind: Output, the same for the upper bounds.

    Returns:
        Whether q is finite.
    """
    total = 0.0
    for i in range(q.shape[0]):
        total += q[i]
    if not np.isfinite(total):
        return False
    for i in range(lower.shape[0]):
        window = a_max[i] * dt * dt
        lo = v_previous[i] * dt - window
        hi = v_previous[i] * dt + window
        lo_kind, hi_kind = 3, 3
        k = q_index[i]
        if k >= 0:
            room = max(q_upper[i] - q[k], -np.inf)
            top = (
                room
                if room < 0.0
                else min(position_gain * room, _brake(room, a_max[i], dt))
            )
            room = q[k] - q_lower[i]
            bottom = (
                room
                if room < 0.0
                else min(position_gain * room, _brake(room, a_max[i], dt))
            )
            if lo < -bottom:
                lo, lo_kind = -bottom, 1
            if lo > top:
                lo, lo_kind = top, 1
            if hi > top:
                hi, hi_kind = top, 1
            if hi < -bottom:
                hi, hi_kind = -bottom, 1
        step = v_max[i] * dt
        if lo < -step:
            lo, lo_kind = -step, 2
        if lo > step:
            lo, lo_kind = step, 2
        if hi > step:
            hi, hi_kind = step, 2
        if hi < -step:
            hi, hi_kind = -step, 2
        lower[i], upper[i] = lo, hi
        lower_kind[i], upper_kind[i] = lo_kind, hi_kind
    return True


@compiled
def _brake(distance: float, a: float, dt: float) -> float:
    """Return the greatest step after which braking at a stops within the distance."""
    if not np.isfinite(a) or not np.isfinite(distance):
        return distance
    return dt * a * (np.sqrt(dt * dt + 2.0 * distance / a) - dt)
