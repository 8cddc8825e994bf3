"""Compiled kernels that build the rows and the normal equations of a level.

Each kernel is a pure function over arrays, and has a readable form that a test holds it
to at 1e-10: `FrameTask.rows`, `ComTask.rows`, `PostureTask.diagonal`, and for
`normal_equations` the formula `H = W^T W`, `c = -W^T e`.
"""

import numpy as np

from wbc_suite.compiling import compiled
from wbc_suite.kinematics.array_table import vector_at
from wbc_suite.qp.lie import FAR, inverse_left_jacobian, log3, saturate
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = [
    "PACKED_COM",
    "PACKED_FRAME",
    "com_rows",
    "damping_of_rows",
    "frame_rows",
    "normal_equations",
    "posture_terms",
]

PACKED_FRAME = 21
"""Length of a packed frame task: the target's rotation and position, row by row (12),
costs (6), gain, greatest speeds in m/s and rad/s."""

PACKED_COM = 8
"""Length of a packed centre-of-mass task: target (3), costs (3), gain, speed in m/s."""


@compiled
def frame_rows(  # noqa: C901, one flat loop is what compiles well
    placements: Matrix,
    joint_jacobians: Matrix,
    joints: Indices,
    offsets: Matrix,
    tasks: Indices,
    first_row: Indices,
    support_start: Indices,
    support: Indices,
    dt: float,
    W: Matrix,
    e: Vector,
    errors: Matrix,
) -> bool:
    """Write the weighted rows of all frame tasks; see `FrameTask` for the equations.

    Args:
        placements: Joint poses, shape (njoints, 12).
        joint_jacobians: Joint Jacobians, transposed, shape (nv, 6).
        joints: Parent joint of each frame, shape (n,).
        offsets: Rotation (row by row) and position of each frame in its joint, (n, 12).
        tasks: Addresses of targets, costs, gain and speeds, PACKED_FRAME values each.
        first_row: First of each task's six rows in W and e, shape (n,).
        support_start: Where each task's entries of `support` begin, shape (n + 1,).
        support: Velocity indices that move each frame.
        dt: Step, s.
        W: Weighted Jacobian rows, only supporting columns are written.
        e: Weighted steps.
        errors: Position error (m) and angle (rad) of each task before saturation,
            shape (n, 2); NaN for a target that is not finite, which holds the frame.

    Returns:
        Whether all targets were finite.
    """
    all_finite = True
    R, E, L = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    p, r, s = np.empty(3), np.empty(3), np.empty(3)
    a = np.empty(3)
    for t in range(joints.shape[0]):
        T, F, X = placements[joints[t]], offsets[t], vector_at(tasks[t], PACKED_FRAME)
        for i in range(3):
            p[i] = T[9 + i]
            for j in range(3):
                p[i] += T[3 * j + i] * F[9 + j]
                R[i, j] = T[i] * F[j] + T[3 + i] * F[3 + j] + T[6 + i] * F[6 + j]
        finite = True
        for i in range(12):
            finite &= abs(X[i]) < FAR
        angle, distance = 0.0, 0.0
        if finite:
            for i in range(3):
                s[i] = X[4 * i + 3] - p[i]
                distance += s[i] * s[i]
                for j in range(3):
                    E[i, j] = R[0, i] * X[j] + R[1, i] * X[4 + j] + R[2, i] * X[8 + j]
            angle = log3(E, r)
            errors[t, 0], errors[t, 1] = np.sqrt(distance), angle
        else:
            for i in range(3):
                s[i], r[i] = 0.0, 0.0
            errors[t, 0], errors[t, 1] = np.nan, np.nan
            all_finite = False
        inverse_left_jacobian(r, angle, L)
        for i in range(3):
            for j in range(3):  # E becomes L R^T, the map from world rates
                E[i, j] = L[i, 0] * R[j, 0] + L[i, 1] * R[j, 1] + L[i, 2] * R[j, 2]
            s[i] *= X[18]
            r[i] *= X[18]
        saturate(s, X[19] * dt)
        saturate(r, X[20] * dt)
        row = first_row[t]
        for i in range(3):
            e[row + i] = X[12 + i] * s[i]
            e[row + 3 + i] = X[15 + i] * r[i]
        for k in range(support_start[t], support_start[t + 1]):
            col = support[k]
            v = joint_jacobians[col]
            a[0], a[1], a[2] = v[3], v[4], v[5]
            W[row, col] = X[12] * (v[0] + a[1] * p[2] - a[2] * p[1])
            W[row + 1, col] = X[13] * (v[1] + a[2] * p[0] - a[0] * p[2])
            W[row + 2, col] = X[14] * (v[2] + a[0] * p[1] - a[1] * p[0])
            for i in range(3):
                W[row + 3 + i, col] = X[15 + i] * (
                    E[i, 0] * a[0] + E[i, 1] * a[1] + E[i, 2] * a[2]
                )
    return all_finite


