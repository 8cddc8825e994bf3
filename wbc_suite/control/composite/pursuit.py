"""How to catch up with a motion: no faster than one can brake into it."""

import numpy as np

from wbc_suite.compiling import compiled
from wbc_suite.control.composite.ramps import cruise_speed
from wbc_suite.typing import Matrix, Vector

__all__ = ["HORIZONS", "pursue"]

HORIZONS = (0.03, 0.06, 0.1, 0.15, 0.22, 0.32, 0.45, 0.6)  # s; when to have caught up


def pursue(
    v: Vector, ahead: Matrix, motion: Matrix, times: Vector, *, rate: Vector
) -> Vector:
    """Return velocities to change to at once, so that each joint joins a motion soon.

    Each joint takes the first of some times at which it can be where the motion is
    then, at the motion's velocity, by speeding up, cruising and braking. A law that
    brakes towards where the motion is now has nothing left to brake with while the
    motion itself brakes, and shoots past it.

    A velocity may be farther off than one step of acceleration goes: the more there is
    to make up, the more it must count against what else changes velocities.

    Args:
        v: Velocities now, shape (nv,).
        ahead: Way from here to where the motion is at each time, shape (n, nv).
        motion: Velocities of the motion then, shape (n, nv).
        times: From now on, s, shape (n,); the first is the step.
        rate: Accelerations, shape (nv,).
    """
    found: Vector = np.empty_like(v)
    _pursue(v, ahead, motion, times, rate, found)
    return found


@compiled
def _pursue(
    v: Vector, ahead: Matrix, motion: Matrix, times: Vector, rate: Vector, out: Vector
) -> None:
    step, last = times[0], times.shape[0] - 1
    for i in range(v.shape[0]):
        most = rate[i] * step
        wanted = ahead[0, i] / step
        if abs(wanted - v[i]) <= most and abs(wanted - motion[0, i]) <= most:
            out[i] = wanted
            continue
        v_last, time = motion[last, i], times[last]
        straight = 0.5 * (v[i] + v_last) * abs(v_last - v[i]) / rate[i]
        side = 1.0 if ahead[last, i] > straight else -1.0
        out[i] = 0.5 * (v[i] + v_last + side * rate[i] * time)
        for k in range(1, last + 1):
            found = cruise_speed(ahead[k, i], v[i], motion[k, i], rate[i], times[k])
            if np.isfinite(found):
                out[i] = found
                break
