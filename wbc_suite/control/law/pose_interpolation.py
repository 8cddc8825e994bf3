"""Interpolate the goal of a hand: from its last pose to the next in a given time."""

import numpy as np
import pinocchio as pin

from wbc_suite.compiling import inner
from wbc_suite.control.loop.records import CompiledRecords
from wbc_suite.control.loop.rigid_body import matrix_product
from wbc_suite.qp.lie import exp3
from wbc_suite.typing import Matrix, Vector


@inner
def interpolate_pose(
    law: CompiledRecords,
    R_wb: Matrix,
    p_wb: Vector,
    R_goal: Matrix,
    p_goal: Vector,
    twist: Vector,
) -> None:
    """Write the goal of an `OscLaw` at this time, and its twist, in the world.

    In the axes of the reference body, whose pose is (R_wb, p_wb), the goal moves from
    `start` by `shift` and `turn` in `duration`, at constant velocities. The twist,
    linear then angular, is relative to that body.
    """
    phase, rate = 1.0, 0.0
    if law.duration > 0.0:
        phase = min(law.since / law.duration, 1.0)
        rate = 1.0 / law.duration if law.since <= law.duration else 0.0
    R_start, R_turned = np.empty((3, 3)), np.empty((3, 3))
    matrix_product(R_wb, law.start[:9].reshape((3, 3)), R_start)
    exp3(phase * law.turn[0], phase * law.turn[1], phase * law.turn[2], R_turned)
    matrix_product(R_start, R_turned, R_goal)
    for i in range(3):
        p_goal[i], twist[i], twist[3 + i] = p_wb[i], 0.0, 0.0
        for k in range(3):
            p_goal[i] += R_wb[i, k] * (law.start[9 + k] + phase * law.shift[k])
            twist[i] += rate * R_wb[i, k] * law.shift[k]
            twist[3 + i] += rate * R_start[i, k] * law.turn[k]


def pose_vector(pose: pin.SE3) -> Vector:
    """Return the rotation by rows, then the position, m; shape (12,)."""
    return np.concatenate([pose.rotation.ravel(), pose.translation])


def vector_pose(vector: Vector) -> pin.SE3:
    """Return the pose of a `pose_vector`."""
    return pin.SE3(vector[:9].reshape(3, 3), vector[9:])