@compiled
def com_rows(
    com: Vector,
    com_jacobian: Matrix,
    tasks: Indices,
    first_row: Indices,
    dt: float,
    W: Matrix,
    e: Vector,
    errors: Vector,
) -> bool:
    """Write the weighted rows of all centre-of-mass tasks; see `ComTask`.

    Args:
        com: Centre of mass, shape (3,).
        com_jacobian: Its Jacobian, transposed, shape (nv, 3).
        tasks: Addresses of targets, costs, gain and speed, PACKED_COM values each.
        first_row: First of each task's three rows, shape (n,).
        dt: Step, s.
        W: Output, weighted Jacobian rows.
        e: Output, weighted steps.
        errors: Output, distance of each task before saturation, m, shape (n,); NaN
            for a target that is not finite.

    Returns:
        Whether all targets were finite.
    """
    all_finite = True
    step = np.empty(3)
    for t in range(tasks.shape[0]):
        X, row, square = vector_at(tasks[t], PACKED_COM), first_row[t], 0.0
        for i in range(3):
            step[i] = X[i] - com[i]
            square += step[i] * step[i]
        errors[t] = np.sqrt(square)
        if not square < FAR * FAR:
            all_finite, errors[t] = False, np.nan
            for i in range(3):
                step[i] = 0.0
        for i in range(3):
            step[i] *= X[6]
        saturate(step, X[7] * dt)
        for i in range(3):
            e[row + i] = X[3 + i] * step[i]
            for col in range(W.shape[1]):
                W[row + i, col] = X[3 + i] * com_jacobian[col, i]
    return all_finite


@compiled
def posture_terms(
    q: Vector,
    q_index: Indices,
    squared_costs: Matrix,
    targets: Indices,
    gains: Matrix,
    dt: float,
    diagonal: Matrix,
) -> bool:
    """Add the terms of posture tasks on one-parameter joints; see `PostureTask`.

    Args:
        q: Joint positions, shape (nq,).
        q_index: Position index of each velocity, shape (nv,).
        squared_costs: Squared cost of each velocity, shape (n, nv).
        targets: Addresses of the postures, nq values each.
        gains: Gain and greatest speed of each task, shape (n, 2).
        dt: Step, s.
        diagonal: In and out, squared weights and weighted steps, shape (2, nv).

    Returns:
        Whether all targets were finite; the joints of one that is not are held.
    """
    all_finite = True
    for t in range(squared_costs.shape[0]):
        target, total = vector_at(targets[t], q.shape[0]), 0.0
        for i in range(q_index.shape[0]):
            if squared_costs[t, i] > 0.0:
                total += target[q_index[i]]
        finite = bool(np.isfinite(total))
        all_finite &= finite
        limit = gains[t, 1] * dt
        for i in range(q_index.shape[0]):
            weight = squared_costs[t, i]
            if weight > 0.0:
                diagonal[0, i] += weight
                if finite:
                    step = gains[t, 0] * (target[q_index[i]] - q[q_index[i]])
                    diagonal[1, i] += weight * min(max(step, -limit), limit)
    return all_finite


@compiled
def damping_of_rows(
    W: Matrix,
    e: Vector,
    row_start: Indices,
    support_start: Indices,
    support: Indices,
    damping: float,
    curvature: float,
) -> float:
    """Return `mu = damping + curvature sum_rows |e| max|W|`; NaN if not finite.

    The second part bounds what the rows' linearisation leaves out: a second derivative
    is no larger than the longest lever arm, which is the row's largest entry. It
    vanishes with the error, and makes the step a descent where a target cannot be
    reached (Levenberg-Marquardt with a bound in place of a guess).

    Args:
        W: Weighted rows, shape (m, nv).
        e: Weighted steps, shape (m,).
        row_start: First row of each block and the end, shape (blocks + 1,).
        support_start: Where each block's entries of `support` begin, (blocks + 1,).
        support: Columns of each block that are not zero.
        damping: Constant part, [cost]^2/rad^2.
        curvature: Factor of the part that follows the error; 1 bounds, 0 is without.
    """
    mu, total = damping, 0.0
    for block in range(row_start.shape[0] - 1):
        for row in range(row_start[block], row_start[block + 1]):
            longest = 0.0
            for k in range(support_start[block], support_start[block + 1]):
                size = abs(W[row, support[k]])
                total += size
                longest = max(longest, size)
            total += abs(e[row])
            mu += curvature * abs(e[row]) * longest
    return mu if np.isfinite(total) else np.nan


@compiled
def normal_equations(
    W: Matrix,
    e: Vector,
    row_start: Indices,
    support_start: Indices,
    support: Indices,
    diagonal: Matrix,
    mu: float,
    H: Matrix,
    c: Vector,
) -> None:
    """Write `H = W^T W + D + mu I` and `c = -W^T e - d`.

    Args:
        W: Weighted rows, shape (m, nv).
        e: Weighted steps, shape (m,).
        row_start: First row of each block and the end, shape (blocks + 1,).
        support_start: Where each block's entries of `support` begin, (blocks + 1,).
        support: Columns of each block that are not zero.
        diagonal: D, squared weights, and d, weighted steps of joints, shape (2, nv).
        mu: See `damping_of_rows`.
        H: Output, shape (nv, nv), both triangles.
        c: Output, shape (nv,).
    """
    n = c.shape[0]
    for i in range(n):
        for j in range(n):
            H[i, j] = 0.0
        H[i, i] = diagonal[0, i] + mu
        c[i] = -diagonal[1, i]
    for block in range(row_start.shape[0] - 1):
        first, last = support_start[block], support_start[block + 1]
        for row in range(row_start[block], row_start[block + 1]):
            weights = W[row]
            for i in range(first, last):
                a = support[i]
                weight, of_a = weights[a], H[a]
                c[a] -= weight * e[row]
                for j in range(a + 1):  # zeros too: whole vectors are faster
                    of_a[j] += weight * weights[j]
    for i in range(n):
        for j in range(i):
            H[j, i] = H[i, j]
