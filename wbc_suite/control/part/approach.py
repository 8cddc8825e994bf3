"""Approach of a goal no faster than the robot can brake.

A step that removes a fixed share of the error asks, far away, for a velocity that the
deceleration cannot remove in time: joints overshoot, return, and overshoot again. So
each goal is replaced by one nearby, on the way to it.
"""

import numpy as np
import pinocchio as pin

from wbc_suite.compiling import compiled
from wbc_suite.typing import Vector


@compiled
def approach_speed(distance: float, settling: float, braking: float) -> float:
    """Return the speed from which a deceleration stops in time.

        v = sqrt(2 a d + (a T)^2) - a T

    Far away it is the parabola of constant deceleration a, close by the exponential
    decay d / T. The deceleration v dv/dd is below a everywhere.

    Args:
        distance: d >= 0.
        settling: T, s.
        braking: a > 0.
    """
    corner = braking * settling
    return np.sqrt(2.0 * braking * distance + corner * corner) - corner


@compiled
def step_share(
    error: Vector, dt: float, gain: float, max_speed: float, braking: float
) -> float:
    """Return the share of an error, shape (3,), that a target may ask for.

    The gain is the share of the target that one step of dt seconds covers.
    """
    distance = np.sqrt(error[0] ** 2 + error[1] ** 2 + error[2] ** 2)
    if not distance > 0.0:
        return 1.0
    speed = min(approach_speed(distance, dt / gain, braking), max_speed)
    return min(1.0, speed * dt / (gain * distance))


def approach_pose(
    now: pin.SE3,
    goal: pin.SE3,
    *,
    dt: float,
    gain: float,
    speed: tuple[float, float],
    acceleration: tuple[float, float],
) -> pin.SE3:
    """Return a nearer goal, such that a step of `gain` times its error brakes in time.

    Position moves along a straight line, orientation about one axis. Greatest speeds
    and decelerations are those of linear, then of angular motion, m and rad.
    """
    offset = goal.translation - now.translation
    turn = pin.log3(now.rotation.T @ goal.rotation)
    offset *= step_share(offset, dt, gain, speed[0], acceleration[0])
    turn *= step_share(turn, dt, gain, speed[1], acceleration[1])
    return pin.SE3(now.rotation @ pin.exp3(turn), now.translation + offset)
