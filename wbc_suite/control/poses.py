"""Poses as arrays, for kernels: rows [R p] of 3 by 4 numbers, shape (12,).

The poses of actions' goals and of laws are vectors: R row by row, then p.
"""

import numpy as np
import pinocchio as pin

from wbc_suite.compiling import inner
from wbc_suite.typing import Matrix, Vector


def pose_vector(pose: pin.SE3) -> Vector:
    """Return the rotation by rows, then the position, m; shape (12,)."""
    return np.concatenate([pose.rotation.ravel(), pose.translation])


def vector_pose(vector: Vector) -> pin.SE3:
    """Return the pose of a `pose_vector`."""
    return pin.SE3(vector[:9].reshape(3, 3), vector[9:])


def row_of(T: pin.SE3) -> Vector:
    """Return a pose as [R p] row by row, shape (12,)."""
    return T.homogeneous.ravel()[:12]


def pose_of(row: Vector) -> pin.SE3:
    """Return the pose of a row [R p], shape (12,)."""
    T = row.reshape(3, 4)
    return pin.SE3(T[:, :3], T[:, 3])


@inner
def write_row(R: Vector, p: Vector, out: Vector) -> None:
    """Write the row of a rotation, row by row, shape (9,), and a position, (3,)."""
    for i in range(3):
        out[4 * i + 3] = p[i]
        for j in range(3):
            out[4 * i + j] = R[3 * i + j]


@inner
def multiply(A: Vector, B: Vector, out: Vector) -> None:
    """Write the pose `A B`."""
    for row in range(0, 12, 4):
        for j in range(4):
            out[row + j] = A[row + 3] if j == 3 else 0.0
            for k in range(3):
                out[row + j] += A[row + k] * B[4 * k + j]


@inner
def write_relative(A: Vector, B: Vector, out: Vector) -> None:
    """Write the pose `A^-1 B`."""
    for i in range(3):
        for j in range(4):
            out[4 * i + j] = 0.0
            for k in range(3):
                b = B[4 * k + j] - (A[4 * k + 3] if j == 3 else 0.0)
                out[4 * i + j] += A[4 * k + i] * b


@inner
def write_turn(start: Vector, end: Vector, turn: Matrix) -> None:
    """Write the rotation from a pose to another in the axes of the first, (3, 3)."""
    for i in range(3):
        for j in range(3):
            turn[i, j] = start[i] * end[j]
            turn[i, j] += start[4 + i] * end[4 + j] + start[8 + i] * end[8 + j]


@inner
def write_frame_pose(joint: Vector, offset: Vector, pose: Vector) -> None:
    """Write the pose of a frame from its joint's, which has R column by column."""
    for i in range(3):
        for j in range(4):
            pose[4 * i + j] = joint[9 + i] if j == 3 else 0.0
            for n in range(3):
                pose[4 * i + j] += joint[3 * n + i] * offset[4 * n + j]
