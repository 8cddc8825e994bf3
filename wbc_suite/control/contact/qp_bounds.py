"""Costs of forces and postures, and bounds of accelerations and torques."""

import numpy as np

from wbc_suite.compiling import inner
from wbc_suite.control.contact.arrays import WholeBodyDynamics
from wbc_suite.control.contact.friction import bound_edge_forces
from wbc_suite.control.ground.physics import Physics

POSTURE_KP = 50.0
"""1/s^2."""

FORCE_COST = 1e-3
"""1/N; square root of the cost of a force along an edge."""

MOTION_COST = 1e-6
"""(s^2/rad)^2; least cost of an acceleration."""

LIMIT_GAINS = (400.0, 40.0, 20.0, 200.0)
"""kp (1/s^2) and kd (1/s) of positions, kp (1/s) of velocities, and the deceleration
with which limits are kept that are passed already, rad/s^2."""

ACCELERATION_MAX = 1e4
"""rad/s^2."""


@inner
def write_bounds(physics: Physics, body: WholeBodyDynamics) -> None:
    """Write the diagonal cost, and all bounds."""
    _write_costs(physics, body)
    bound_edge_forces(body)
    _bound_accelerations(physics, body)
    _bound_torques(body)


@inner
def _write_costs(physics: Physics, body: WholeBodyDynamics) -> None:
    """Write the cost of forces, and of joints away from their posture.

    Joints of a robot that tracks a motion, and those of a base, follow what other laws
    ask for instead.
    """
    qp, terms = body.qp, body.terms
    edges, kd = terms.B.shape[0], 2.0 * np.sqrt(POSTURE_KP)
    for k in range(edges):
        qp.diagonal[0, k], qp.diagonal[1, k] = FORCE_COST**2, 0.0
    for j in range(body.qpos.shape[0]):
        error = body.posture[j] - physics.qpos[body.qpos[j]]
        wanted = POSTURE_KP * error - kd * terms.v[6 + j]
        if body.follows[j] == 1:
            wanted = physics.acceleration[body.dofs[6 + j]]
        cost = body.posture_weight[j] ** 2
        qp.diagonal[0, edges + j] = cost + MOTION_COST
        qp.diagonal[1, edges + j] = cost * wanted


@inner
def _bound_accelerations(physics: Physics, body: WholeBodyDynamics) -> None:
    """Bound accelerations so that joints stay within position and velocity limits.

    A window is never empty: where limits disagree the upper bound gives way.
    """
    qp, edges = body.qp, body.terms.B.shape[0]
    kp, kd, kv, most = LIMIT_GAINS
    for j in range(body.qpos.shape[0]):
        q, v = physics.qpos[body.qpos[j]], body.terms.v[6 + j]
        fastest = body.limits[2, j]
        high = max(kp * (body.limits[1, j] - q) - kd * v, -most)
        high = min(high, max(kv * (fastest - v), -most))
        low = min(kp * (body.limits[0, j] - q) - kd * v, most)
        low = max(low, min(kv * (-fastest - v), most))
        low = min(max(low, -ACCELERATION_MAX), ACCELERATION_MAX - 1e-3)
        qp.lower[edges + j] = low
        qp.upper[edges + j] = max(min(high, ACCELERATION_MAX), low + 1e-3)


@inner
def _bound_torques(body: WholeBodyDynamics) -> None:
    """Write `tau = M_j a + h_j - B_j^T f` as rows of y, within the motors' limits."""
    terms, qp = body.terms, body.qp
    n, edges = body.qpos.shape[0], terms.B.shape[0]
    size = edges + n
    for j in range(n):
        row, M = qp.rows[j], terms.M[6 + j]
        for k in range(edges):
            row[k] = -terms.B[k, 6 + j]
        for k in range(n):
            row[edges + k] = M[6 + k]
        bias = terms.h[6 + j]
        for i in range(6):
            X, part = terms.root[i], M[i]
            for k in range(size):
                row[k] += part * X[k]
            bias += part * X[size]
        qp.upper[size + j] = body.limits[4, j] - bias
        qp.upper[size + n + j] = bias - body.limits[3, j]
        other = qp.rows[n + j]
        for k in range(size):
            other[k] = -row[k]
