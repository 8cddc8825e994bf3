"""The least change within bounds: a small quadratic program, solved exactly."""

import numpy as np

from wbc_suite.compiling import compiled, inlined
from wbc_suite.typing import Matrix, Vector

__all__ = ["least_change"]

ROUNDS = 100
TOLERANCE = 1e-12
"""How far a row of length 1 may be beyond its bounds, per length of 1 + || x ||."""


@compiled
def least_change(  # noqa: C901, one flat loop
    rows: Matrix, low: Vector, high: Vector, x: Vector, work: Matrix
) -> bool:
    """Write the x that minimises `|| x ||^2` subject to `low <= rows x <= high`.

    The dual active-set method: from x = 0, the row that is broken most is put on its
    bound, those whose multiplier would turn negative on the way leave theirs; every
    round ends at the optimum of the rows taken so far, and there are finitely many.

    Args:
        rows: Rows of length 1 or, where they are zero, without bounds; shape (m, n).
        low: Lower bounds, shape (m,).
        high: Upper bounds, shape (m,).
        x: Output, shape (n,).
        work: Scratch, shape (2 n + 3, n).

    Returns:
        Whether such an x was found; some bounds exclude each other.

    Source: Goldfarb, Idnani (1983), "A numerically stable dual method for solving
    strictly convex quadratic programs", Mathematical Programming 27.
    """
    n = x.shape[0]
    for i in range(n):
        x[i] = 0.0
    normals, multiplier, count = work[:n], work[2 * n], 0  # of rows at bounds
    G, r, z = work[n : 2 * n], work[2 * n + 1], work[2 * n + 2]
    for _ in range(ROUNDS):
        worst, row, sign = TOLERANCE * (1.0 + np.sqrt(_dot(n, x, x))), -1, 0.0
        for k in range(rows.shape[0]):
            value = _dot(n, rows[k], x)
            if low[k] - value > worst:
                worst, row, sign = low[k] - value, k, 1.0
            if value - high[k] > worst:
                worst, row, sign = value - high[k], k, -1.0
        if row < 0:
            return True
        end, own = sign * (low[row] if sign > 0.0 else high[row]), 0.0
        while True:
            _project(n, normals, count, sign, rows[row], G, r, z)
            length = _dot(n, z, z)
            step, leaving = np.inf, -1
            for k in range(count):
                if r[k] > 0.0 and multiplier[k] < step * r[k]:
                    step, leaving = multiplier[k] / r[k], k
            full = np.inf
            if count < n and length > 1e-12:
                full = (end - sign * _dot(n, rows[row], x)) / length
            step = min(step, full)
            if step == np.inf:
                return False
            own += step
            for k in range(count):
                multiplier[k] -= step * r[k]
            if full < np.inf:
                for i in range(n):
                    x[i] += step * z[i]
            if step == full:
                for i in range(n):
                    normals[count, i] = sign * rows[row, i]
                multiplier[count] = own
                count += 1
                break
            count -= 1
            for k in range(leaving, count):
                multiplier[k] = multiplier[k + 1]
                for i in range(n):
                    normals[k, i] = normals[k + 1, i]
    return False


@inlined
def _project(
    n: int,
    normals: Matrix,
    count: int,
    sign: float,
    row: Vector,
    G: Matrix,
    r: Vector,
    z: Vector,
) -> None:
    """Write r and `z = sign row - N^T r`, the part that no row at a bound has."""
    for i in range(count):
        r[i] = sign * _dot(n, normals[i], row)
        for j in range(i + 1):
            total = _dot(n, normals[i], normals[j])
            for k in range(j):
                total -= G[i, k] * G[j, k]
            if i == j:
                G[i, i] = np.sqrt(max(total, 1e-16))
            else:
                G[i, j] = total / G[j, j]
        for k in range(i):
            r[i] -= G[i, k] * r[k]
        r[i] /= G[i, i]
    for i in range(count - 1, -1, -1):
        for k in range(i + 1, count):
            r[i] -= G[k, i] * r[k]
        r[i] /= G[i, i]
    for i in range(n):
        z[i] = sign * row[i]
        for k in range(count):
            z[i] -= r[k] * normals[k, i]


@inlined
def _dot(n: int, a: Vector, b: Vector) -> float:
    total = 0.0
    for i in range(n):
        total += a[i] * b[i]
    return total
