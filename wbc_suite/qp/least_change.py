"""The least change within bounds: a small quadratic program, solved exactly."""

import numpy as np

from wbc_suite.compiling import compiled
from wbc_suite.linear_algebra import cholesky, dot, solve_lower, solve_upper
from wbc_suite.typing import Matrix, Vector

_MAX_STEPS = 100
_FEASIBLE = 1e-12  # accepted violation of rows of length 1, per 1 + |x|
_INDEPENDENT = 1e-12  # square of what the active rows must leave of a row of length 1


@compiled
def least_change(
    rows: Matrix, low: Vector, high: Vector, x: Vector, work: Matrix
) -> bool:
    """Minimise `|x|^2` subject to `low <= rows x <= high`.

    The dual active-set method: from x = 0, the most violated row becomes active; rows
    whose multiplier would change sign on the way become inactive. Each step ends at
    the optimum over its active rows, and there are finitely many sets. Return whether
    the bounds are feasible and x is the optimum.

    Args:
        rows: Rows of length 1 or, where they are zero, without bounds; shape (m, n).
        low: Lower bounds, shape (m,).
        high: Upper bounds, shape (m,).
        x: Output, shape (n,).
        work: Scratch, shape (2 n + 3, n).

    Source: Goldfarb, Idnani (1983), "A numerically stable dual method for solving
    strictly convex quadratic programs", Mathematical Programming 27.
    """
    x[:], count = 0.0, 0
    for _ in range(_MAX_STEPS):
        row, sign = _most_violated(rows, low, high, x)
        if row < 0:
            _project_out(1.0, x, work, count)
            for i in range(x.shape[0]):
                x[i] -= work[2 * x.shape[0] + 2, i]  # rounding of long steps
            return True
        bound = low[row] if sign > 0.0 else -high[row]
        count = _activate(rows[row], sign, bound, x, work, count)
        if count < 0:
            return False
    return False


@compiled
def _activate(  # noqa: C901, one loop
    row: Vector, sign: float, bound: float, x: Vector, work: Matrix, count: int
) -> int:
    """Make `sign row x >= bound` active; return the number of active rows, or -1."""
    n, own = x.shape[0], 0.0
    normals, multiplier = work[:n], work[2 * n]
    r, z = work[2 * n + 1], work[2 * n + 2]
    while True:
        _project_out(sign, row, work, count)
        length = dot(z, z, n)
        step, leaving = np.inf, -1
        for k in range(count):
            if r[k] > 0.0 and multiplier[k] < step * r[k]:
                step, leaving = multiplier[k] / r[k], k
        full = np.inf
        if count < n and length > _INDEPENDENT:
            full = (bound - sign * dot(row, x, n)) / length
        step = min(step, full)
        if step == np.inf:
            return -1
        own += step
        for k in range(count):
            multiplier[k] -= step * r[k]
        if full < np.inf:
            for i in range(n):
                x[i] += step * z[i]
        if step == full:
            for i in range(n):
                normals[count, i] = sign * row[i]
            multiplier[count] = own
            return count + 1
        count -= 1
        for k in range(leaving, count):
            multiplier[k] = multiplier[k + 1]
            for i in range(n):
                normals[k, i] = normals[k + 1, i]


@compiled
def _most_violated(
    rows: Matrix, low: Vector, high: Vector, x: Vector
) -> tuple[int, float]:
    """Return the most violated row, or -1, and 1 for its lower bound, -1 for upper."""
    n = x.shape[0]
    worst, row, sign = _FEASIBLE * (1.0 + np.sqrt(dot(x, x, n))), -1, 0.0
    for k in range(rows.shape[0]):
        value = dot(rows[k], x, n)
        if low[k] - value > worst:
            worst, row, sign = low[k] - value, k, 1.0
        if value - high[k] > worst:
            worst, row, sign = value - high[k], k, -1.0
    return row, sign


@compiled
def _project_out(sign: float, row: Vector, work: Matrix, count: int) -> None:
    """Write r and `z = sign row - N^T r`, orthogonal to the active normals N."""
    n = work.shape[1]
    normals, gram = work[:n], work[n : 2 * n]
    r, z = work[2 * n + 1], work[2 * n + 2]
    for i in range(count):
        r[i] = sign * dot(normals[i], row, n)
        for j in range(i + 1):
            gram[i, j] = dot(normals[i], normals[j], n)
    cholesky(gram, count, _INDEPENDENT)
    solve_lower(gram, r, count)
    solve_upper(gram, r, count)
    for i in range(n):
        z[i] = sign * row[i]
        for k in range(count):
            z[i] -= r[k] * normals[k, i]
