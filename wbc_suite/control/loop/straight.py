"""Keep the direction of the hand's motion where joints are at their limits."""

import numpy as np

from wbc_suite.compiling import compiled_inner, inlined
from wbc_suite.control.loop.factors import (
    cholesky,
    orthonormalise,
    solve_lower,
    solve_upper,
)
from wbc_suite.control.loop.least_change import least_change
from wbc_suite.control.loop.physics import CHANGE, INERTIA, LIMITS, Physics
from wbc_suite.control.loop.table import CompiledRecords
from wbc_suite.control.loop.window import keep_window, window
from wbc_suite.typing import Matrix, Vector

__all__ = ["POSTURE_COST", "SHORTENING_COST", "keep_straight"]

SHORTENING_COST = 1e-2
"""[cost] of less speed towards the goal, beside an acceleration off by as much."""

POSTURE_COST = 1e-3
"""[cost] of a change of the arm's posture beside the same energy at the hand."""


SHORTEST = 1e-12
"""A shorter pull has no direction."""


@compiled_inner
def keep_straight(
    physics: Physics,
    law: CompiledRecords,
    drives: CompiledRecords,
    L: Matrix,
    Q: Matrix,
    C: Matrix,
    pull: Vector,
) -> None:
    """Change a law's accelerations as `OscLaw.straightened` does.

    In the variables `x = R^T (L^T b, h)` with the cost's factor R, it is the least
    change within bounds.

    Args:
        physics: The simulation; the law's accelerations are in its scratch.
        law: The law.
        drives: All drives.
        L: Factor of the arm's inertia by `cholesky`, shape (n, n).
        Q: Factor of `J L^-T` by `factorise`, shape (6, n + 6).
        C: The other factor, shape (6, 6).
        pull: What of x'' the goal asks for, `kd u`, shape (6,).
    """
    n, size = law.last - law.first, law.last - law.first + 2
    k = L.shape[0] + INERTIA
    work = physics.work
    low, high = work[LIMITS], work[LIMITS + 1]
    if not _out_of_bounds(physics, law, drives, low, high):
        return
    H, rows = work[k : k + size], work[k + size : k + 3 * size - 2]
    k += 3 * size - 2
    W = work[k : k + 6]
    orthonormalise(Q, n + 6, W)
    _write_cost(n, Q, C, pull, W, H, low, high)
    cholesky(H, size)
    _write_rows(n, L, H, rows, low, high)
    x = work[CHANGE, :size]
    if least_change(rows, low, high, x, work[k : k + 2 * size + 3]):
        solve_upper(H, x, size)
        solve_upper(L, x, n)
        for j in range(n):
            physics.acceleration[drives[law.first + j].dof] += x[j]
    keep_window(physics, law, drives)


@inlined
def _out_of_bounds(
    physics: Physics,
    law: CompiledRecords,
    drives: CompiledRecords,
    low: Vector,
    high: Vector,
) -> bool:
    """Write how far accelerations and torques may change; tell whether they must."""
    n, a, force = law.last - law.first, physics.acceleration, physics.force
    for j in range(law.first, law.last):
        force[drives[j].dof] = 0.0
    for j in range(law.first, law.last):
        dof = drives[j].dof
        first = physics.M_rowadr[dof]
        last = first + physics.M_rownnz[dof] - 1
        total = physics.M[last] * a[dof]
        for k in range(first, last):
            column = physics.M_colind[k]
            total += physics.M[k] * a[column]
            force[column] += physics.M[k] * a[dof]
        force[dof] += total
    must = False
    for j in range(n):
        drive = drives[law.first + j]
        dof = drive.dof
        lower, upper = window(physics, drive)
        low[j], high[j] = lower - a[dof], upper - a[dof]
        bias = physics.qfrc_bias[dof] - physics.qfrc_passive[dof]
        torque = force[dof] - drive.disturbance + law.compensation * bias
        low[n + j], high[n + j] = drive.low - torque, drive.high - torque
        for k in (j, n + j):
            must = must or low[k] > 0.0 or high[k] < 0.0
    return must


@inlined
def _write_cost(
    n: int,
    Q: Matrix,
    C: Matrix,
    pull: Vector,
    W: Matrix,
    H: Matrix,
    low: Vector,
    high: Vector,
) -> None:
    """Write the cost of (L^T b, h), and the bounds of h; W is scratch."""
    for i in range(6):
        for j in range(n):
            W[i, j] = Q[i, j]
        W[i, n], W[i, n + 1] = (pull[i], 0.0) if i < 3 else (0.0, pull[i])
    for j in range(n, n + 2):
        length = 0.0
        for i in range(6):
            for k in range(i):
                W[i, j] -= C[i, k] * W[k, j]
            W[i, j] *= C[i, i]
            length += W[i, j] * W[i, j]
        low[n + j], high[n + j] = 0.0, np.sqrt(length)
        for i in range(6):
            W[i, j] /= max(high[n + j], SHORTEST)
    for i in range(n + 2):
        for j in range(i + 1):
            H[i, j] = 0.0
            for k in range(6):
                H[i, j] += W[k, i] * W[k, j]
        H[i, i] += POSTURE_COST if i < n else SHORTENING_COST


@inlined
def _write_rows(
    n: int, L: Matrix, H: Matrix, rows: Matrix, low: Vector, high: Vector
) -> None:
    """Write what is bounded in terms of x, rows of length 1, and scale the bounds."""
    for i in range(2 * n + 2):
        row = rows[i]
        for j in range(n + 2):
            row[j] = 0.0
        if i >= 2 * n:
            row[i - n] = 1.0
        elif i >= n:  # torques L z
            for j in range(i - n):
                row[j] = L[i - n, j]
            row[i - n] = 1.0 / L[i - n, i - n]
        else:  # accelerations L^-T z
            row[i] = 1.0
            solve_lower(L, row, n)
        solve_lower(H, row, n + 2)
        length = 0.0
        for j in range(n + 2):
            length += row[j] * row[j]
        length = np.sqrt(length)
        low[i], high[i] = low[i] / length, high[i] / length
        for j in range(n + 2):
            row[j] /= length
