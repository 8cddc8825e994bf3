"""Compiled kernels that build the rows and the normal equations of a stack.

Each kernel is a pure function over arrays. The readable form of `frame_rows` is
`FrameTask.rows`, that of `normal_equations` is the formula `H = W^T W`, `c = -W^T e`;
tests hold each pair together to 1e-10.
"""

import numba
import numpy as np

from wbc_suite.typing import Indices, Matrix, Vector

__all__ = [
    "PACKED",
    "frame_rows",
    "log3",
    "normal_equations",
    "row_space",
    "saturate",
]

PACKED = 21
"""Length of a packed frame task: target rotation by columns (9), target position (3),
costs (6), gain, maximal speeds in m/s and rad/s."""

_SMALL_ANGLE = 1e-4  # below it series are exact to 1e-16


@numba.njit(cache=True, nogil=True)
def log3(R: Matrix, out: Vector) -> float:
    """Write the rotation vector of R, shape (3,), and return its angle in [0, pi].

    Goes through the quaternion (largest component first), which stays accurate near
    pi. Source: Shepperd (1978), "Quaternion from Rotation Matrix", JGC 1(3).
    """
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    if trace > R[0, 0] and trace > R[1, 1] and trace > R[2, 2]:
        w = 0.5 * np.sqrt(max(1.0 + trace, 0.0))
        scale = 0.25 / w
        x = (R[2, 1] - R[1, 2]) * scale
        y = (R[0, 2] - R[2, 0]) * scale
        z = (R[1, 0] - R[0, 1]) * scale
    else:
        i = 0
        if R[1, 1] > R[0, 0]:
            i = 1
        if R[2, 2] > R[i, i]:
            i = 2
        j, k = (i + 1) % 3, (i + 2) % 3
        largest = 0.5 * np.sqrt(max(1.0 + R[i, i] - R[j, j] - R[k, k], 0.0))
        scale = 0.25 / largest
        out[i] = largest
        out[j] = (R[j, i] + R[i, j]) * scale
        out[k] = (R[k, i] + R[i, k]) * scale
        w = (R[k, j] - R[j, k]) * scale
        x, y, z = out[0], out[1], out[2]
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    sine = np.sqrt(x * x + y * y + z * z)
    angle = 2.0 * np.arctan2(sine, w)
    factor = angle / sine if sine > 1e-9 else 2.0
    out[0], out[1], out[2] = factor * x, factor * y, factor * z
    return angle


@numba.njit(cache=True, nogil=True)
def saturate(step: Vector, limit: float) -> None:
    """Shorten a step in place to the given length, keeping its direction."""
    norm = 0.0
    for i in range(step.shape[0]):
        norm += step[i] * step[i]
    norm = np.sqrt(norm)
    if norm > limit:
        for i in range(step.shape[0]):
            step[i] *= limit / norm


@numba.njit(cache=True, nogil=True)
def _inverse_left_jacobian(r: Vector, angle: float, out: Matrix) -> None:
    """Write `Jl^-1(r)`, the inverse left Jacobian of SO(3) at rotation vector r."""
    if angle < _SMALL_ANGLE:
        b = 1.0 / 12.0
    else:
        b = 1.0 / angle**2 - 0.5 / (angle * np.tan(0.5 * angle))
    x, y, z = r[0], r[1], r[2]
    out[0, 0] = 1.0 - b * (y * y + z * z)
    out[1, 1] = 1.0 - b * (x * x + z * z)
    out[2, 2] = 1.0 - b * (x * x + y * y)
    out[0, 1], out[1, 0] = 0.5 * z + b * x * y, -0.5 * z + b * x * y
    out[0, 2], out[2, 0] = -0.5 * y + b * x * z, 0.5 * y + b * x * z
    out[1, 2], out[2, 1] = 0.5 * x + b * y * z, -0.5 * x + b * y * z


