"""The least change within bounds: a small quadratic program, solved exactly."""

import numpy as np

from wbc_suite.compiling import compiled, inner
from wbc_suite.linear_algebra import (
    copy_rows,
    dot,
    lq_factor,
    lq_solve,
    solve_lower,
    solve_upper,
)
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
        work: Scratch, shape (3 n + 4, n).

    Source: Goldfarb, Idnani (1983), "A numerically stable dual method for solving
    strictly convex quadratic programs", Mathematical Programming 27.
    """
    x[:], count, bounds = 0.0, 0, work[3 * x.shape[0]]
    for _ in range(_MAX_STEPS):
        row, sign = _most_violated(rows, low, high, x)
        if row < 0:
            _least_norm(bounds, x, work, count)
            return True
        bound = low[row] if sign > 0.0 else -high[row]
        count = _activate(rows[row], sign, bound, x, work, count)
        if count < 0:
            return False
    return False


@inner
def _activate(  # noqa: C901, one loop
    row: Vector, sign: float, bound: float, x: Vector, work: Matrix, count: int
) -> int:
    """Make `sign row x >= bound` active; return the number of active rows, or -1."""
    n, own = x.shape[0], 0.0
    normals, bounds, multiplier = work[:n], work[3 * n], work[3 * n + 1]
    r, z = work[3 * n + 2], work[3 * n + 3]
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
            multiplier[count], bounds[count] = own, bound
            return count + 1
        count -= 1
        for k in range(leaving, count):
            multiplier[k], bounds[k] = multiplier[k + 1], bounds[k + 1]
            for i in range(n):
                normals[k, i] = normals[k + 1, i]


@inner
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


@inner
def _project_out(sign: float, row: Vector, work: Matrix, count: int) -> None:
    """Write r and `z = sign row - N^T r`, orthogonal to the active normals N."""
    n = work.shape[1]
    Q, L = _factorise(work, count)
    r, z = work[3 * n + 2], work[3 * n + 3]
    r[:count] = 0.0
    for i in range(n):
        z[i] = sign * row[i]
    for _ in range(2):  # the second time for what rounding left
        for k in range(count):
            part = dot(Q[k], z, n)
            r[k] += part
            for i in range(n):
                z[i] -= part * Q[k, i]
    solve_upper(L, r, count)


@inner
def _least_norm(bounds: Vector, x: Vector, work: Matrix, count: int) -> None:
    """Write the shortest x at the bounds of the active rows, free of step errors."""
    Q, L = _factorise(work, count)
    solve_lower(L, bounds, count)
    lq_solve(Q, x.shape[0], bounds, x)


@inner
def _factorise(work: Matrix, count: int) -> tuple[Matrix, Matrix]:
    """Return the factors Q and L of the active normals, `N = L Q`."""
    n = work.shape[1]
    Q, L = work[n : n + count], work[2 * n : 2 * n + count]
    copy_rows(work[:count], Q)
    lq_factor(Q, n, L)
    return Q, L
