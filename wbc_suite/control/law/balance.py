"""Balance of a robot on flat soles: track joints without falling over.

A sole can only push, within its friction cone and with its centre of pressure inside
its edges. Motions become contact forces first; where the ground cannot give them, the
trunk's attitude is given up before the centre of mass.
"""

import numpy as np

from wbc_suite.compiling import compiled
from wbc_suite.control.law.free_root import (
    Flags,
    contact_jacobian,
    equations_of_motion,
    law_dofs,
    leg_gram,
    root_reference,
    write_motion,
)
from wbc_suite.control.law.reference import reference_at
from wbc_suite.control.law.stance import TORQUE_ARM
from wbc_suite.control.loop.physics import Physics
from wbc_suite.control.loop.records import CompiledRecords
from wbc_suite.control.loop.rigid_body import rotation
from wbc_suite.linear_algebra import cholesky, solve, solve_lower, solve_upper
from wbc_suite.qp.least_change import least_change
from wbc_suite.typing import Matrix, Vector

COM_STIFFNESS = 60.0  # 1/s^2; well above g / h = 12 of the inverted pendulum
TRUNK_STIFFNESS = 150.0  # 1/s^2
TRUNK_COST = 0.05  # [cost] s^2/rad against 1 [cost] s^2/m of the centre of mass
SHARE_COST = 1e-4  # [cost]/N; keeps forces near the even distribution
FRICTION = 0.6  # below that of rubber on most floors, 0.8 to 1
TWIST = 0.03  # m; friction torque about the normal over normal force, of a sole
LEAST_PRESSURE = 20.0  # N; normal force of each sole
EDGE = 0.008  # m; distance of centres of pressure from a sole's edge
TORQUE_SHARE = 0.95  # of the motors' limits, for planned forces


@compiled
def balance_law(
    physics: Physics, law: CompiledRecords, drives: CompiledRecords
) -> None:
    """Write accelerations and contact forces of a `StanceLaw` on soles.

    With soles at rest, the acceleration of the legs follows from the root's, and the
    root's from the contact forces f alone, M being the inertia of everything:

        a_l = a_t - J_l^+ (J_r a_r + J_l a_t + J' v + k J v)
        A a_r + b = J_r^T f,   A = M_rr - M_rl J_l^+ J_r

    a_t tracks the legs' joints, and counts only where knees are stretched. Wanted are
    the centre of mass's acceleration `c*'' + k e + d e'`, the trunk's likewise, and, of
    arms, waist and head, what other laws ask for. The references of the joints give
    that of the centre of mass. The evenly distributed f that gives both is taken when
    all soles and legs can give it. Otherwise the nearest that they can give is found by
    a QP in f.

    Source: Righetti et al. (2013), "Optimal distribution of contact forces with
    inverse-dynamics control", IJRR 32(3).
    """
    dofs = law_dofs(law, drives)
    size = dofs.shape[0]
    M, h, asked = equations_of_motion(physics, dofs)
    J, drift, is_leg = contact_jacobian(physics, law, dofs)
    S, s = _motion_by_root(J, drift, is_leg, asked)
    A, b = np.zeros((6, 6)), h[:6].copy()
    for i in range(6):
        for j in range(size):
            b[i] += M[i, j] * s[j]
            for k in range(6):
                A[i, k] += M[i, j] * S[j, k]
    root = _root_acceleration(physics, law, drives, M, h, A, b)
    wrench = b.copy()
    for i in range(6):
        for k in range(6):
            wrench[i] += A[i, k] * root[k]
    A_inverse = np.eye(6)
    solve(A, A_inverse, 6)
    f = _even_forces(J, wrench)
    rows, low, high = _force_bounds(
        physics, law, drives, M, h, J, S, s, A_inverse, b, is_leg
    )
    _move_within_bounds(M, J, A_inverse, rows, low, high, f)
    _apply_forces(J, A_inverse, b, f, root)
    for j in range(size):
        for k in range(6):
            s[j] += S[j, k] * root[k]
    write_motion(physics, law, drives, J, s, f)


@compiled
def _apply_forces(
    J: Matrix, A_inverse: Matrix, b: Vector, f: Vector, root: Vector
) -> None:
    """Write the root's acceleration `A^-1 (J_r^T f - b)`."""
    wrench = -b
    for i in range(6):
        for r in range(f.shape[0]):
            wrench[i] += J[r, i] * f[r]
    for i in range(6):
        root[i] = 0.0
        for k in range(6):
            root[i] += A_inverse[i, k] * wrench[k]


