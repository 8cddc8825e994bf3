"""Approach of a goal no faster than the robot can brake.

A step that removes a fixed share of the error asks, far away, for a velocity that the
deceleration cannot remove in time: joints overshoot, return, and overshoot again. So
each goal is replaced by one nearby, on the way to it.
"""

import numpy as np

from wbc_suite.compiling import compiled, inner
from wbc_suite.qp.lie import exp3
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


@inner
def approach_pose(
    pose: Vector,
    error: Vector,
    dt: float,
    gain: float,
    share: float,
    speed: Vector,
    braking: Vector,
    target: Vector,
) -> None:
    """Write a nearer goal, such that a step of `gain` times its error brakes in time.

    Position moves along a straight line, orientation about one axis.

    Args:
        pose: Present pose, a row [R p], shape (12,).
        error: Position error, m, and rotation vector to the goal in the axes of the
            pose, shape (6,).
        dt: Time of a step, s.
        gain: Part of the error that a step removes.
        share: Of the greatest speeds that may be used.
        speed: Greatest speeds, m/s and rad/s, shape (2,).
        braking: Decelerations, m/s^2 and rad/s^2, shape (2,).
        target: Output, a row.
    """
    turn = np.empty((3, 3))
    step = step_share(error[:3], dt, gain, share * speed[0], braking[0])
    spin = step_share(error[3:], dt, gain, share * speed[1], braking[1])
    exp3(spin * error[3], spin * error[4], spin * error[5], turn)
    for i in range(3):
        row, out = pose[4 * i : 4 * i + 4], target[4 * i : 4 * i + 4]
        out[3] = row[3] + step * error[i]
        for j in range(3):
            out[j] = row[0] * turn[0, j] + row[1] * turn[1, j] + row[2] * turn[2, j]
