"""Motions of bounded speed and acceleration between two states: up, cruise, down."""

from dataclasses import dataclass

import numpy as np

from wbc_suite.compiling import compiled
from wbc_suite.typing import Vector

__all__ = [
    "Ramp",
    "braking_ramp",
    "cruise_speed",
    "fastest_ramp",
    "line_ramp",
    "reversed_ramp",
]

HALVINGS = 60
SLACK = 1e-9  # rad or m; distances that count as none


@dataclass(frozen=True, slots=True, kw_only=True)
class Ramp:
    """All joints change speed, cruise, and change speed again, each at its own rate.

    Attributes:
        start: Positions at the beginning, shape (nv,).
        first: Velocities at the beginning.
        cruise: Velocities in between.
        last: Velocities at the end.
        rate: Magnitude of the accelerations.
        duration: s, the same for all.
    """

    start: Vector
    first: Vector
    cruise: Vector
    last: Vector
    rate: Vector
    duration: float

    def state(self, time: float) -> tuple[Vector, Vector]:
        """Return positions and velocities `time` seconds after the beginning."""
        x, v = np.empty_like(self.start), np.empty_like(self.start)
        _state(
            self.start, self.first, self.cruise, self.last, self.rate,
            self.duration, time, x, v,
        )  # fmt: skip
        return x, v


def fastest_ramp(
    start: tuple[Vector, Vector],
    end: tuple[Vector, Vector],
    *,
    speed: Vector,
    rate: Vector,
    least: float = 0.0,
) -> Ramp | None:
    """Return the ramp between two states of motion that takes least time.

    The slowest joint sets the time; the others cruise as slowly as it allows. None
    where one of them would have to turn round to take so long.

    Args:
        start: Positions and velocities, shape (nv,) each.
        end: The same at the end.
        speed: Greatest speeds.
        rate: Accelerations.
        least: Time that it shall take at least, s.

    Source: Hauser and Ng-Thow-Hing (2010), "Fast Smoothing of Manipulator Trajectories
    using Optimal Bounded-Acceleration Shortcuts", ICRA.
    """
    (x, v), (x_end, v_end) = start, end
    cruise = np.empty_like(x)
    duration = _fit(x_end - x, v, v_end, speed, rate, least, cruise)
    if not np.isfinite(duration):
        return None
    return Ramp(
        start=x, first=v, cruise=cruise, last=v_end, rate=rate, duration=duration
    )


def line_ramp(start: Vector, end: Vector, *, speed: Vector, rate: Vector) -> Ramp:
    """Return the fastest ramp from rest to rest on a straight line."""
    step = end - start
    moved = np.maximum(np.abs(step), SLACK)
    top, able = float((speed / moved).min()), float((rate / moved).min())
    top = min(top, able**0.5)  # part of the way per second
    still = np.zeros_like(start)
    return Ramp(
        start=start,
        first=still,
        cruise=top * step,
        last=still,
        rate=able * np.abs(step),
        duration=1.0 / top + top / able,
    )


def braking_ramp(start: tuple[Vector, Vector], *, rate: Vector) -> Ramp:
    """Return the ramp that stops each joint as soon as it can."""
    x, v = start
    still = np.zeros_like(x)
    duration = float((np.abs(v) / rate).max())
    return Ramp(
        start=x, first=v, cruise=still, last=still, rate=rate, duration=duration
    )


def reversed_ramp(ramp: Ramp) -> Ramp:
    """Return the ramp that leads back the same way."""
    return Ramp(
        start=ramp.state(ramp.duration)[0],
        first=-ramp.last,
        cruise=-ramp.cruise,
        last=-ramp.first,
        rate=ramp.rate,
        duration=ramp.duration,
    )


