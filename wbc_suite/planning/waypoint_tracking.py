"""Tracking of a moving waypoint under acceleration limits, without overshoot."""

import numpy as np

from wbc_suite.compiling import compiled, inner
from wbc_suite.typing import Matrix, Vector

HORIZONS = (0.03, 0.06, 0.1, 0.15, 0.22, 0.32, 0.45, 0.6)  # s, to meet the motion at
HALVINGS = 60
SLACK = 1e-9  # rad or m; distances that count as none


@compiled
def track_waypoints(
    v: Vector,
    ahead: Matrix,
    motion: Matrix,
    times: Vector,
    acceleration: Vector,
    out: Vector,
) -> None:
    """Write velocities to change to at once, so that each joint meets a motion soon.

    Each joint takes the first of some times at which it can be where the motion is
    then, at the motion's velocity, by accelerating, cruising and braking. A law that
    brakes towards where the motion is now cannot brake any further while the motion
    itself brakes, and overshoots.

    A velocity may be farther off than one step of acceleration goes: the greater the
    tracking error, the more it must count against what else changes velocities.

    Args:
        v: Present velocities, shape (nv,).
        ahead: Difference to where the motion is at each time, shape (n, nv).
        motion: Velocities of the motion then, shape (n, nv).
        times: From now on, s, shape (n,); the first is the step.
        acceleration: Acceleration limits, shape (nv,).
        out: Output, shape (nv,).
    """
    step, last = times[0], times.shape[0] - 1
    for i in range(v.shape[0]):
        most = acceleration[i] * step
        wanted = ahead[0, i] / step
        if abs(wanted - v[i]) <= most and abs(wanted - motion[0, i]) <= most:
            out[i] = wanted
            continue
        v_last, time, a = motion[last, i], times[last], acceleration[i]
        direct = 0.5 * (v[i] + v_last) * abs(v_last - v[i]) / a
        side = 1.0 if ahead[last, i] > direct else -1.0
        out[i] = 0.5 * (v[i] + v_last + side * a * time)
        for k in range(1, last + 1):
            found = cruise_speed(ahead[k, i], v[i], motion[k, i], a, times[k])
            if np.isfinite(found):
                out[i] = found
                break


@inner
def cruise_speed(
    d: float, v0: float, v1: float, acceleration: float, time: float
) -> float:
    """Return the cruising speed that covers d just in time; nan where none does.

    The profile accelerates from v0, cruises, and accelerates to v1.
    """
    low = 0.5 * (v0 + v1 - acceleration * time)
    high = 0.5 * (v0 + v1 + acceleration * time)
    short = _covered(low, v0, v1, acceleration, time) - d
    long = _covered(high, v0, v1, acceleration, time) - d
    if short > SLACK or long < -SLACK - 1e-6 * abs(d):
        return np.nan
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if _covered(middle, v0, v1, acceleration, time) < d:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@inner
def _covered(
    cruise: float, v0: float, v1: float, acceleration: float, time: float
) -> float:
    """Return the distance of a profile; it grows with the cruising speed."""
    up, down = abs(cruise - v0) / acceleration, abs(v1 - cruise) / acceleration
    level = time - up - down
    return 0.5 * (v0 + cruise) * up + cruise * level + 0.5 * (cruise + v1) * down
