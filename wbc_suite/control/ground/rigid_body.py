"""Jacobians, velocities and inertia of a simulation, out of MuJoCo's arrays."""

import numpy as np

from wbc_suite.compiling import inner
from wbc_suite.control.ground.physics import Physics
from wbc_suite.typing import Indices, Matrix, Vector


@inner
def rotation(rotations: Matrix, k: int) -> Matrix:
    """Return a view of one of MuJoCo's rotation matrices, (n, 9), as shape (3, 3)."""
    return rotations[k].reshape((3, 3))


@inner
def matrix_product(A: Matrix, B: Matrix, out: Matrix) -> None:
    """Write A B, shapes (3, 3)."""
    for i in range(3):
        for j in range(3):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]


@inner
def rotated(R: Matrix, x: Vector) -> Vector:
    """Return R x, shape (3,)."""
    y = np.empty(3)
    for i in range(3):
        y[i] = R[i, 0] * x[0] + R[i, 1] * x[1] + R[i, 2] * x[2]
    return y


@inner
def point_jacobian_column(
    physics: Physics, dof: int, body: int, p: Vector, column: Vector
) -> None:
    """Write the velocity of a point of a body per unit velocity of one dof.

    The column, shape (6,), is linear, then angular; it and p are in world axes.
    """
    root = physics.body_rootid[body]
    axis = physics.cdof[dof]  # angular, then linear at the centre of mass of the tree
    x = p[0] - physics.subtree_com[root, 0]
    y = p[1] - physics.subtree_com[root, 1]
    z = p[2] - physics.subtree_com[root, 2]
    column[0] = axis[3] + axis[1] * z - axis[2] * y
    column[1] = axis[4] + axis[2] * x - axis[0] * z
    column[2] = axis[5] + axis[0] * y - axis[1] * x
    column[3], column[4], column[5] = axis[0], axis[1], axis[2]


@inner
def point_velocity_and_drift(
    physics: Physics, body: int, p: Vector, velocity: Vector, drift: Vector
) -> None:
    """Write `J v` and `J' v` of a point of a body, linear then angular, world axes.

    The drift `J' v` is the point's acceleration without joint accelerations; see
    MuJoCo's `mj_jacDot`.
    """
    root = physics.body_rootid[body]
    x = p[0] - physics.subtree_com[root, 0]
    y = p[1] - physics.subtree_com[root, 1]
    z = p[2] - physics.subtree_com[root, 2]
    twist = physics.cvel[body]
    for i in range(6):
        drift[i] = 0.0
    velocity[0] = twist[3] + twist[1] * z - twist[2] * y
    velocity[1] = twist[4] + twist[2] * x - twist[0] * z
    velocity[2] = twist[5] + twist[0] * y - twist[1] * x
    velocity[3], velocity[4], velocity[5] = twist[0], twist[1], twist[2]
    dof = physics.body_last_dof[body]
    while dof >= 0:
        rate, axis, v = physics.cdof_dot[dof], physics.cdof[dof], physics.qvel[dof]
        spin_x = axis[1] * velocity[2] - axis[2] * velocity[1]
        spin_y = axis[2] * velocity[0] - axis[0] * velocity[2]
        spin_z = axis[0] * velocity[1] - axis[1] * velocity[0]
        drift[0] += v * (rate[3] + rate[1] * z - rate[2] * y + spin_x)
        drift[1] += v * (rate[4] + rate[2] * x - rate[0] * z + spin_y)
        drift[2] += v * (rate[5] + rate[0] * y - rate[1] * x + spin_z)
        drift[3] += v * rate[0]
        drift[4] += v * rate[1]
        drift[5] += v * rate[2]
        dof = physics.dof_parentid[dof]


@inner
def moves_body(physics: Physics, dof: int, body: int) -> bool:
    """Return whether a degree of freedom moves a body."""
    k = physics.body_last_dof[body]
    while k > dof:
        k = physics.dof_parentid[k]
    return k == dof


@inner
def write_inertia(physics: Physics, dofs: Indices, n: int, block: Matrix) -> None:
    """Write the inertia of the first n of some degrees of freedom, shape (n, n).

    Those below zero do not exist, and have none.
    MuJoCo keeps the lower triangle of M by rows; columns are ancestors of their row.
    """
    place = physics.place
    place[:] = -1
    for i in range(n):
        if dofs[i] >= 0:
            place[dofs[i]] = i
        for j in range(n):
            block[i, j] = 0.0
    for i in range(n):
        if dofs[i] < 0:
            continue
        first = physics.M_rowadr[dofs[i]]
        for k in range(first, first + physics.M_rownnz[dofs[i]]):
            j = place[physics.M_colind[k]]
            if j >= 0:
                block[i, j] = block[j, i] = physics.M[k]


@inner
def multiply_inertia(physics: Physics, a: Vector, force: Vector) -> None:
    """Write `M a` of the whole scene into force, shape (nv,)."""
    force[:] = 0.0
    for i in range(a.shape[0]):
        first = physics.M_rowadr[i]
        diagonal = first + physics.M_rownnz[i] - 1
        total = physics.M[diagonal] * a[i]
        for k in range(first, diagonal):
            column = physics.M_colind[k]
            total += physics.M[k] * a[column]
            force[column] += physics.M[k] * a[i]
        force[i] += total