@compiled
def _fit(
    distance: Vector, v0: Vector, v1: Vector, speed: Vector, rate: Vector,
    least_time: float, cruise: Vector,
) -> float:  # fmt: skip
    """Write the cruising speeds of the fastest ramp; return its duration or inf."""
    time = least_time
    for i in range(distance.shape[0]):
        time = max(time, _least_time(distance[i], v0[i], v1[i], speed[i], rate[i]))
    time *= 1.0 + 1e-9
    for i in range(distance.shape[0]):
        most = max(speed[i], abs(v0[i]), abs(v1[i]))
        cruise[i] = _cruise(distance[i], v0[i], v1[i], most, rate[i], time)
        if not np.isfinite(cruise[i]):
            return np.inf
    return time


@compiled
def cruise_speed(d: float, v0: float, v1: float, rate: float, time: float) -> float:
    """Return the cruising speed that covers d just in time; nan where none does.

    Args:
        d: Distance.
        v0: Velocity at the beginning.
        v1: Velocity at the end.
        rate: Acceleration.
        time: s.
    """
    return _cruise(d, v0, v1, np.inf, rate, time)


@compiled
def _cruise(
    d: float, v0: float, v1: float, speed: float, rate: float, time: float
) -> float:
    least = max(-speed, 0.5 * (v0 + v1 - rate * time))
    most = min(speed, 0.5 * (v0 + v1 + rate * time))
    if most < least - SLACK:
        return np.nan
    short = _covered(least, v0, v1, rate, time) - d
    long = _covered(most, v0, v1, rate, time) - d
    if short > SLACK or long < -SLACK - 1e-6 * abs(d):
        return np.nan
    for _ in range(HALVINGS):
        middle = 0.5 * (least + most)
        if _covered(middle, v0, v1, rate, time) < d:
            least = middle
        else:
            most = middle
    return 0.5 * (least + most)


@compiled
def _least_time(d: float, v0: float, v1: float, speed: float, rate: float) -> float:
    """Return how long one joint needs to cover d between two velocities."""
    straight = 0.5 * (v0 + v1) * abs(v1 - v0) / rate
    if d < straight:  # seen from the other side it is the same
        d, v0, v1 = -d, -v0, -v1
    top = np.sqrt(max(rate * d + 0.5 * (v0 * v0 + v1 * v1), 0.0))
    top = max(top, v0, v1)
    time = (2.0 * top - v0 - v1) / rate
    if top <= speed:
        return time
    top = max(speed, v0, v1)
    covered = (2.0 * top * top - v0 * v0 - v1 * v1) / (2.0 * rate)
    return (2.0 * top - v0 - v1) / rate + max(d - covered, 0.0) / top


@compiled
def _covered(cruise: float, v0: float, v1: float, rate: float, time: float) -> float:
    """Return the distance of a ramp of one joint; it grows with the cruising speed."""
    up, down = abs(cruise - v0) / rate, abs(v1 - cruise) / rate
    level = time - up - down
    return 0.5 * (v0 + cruise) * up + cruise * level + 0.5 * (cruise + v1) * down


@compiled
def _state(
    x0: Vector, v0: Vector, cruise: Vector, v1: Vector, rate: Vector,
    duration: float, time: float, x: Vector, v: Vector,
) -> None:  # fmt: skip
    time = min(max(time, 0.0), duration)
    for i in range(x0.shape[0]):
        up = abs(cruise[i] - v0[i]) / max(rate[i], 1e-12)
        down = duration - abs(v1[i] - cruise[i]) / max(rate[i], 1e-12)
        t = min(time, up)
        way = np.sign(cruise[i] - v0[i]) * rate[i]
        v[i] = v0[i] + way * t
        x[i] = x0[i] + 0.5 * (v0[i] + v[i]) * t
        if time > up:
            x[i] += cruise[i] * (min(time, down) - up)
            v[i] = cruise[i]
        if time > down and down >= up - 1e-9:
            t = time - down
            v[i] = cruise[i] + np.sign(v1[i] - cruise[i]) * rate[i] * t
            x[i] += 0.5 * (cruise[i] + v[i]) * t