@compiled
def _motion_by_root(
    J: Matrix, drift: Vector, is_leg: Flags, asked: Vector
) -> tuple[Matrix, Vector]:
    """Return S, (6 + n, 6), and s of `a = S a_r + s`, with soles at rest."""
    m, size = J.shape
    S, s, x = np.zeros((size, 6)), asked.copy(), np.empty(m)
    G = leg_gram(J, is_leg)
    cholesky(G, m, 0.0)
    s[:6] = 0.0
    for r in range(m):
        x[r] = drift[r] + np.sum(J[r] * s)
    _subtract_leg_motion(G, J, is_leg, x, s)
    for k in range(6):
        x[:] = J[:, k]
        _subtract_leg_motion(G, J, is_leg, x, S[:, k])
        S[k, k] = 1.0
    return S, s


@compiled
def _subtract_leg_motion(
    G: Matrix, J: Matrix, is_leg: Flags, x: Vector, a: Vector
) -> None:
    """Subtract `J_l^T G^-1 x` from the accelerations of legs; x is destroyed."""
    m = x.shape[0]
    solve_lower(G, x, m)
    solve_upper(G, x, m)
    for j in range(6, J.shape[1]):
        if is_leg[j]:
            for r in range(m):
                a[j] -= J[r, j] * x[r]


@compiled
def _root_acceleration(
    physics: Physics,
    law: CompiledRecords,
    drives: CompiledRecords,
    M: Matrix,
    h: Vector,
    A: Matrix,
    b: Vector,
) -> Vector:
    """Return the root's acceleration that moves centre of mass and trunk as wanted.

    The root's linear rows of M are m J_c: they turn errors of joints into those of the
    centre of mass.
    """
    size, damping = M.shape[0], 2.0 * np.sqrt(COM_STIFFNESS)
    position, velocity, acceleration = root_reference(physics, law)
    root, force = np.zeros(6), h[:3] - b[:3]
    turn_damping = 2.0 * np.sqrt(TRUNK_STIFFNESS)
    root[3:] = acceleration[3:] + TRUNK_STIFFNESS * position[3:]
    root[3:] += turn_damping * velocity[3:]
    for j in range(size):
        if j < 6:
            e, e_rate, feed_forward = position[j], velocity[j], acceleration[j]
        else:
            drive = drives[law.first + j - 6]
            q, v, feed_forward = reference_at(law, drive)
            e, e_rate = q - physics.qpos[drive.qpos], v - physics.qvel[drive.dof]
        wanted = feed_forward + COM_STIFFNESS * e + damping * e_rate
        for i in range(3):
            force[i] += M[i, j] * wanted
    B, x = A[:3, :3].copy(), np.empty((3, 1))
    for i in range(3):
        x[i, 0] = force[i]
        for k in range(3, 6):
            x[i, 0] -= A[i, k] * root[k]
    solve(B, x, 3)
    root[:3] = x[:, 0]
    return root


@compiled
def _even_forces(J: Matrix, wrench: Vector) -> Vector:
    """Return the least f, by weights, with `J_r^T f = wrench`."""
    m = J.shape[0]
    A, x, f = np.zeros((6, 6)), wrench.copy(), np.zeros(m)
    for i in range(6):
        for j in range(i + 1):
            for r in range(m):
                weight = 1.0 if r % 6 < 3 else TORQUE_ARM**2
                A[i, j] += J[r, i] * weight * J[r, j]
    cholesky(A, 6, 0.0)
    solve_lower(A, x, 6)
    solve_upper(A, x, 6)
    for r in range(m):
        for i in range(6):
            f[r] += (1.0 if r % 6 < 3 else TORQUE_ARM**2) * J[r, i] * x[i]
    return f


@compiled
def sole_rows(edges: Vector, R: Matrix) -> Matrix:
    """Return rows G of what a sole can give, `G (force, torque) <= 0`, world axes.

    Friction as a pyramid inside the cone, the centre of pressure inside the edges, and
    a bounded torque about the normal; x y z are the sole's axes:

        |f_x|, |f_y| <= mu f_z / sqrt(2),   |t_z| <= TWIST f_z,
        y_min f_z <= t_x <= y_max f_z,      x_min f_z <= -t_y <= x_max f_z.

    Args:
        edges: Heel, toes, right, left, m, shape (4,).
        R: Axes of its frame in the world.

    Returns:
        Shape (10, 6).
    """
    heel, toes, right, left = edges[0], edges[1], edges[2], edges[3]
    mu = FRICTION / np.sqrt(2.0)
    local, rows = np.zeros((10, 6)), np.zeros((10, 6))
    for i in range(2):
        local[2 * i, i], local[2 * i, 2] = 1.0, -mu
        local[2 * i + 1, i], local[2 * i + 1, 2] = -1.0, -mu
        local[8 + i, 2], local[8 + i, 5] = -TWIST, 1.0 - 2.0 * i
    local[4, 2], local[4, 3] = -(left - EDGE), 1.0
    local[5, 2], local[5, 3] = right + EDGE, -1.0
    local[6, 2], local[6, 4] = -(toes - EDGE), -1.0
    local[7, 2], local[7, 4] = heel + EDGE, 1.0
    for r in range(10):
        for i in range(3):
            for j in range(3):
                rows[r, i] += local[r, j] * R[i, j]
                rows[r, 3 + i] += local[r, 3 + j] * R[i, j]
    return rows


