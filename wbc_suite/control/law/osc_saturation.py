"""Saturation of the operational-space law: keep the direction of the hand's motion."""

import numpy as np

from wbc_suite.compiling import inner
from wbc_suite.control.ground.acceleration_limits import acceleration_limits
from wbc_suite.control.ground.physics import Physics
from wbc_suite.control.ground.records import Drives, LawRecord
from wbc_suite.control.ground.rigid_body import multiply_inertia
from wbc_suite.linear_algebra import cholesky, dot, lq_factor, solve_lower, solve_upper
from wbc_suite.qp.least_change import least_change
from wbc_suite.typing import Matrix, Vector

SHORTENING_COST = 1e-2
"""[cost] of less velocity towards the goal, beside an equal error of acceleration."""

POSTURE_COST = 1e-3
"""[cost] of a change of the arm's posture, beside the same energy at the hand."""

_SHORTEST = 1e-12
"""A shorter pull has no direction."""


@inner
def keep_direction(physics: Physics, law: LawRecord, drives: Drives) -> None:
    """Change a law's accelerations a so that saturated joints keep the direction.

    Where torques or joint velocities saturate, the velocity u towards the goal is
    shortened, for linear and angular motion each, and the arm's posture is given up,
    before the hand leaves its line. At the least the hand brakes, `x'' = -kd v_s`. The
    change b solves

        minimise    || J b + h_1 x_1 + h_2 x_2 ||^2_L + c_h (h_1^2 + h_2^2)
                    + c_b b^T M b
        subject to  a_min <= a + b <= a_max,  tau_min <= tau + M b <= tau_max,
                    0 <= h_i <= || kd u_i ||_L

    with `x_i = kd u_i / || kd u_i ||_L`, the linear and the angular half of u, and the
    inertia L at the hand as norm. Nothing changes where the limits contradict each
    other. In the variable `y = (C^T b, h)` the norms are `|| J b ||_L = || Q y_b ||`,
    `|| x ||_L = || L^-1 x ||`, `b^T M b = y_b^T y_b`; with the cost's factor R, `R^T y`
    is the least change within bounds. The factors C, L and Q are those of `osc_law`,
    the bounds those of `is_saturated`.
    """
    n, work = law.last - law.first, physics.osc
    size, C, x = n + 2, work.C, work.z
    low, high = work.low, work.high
    R = _cost_factor(work.Q, n, work.L, work.pull, high)
    rows = _bounded_rows(C, n, R, low, high)
    count, scratch = rows.shape[0], np.empty((3 * size + 4, size))
    if least_change(rows, low[:count], high[:count], x[:size], scratch):
        solve_upper(R, x, size)
        solve_upper(C, x, n)
        for j in range(n):
            physics.acceleration[drives[law.first + j].dof] += x[j]


@inner
def is_saturated(physics: Physics, law: LawRecord, drives: Drives) -> bool:
    """Return whether the accelerations that a law asks for leave its limits.

    Writes the room of accelerations, then of torques, in `physics.osc`.
    """
    low, high = physics.osc.low, physics.osc.high
    n = law.last - law.first
    multiply_inertia(physics, physics.acceleration, physics.force)
    is_violated = False
    for j in range(n):
        drive = drives[law.first + j]
        dof = drive.dof
        lower, upper = acceleration_limits(physics, drive)
        low[j] = lower - physics.acceleration[dof]
        high[j] = upper - physics.acceleration[dof]
        bias = physics.qfrc_bias[dof] - physics.qfrc_passive[dof]
        torque = physics.force[dof] + law.compensation * bias - drive.disturbance
        low[n + j] = drive.command_min - torque
        high[n + j] = drive.command_max - torque
        for k in (j, n + j):
            is_violated = is_violated or low[k] > 0.0 or high[k] < 0.0
    return is_violated


@inner
def _cost_factor(Q: Matrix, n: int, L: Matrix, pull: Vector, high: Vector) -> Matrix:
    """Return the Cholesky factor of the cost of y; write the upper bounds of h."""
    size = n + 2
    lq_factor(Q, n + 6, np.empty((6, 6)))  # exact orthonormal rows
    W, half = np.zeros((6, size)), np.empty(6)
    for i in range(6):
        for j in range(n):
            W[i, j] = Q[i, j]
    for k in range(2):
        for i in range(6):
            half[i] = pull[i] if i // 3 == k else 0.0
        solve_lower(L, half, 6)
        length = np.sqrt(dot(half, half, 6))
        high[2 * n + k] = length
        for i in range(6):
            W[i, n + k] = half[i] / max(length, _SHORTEST)
    R = np.zeros((size, size))
    for i in range(size):
        for j in range(i + 1):
            for k in range(6):
                R[i, j] += W[k, i] * W[k, j]
        R[i, i] += POSTURE_COST if i < n else SHORTENING_COST
    cholesky(R, size, 0.0)
    return R


@inner
def _bounded_rows(C: Matrix, n: int, R: Matrix, low: Vector, high: Vector) -> Matrix:
    """Return the bounded rows in terms of `R^T y`, of length 1; scale their bounds."""
    size = R.shape[0]
    rows = np.zeros((2 * size - 2, size))
    low[2 * n] = low[2 * n + 1] = 0.0
    for i in range(n):
        rows[i, i] = 1.0  # accelerations: C^-T y_b
        solve_lower(C, rows[i], n)
        for j in range(i):
            rows[n + i, j] = C[i, j]  # torques: C y_b
        rows[n + i, i] = 1.0 / C[i, i]
    rows[2 * n, n] = rows[2 * n + 1, n + 1] = 1.0
    for i in range(rows.shape[0]):
        solve_lower(R, rows[i], size)
        length = np.sqrt(dot(rows[i], rows[i], size))
        for j in range(size):
            rows[i, j] /= length
        low[i], high[i] = low[i] / length, high[i] / length
    return rows
