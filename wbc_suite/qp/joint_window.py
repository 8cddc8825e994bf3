"""The window of each joint's next step, out of its limits."""

import numpy as np

from wbc_suite.compiling import inner
from wbc_suite.qp.limit import LimitKind
from wbc_suite.typing import CompiledRecords, Indices, Vector


@inner
def merge_bounds(
    bounds: CompiledRecords,
    q: Vector,
    v_previous: Vector,
    dt: float,
    lower: Vector,
    upper: Vector,
    kinds: Indices,
) -> None:
    """Write bounds of the step dq that are never empty.

    The acceleration window `v_previous dt -+ a dt^2` is clipped into the position
    interval, which `step_max` narrows, the result into the velocity interval
    `-+ v dt`. Clipping an interval into another keeps it non-empty, and is the
    intersection where there is one: velocity wins over position, position over
    acceleration. A joint outside a limit therefore returns at its greatest speed.

    `kinds`, shape (2 nv,), gets the `LimitKind` that set each lower, then each upper
    bound.
    """
    nv = lower.shape[0]
    for i in range(nv):
        own, k = bounds[i], bounds[i].q_index
        window, v_max = own.a_max * dt * dt, own.v_max * dt
        lo, hi = v_previous[i] * dt - window, v_previous[i] * dt + window
        lo_kind = hi_kind = LimitKind.ACCELERATION.value
        if k >= 0:
            bottom = -braking_step(q[k] - own.q_lower, own.position_gain, own.a_max, dt)
            top = braking_step(own.q_upper - q[k], own.position_gain, own.a_max, dt)
            bottom_kind = top_kind = LimitKind.POSITION.value
            down, up = own.step_max[0], own.step_max[1]
            if -down > bottom:
                bottom_kind, bottom = LimitKind.TRACKING.value, min(-down, top)
            if up < top:
                top_kind, top = LimitKind.TRACKING.value, max(up, bottom)
            lo, lo_kind = _clip(lo, lo_kind, bottom, bottom_kind, top, top_kind)
            hi, hi_kind = _clip(hi, hi_kind, bottom, bottom_kind, top, top_kind)
        kind = LimitKind.VELOCITY.value
        lower[i], kinds[i] = _clip(lo, lo_kind, -v_max, kind, v_max, kind)
        upper[i], kinds[nv + i] = _clip(hi, hi_kind, -v_max, kind, v_max, kind)


@inner
def _clip(
    x: float, kind: int, low: float, low_kind: int, high: float, high_kind: int
) -> tuple[float, int]:
    """Return x within an interval, and the kind of what bounds it."""
    if x < low:
        return low, low_kind
    if x > high:
        return high, high_kind
    return x, kind


@inner
def braking_step(distance: float, gain: float, a: float, dt: float) -> float:
    """Return the greatest step towards a limit that is a distance away.

    It is a fraction of the distance, and no more than what can still be braked in the
    distance d: `v dt + v^2 / (2 a) = d`, the discrete form of `v = sqrt(2 a d)`.
    A negative distance is outside the limit: the step leads back to it.
    """
    if distance < 0.0:
        return distance
    step = gain * distance
    if np.isfinite(a) and np.isfinite(distance):
        step = min(step, dt * a * (np.sqrt(dt * dt + 2.0 * distance / a) - dt))
    return step