@compiled
def _force_bounds(
    physics: Physics,
    law: CompiledRecords,
    drives: CompiledRecords,
    M: Matrix,
    h: Vector,
    J: Matrix,
    S: Matrix,
    s: Vector,
    A_inverse: Matrix,
    b: Vector,
    is_leg: Flags,
) -> tuple[Matrix, Vector, Vector]:
    """Return rows of f with their bounds: what soles can give, and legs can carry.

    The torques of leg joints are affine in f: `M_l (S a_r + s) + h_l - J_l^T f` with
    `a_r = A^-1 (J_r^T f - b)`.
    """
    m, size = J.shape
    feet, legs = law.stance.feet, int(np.sum(is_leg))
    rows = np.zeros((11 * feet + legs, m))
    low, high = np.full(rows.shape[0], -np.inf), np.zeros(rows.shape[0])
    for k in range(feet):
        R = rotation(physics.site_xmat, law.stance.site[k])
        sole = sole_rows(law.stance.edges[k], R)
        rows[10 * k : 10 * k + 10, 6 * k : 6 * k + 6] = sole
        rows[10 * feet + k, 6 * k + 2] = -1.0
        high[10 * feet + k] = -LEAST_PRESSURE
    row, by_root, by_wrench = 11 * feet, np.empty(6), np.empty(6)
    for j in range(6, size):
        if not is_leg[j]:
            continue
        offset = h[j] + np.sum(M[j] * s)
        for k in range(6):
            by_root[k] = np.sum(M[j] * S[:, k])
        for k in range(6):
            by_wrench[k] = np.sum(by_root * A_inverse[:, k])
        offset -= np.sum(by_wrench * b)
        for r in range(m):
            rows[row, r] = np.sum(by_wrench * J[r, :6]) - J[r, j]
        drive = drives[law.first + j - 6]
        low[row] = TORQUE_SHARE * drive.command_min - offset
        high[row] = TORQUE_SHARE * drive.command_max - offset
        row += 1
    return rows, low, high


@compiled
def _move_within_bounds(
    M: Matrix,
    J: Matrix,
    A_inverse: Matrix,
    rows: Matrix,
    low: Vector,
    high: Vector,
    f: Vector,
) -> None:
    """Move f within its bounds by the least change of the robot's accelerations.

        minimise    || W J_r^T (f - f_0) ||^2 + c || f - f_0 ||^2

    W turns wrenches into accelerations of the centre of mass and, at a lower cost, of
    the trunk. f stays where the bounds contradict each other.
    """
    m, is_violated = J.shape[0], False
    for k in range(rows.shape[0]):
        value = np.sum(rows[k] * f)
        low[k], high[k] = low[k] - value, high[k] - value
        is_violated = is_violated or low[k] > 0.0 or high[k] < 0.0
    if not is_violated:
        return
    effect, R, x = np.zeros((6, m)), np.zeros((m, m)), np.empty(m)
    for r in range(m):
        for i in range(3):
            effect[i, r] = J[r, i] / M[0, 0]
            effect[3 + i, r] = TRUNK_COST * np.sum(A_inverse[3 + i] * J[r, :6])
    for r in range(m):
        for q in range(r + 1):
            R[r, q] = np.sum(effect[:, r] * effect[:, q])
        R[r, r] += SHARE_COST**2 * (1.0 if r % 6 < 3 else TORQUE_ARM**-2)
    cholesky(R, m, 0.0)
    for k in range(rows.shape[0]):
        solve_lower(R, rows[k], m)
        length = np.sqrt(np.sum(rows[k] * rows[k]))
        rows[k] /= length
        low[k], high[k] = low[k] / length, high[k] / length
    if least_change(rows, low, high, x, np.empty((2 * m + 3, m))):
        solve_upper(R, x, m)
        f += x