@numba.njit(cache=True, nogil=True)
def frame_rows(  # noqa: C901, one flat loop is what compiles well
    placements: Matrix,
    joint_jacobians: Matrix,
    joints: Indices,
    offsets: Matrix,
    packed: Matrix,
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
        packed: Targets, costs, gain and speeds, shape (n, PACKED).
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
        T, F, X = placements[joints[t]], offsets[t], packed[t]
        for i in range(3):
            p[i] = T[9 + i]
            for j in range(3):
                p[i] += T[3 * j + i] * F[9 + j]
                R[i, j] = T[i] * F[j] + T[3 + i] * F[3 + j] + T[6 + i] * F[6 + j]
        finite = True
        for i in range(12):
            finite &= np.isfinite(X[i])
        angle, distance = 0.0, 0.0
        if finite:
            for i in range(3):
                s[i] = X[9 + i] - p[i]
                distance += s[i] * s[i]
                for j in range(3):
                    E[i, j] = (
                        R[0, i] * X[3 * j]
                        + R[1, i] * X[3 * j + 1]
                        + R[2, i] * X[3 * j + 2]
                    )
            angle = log3(E, r)
            errors[t, 0], errors[t, 1] = np.sqrt(distance), angle
        else:
            s[:] = 0.0
            r[:] = 0.0
            errors[t, 0], errors[t, 1] = np.nan, np.nan
            all_finite = False
        _inverse_left_jacobian(r, angle, L)
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


@numba.njit(cache=True, nogil=True)
def normal_equations(
    W: Matrix,
    e: Vector,
    row_start: Indices,
    support_start: Indices,
    support: Indices,
    diagonal: Matrix,
    damping: float,
    curvature: float,
    H: Matrix,
    c: Vector,
) -> float:
    """Write `H = W^T W + D + mu I` and `c = -W^T e - d`.

    `mu = damping + curvature sum_rows |e| max|W|`. Its second part bounds what the
    rows' linearisation leaves out, `sum_rows W-weighted e * d2f/dq2`: a second
    derivative is no larger than the longest lever arm, which is the row's largest
    entry. It vanishes with the error, and makes the step a descent where a target
    cannot be reached (Levenberg-Marquardt with a bound in place of a guess).

    Args:
        W: Weighted rows, shape (m, nv).
        e: Weighted steps, shape (m,).
        row_start: First row of each block and the end, shape (blocks + 1,).
        support_start: Where each block's entries of `support` begin, (blocks + 1,).
        support: Columns of each block that are not zero, ascending within a block.
        diagonal: Squared weights and weighted steps of diagonal tasks, shape (2, nv):
            they add `diagonal[0]` to H's diagonal and `-diagonal[1]` to c.
        damping: Constant part of mu, [cost]^2/rad^2.
        curvature: Factor of the part that follows the error; 1 bounds, 0 is without.
        H: Output, shape (nv, nv), both triangles.
        c: Output, shape (nv,).

    Returns:
        mu; not finite if an entry of H or c is not.
    """
    n = c.shape[0]
    H[:, :] = 0.0
    c[:] = -diagonal[1]
    mu = damping
    for block in range(row_start.shape[0] - 1):
        first, last = support_start[block], support_start[block + 1]
        for row in range(row_start[block], row_start[block + 1]):
            weights, step, longest = W[row], e[row], 0.0
            for i in range(first, last):
                a = support[i]
                w = weights[a]
                if w != 0.0:
                    longest = max(longest, abs(w))
                    c[a] -= w * step
                    target = H[a]
                    for j in range(first, i + 1):
                        target[support[j]] += w * weights[support[j]]
            mu += curvature * abs(step) * longest
    total = 0.0
    for i in range(n):
        H[i, i] += diagonal[0, i] + mu
        total += c[i]
        for j in range(i + 1):
            total += H[i, j]
            H[j, i] = H[i, j]
    return mu if np.isfinite(total) else np.nan


@numba.njit(cache=True, nogil=True)
def row_space(  # noqa: C901, one flat loop is what compiles well
    W: Matrix, tolerance: float, V: Matrix, lengths: Vector
) -> int:
    """Write an orthonormal basis of the rows of W, largest first; return its size.

    Gram-Schmidt with pivoting, each vector orthogonalised twice ("twice is enough",
    Giraud et al. 2005). Rows that are left shorter than the tolerance are dropped.

    Args:
        W: Rows, shape (m, n); destroyed.
        tolerance: Absolute length under which a row counts as dependent.
        V: Output, shape (at least min(m, n), n).
        lengths: Output, what was left of each chosen row, descending.

    Returns:
        The rank r; V[:r] holds the basis.
    """
    m, n = W.shape
    rank = 0
    for _ in range(min(m, V.shape[0])):
        best, pivot = 0.0, -1
        for i in range(m):
            length = 0.0
            for j in range(n):
                length += W[i, j] * W[i, j]
            if length > best:
                best, pivot = length, i
        if best <= tolerance * tolerance:
            break
        row, v = W[pivot], V[rank]
        lengths[rank] = np.sqrt(best)
        scale = 1.0 / np.sqrt(best)
        for j in range(n):
            v[j] = row[j] * scale
        _remove(V, rank, v)
        norm = 0.0
        for j in range(n):
            norm += v[j] * v[j]
        scale = 1.0 / np.sqrt(norm)
        for j in range(n):
            v[j] *= scale
            row[j] = 0.0
        rank += 1
        for i in range(m):
            dot = 0.0
            for j in range(n):
                dot += W[i, j] * v[j]
            if dot != 0.0:
                for j in range(n):
                    W[i, j] -= dot * v[j]
    return rank


@numba.njit(cache=True, nogil=True)
def _remove(V: Matrix, count: int, v: Vector) -> None:
    """Take from v, in place, its components along the first rows of V."""
    for i in range(count):
        dot = 0.0
        for j in range(v.shape[0]):
            dot += V[i, j] * v[j]
        for j in range(v.shape[0]):
            v[j] -= dot * V[i, j]
