"""How fast to approach a target: as fast as one can still brake.

A differential step that removes a fixed part of the error asks, far away, for speeds
that acceleration limits cannot take back in time: the joint overshoots, turns round and
overshoots again. So each target is replaced by one nearby, on the way to it.
"""

import math

import numpy as np
import pinocchio as pin

from wbc_suite.typing import Vector

__all__ = ["approach_pose", "approach_posture", "approach_speed", "travel_time"]


def approach_speed(
    distance: float | Vector,
    *,
    rate: float,
    speed: float | Vector,
    acceleration: float | Vector,
) -> Vector:
    """Return the speed to approach with.

        v = sqrt(2 a d + (a / k)^2) - a / k,  at most `speed`

    Far away it is the braking parabola sqrt(2 a d); close by it is k d, an exponential
    decay. The deceleration along the way, v dv/dd, is below a everywhere.

    Args:
        distance: d >= 0.
        rate: k, 1/s.
        speed: Greatest speed.
        acceleration: a > 0.
    """
    corner = np.asarray(acceleration) / rate
    parabola = np.sqrt(2.0 * np.asarray(acceleration) * distance + corner**2)
    return np.minimum(parabola - corner, speed)


def approach_pose(
    now: pin.SE3,
    goal: pin.SE3,
    *,
    dt: float,
    gain: float,
    speed: tuple[float, float],
    acceleration: tuple[float, float],
) -> pin.SE3:
    """Return the pose to ask for now, so that a step of `gain` times its error brakes.

    Position goes straight, orientation about one axis.

    Args:
        now: Present pose.
        goal: Pose to arrive at.
        dt: Step, s.
        gain: Part of the error that the step removes.
        speed: Greatest speeds, m/s and rad/s.
        acceleration: Decelerations, m/s^2 and rad/s^2.
    """
    offset = goal.translation - now.translation
    turn = pin.log3(now.rotation.T @ goal.rotation)
    offset = offset * _part(offset, dt, gain, speed[0], acceleration[0])
    turn = turn * _part(turn, dt, gain, speed[1], acceleration[1])
    return pin.SE3(now.rotation @ pin.exp3(turn), now.translation + offset)


def approach_posture(
    difference: Vector, *, dt: float, speed: float | Vector, acceleration: Vector
) -> Vector:
    """Return joint velocities that take a joint difference away, joint by joint.

    Args:
        difference: From here to there, shape (nv,).
        dt: The time constant of the last, exponential part, s.
        speed: Greatest speeds.
        acceleration: Decelerations, shape (nv,).
    """
    wanted = approach_speed(
        np.abs(difference), rate=1.0 / dt, speed=speed, acceleration=acceleration
    )
    return np.sign(difference) * wanted


def travel_time(distance: Vector, *, speed: Vector, acceleration: Vector) -> Vector:
    """Return how long it takes from rest to rest, `d / v + v / a`, s.

    Below v^2 / a full speed is never reached, and it takes `2 sqrt(d / a)`.

    Args:
        distance: d >= 0.
        speed: v, greatest speeds.
        acceleration: a, of speeding up and of braking.
    """
    reached = np.minimum(np.sqrt(distance * acceleration), speed)
    return distance / np.maximum(reached, 1e-12) + reached / acceleration


def _part(
    error: Vector, dt: float, gain: float, speed: float, acceleration: float
) -> float:
    """Return what part of an error to ask for; see `approach_speed`."""
    distance = math.sqrt(error.dot(error))
    if not distance > 0.0:
        return 1.0
    corner = acceleration * dt / gain
    wanted = math.sqrt(2.0 * acceleration * distance + corner * corner) - corner
    return min(1.0, min(wanted, speed) * dt / (gain * distance))
