"""What soles can give so that the rest can move: the kernel of `BalanceLaw`."""

import numpy as np

from wbc_suite.compiling import compiled
from wbc_suite.control.loop.least_change import least_change
from wbc_suite.control.loop.linear import factorise, solve, solve_lower, solve_upper
from wbc_suite.control.loop.motion import target_of
from wbc_suite.control.loop.physics import Physics
from wbc_suite.control.loop.stance import (
    TORQUE_ARM,
    Flags,
    count_rows,
    give,
    inertia_and_bias,
    legs_squared,
    root_target,
    write_feet,
)
from wbc_suite.control.loop.table import CompiledRecords
from wbc_suite.typing import Matrix, Vector

__all__ = [
    "COM_STIFFNESS",
    "EDGE",
    "FRICTION",
    "LEAST_PRESSURE",
    "SHARE_COST",
    "TORQUE_SHARE",
    "TRUNK_COST",
    "TRUNK_STIFFNESS",
    "TWIST",
    "balance_law",
]

COM_STIFFNESS = 60.0  # 1/s^2; well above g / h = 12, or the pendulum falls
TRUNK_STIFFNESS = 150.0  # 1/s^2
TRUNK_COST = 0.05  # [cost] s^2/rad against 1 [cost] s^2/m: the trunk gives way first
SHARE_COST = 1e-4  # [cost]/N; keeps forces near the even share
FRICTION = 0.6  # below that of rubber on most floors, 0.8 to 1
TWIST = 0.03  # m; friction torque about the normal over normal force, of a sole
LEAST_PRESSURE = 20.0  # N; a sole never lets go
EDGE = 0.008  # m; how far pressure points stay from a sole's edge
TORQUE_SHARE = 0.95  # of the motors' limits that planned forces may ask for


@compiled
def balance_law(  # noqa: C901, flat loops over small matrices
    physics: Physics, law: CompiledRecords, drives: CompiledRecords
) -> None:
    """Do what `BalanceLaw.stand` does; names are its own."""
    size, m = 6 + law.last - law.first, count_rows(law)
    M, h, s = np.zeros((size, size)), np.empty(size), np.empty(size)
    J, moved = np.zeros((m, size)), np.empty(m)
    is_leg = np.zeros(size, dtype=np.bool_)
    S, A, lift, b = np.zeros((size, 6)), np.empty((6, 6)), np.eye(6), np.empty(6)
    inertia_and_bias(physics, law, drives, M, h, s)
    write_feet(physics, law, drives, J, moved, is_leg)
    free_motion(J, moved, is_leg, S, s)
    for i in range(6):
        b[i] = h[i]
        for j in range(size):
            b[i] += M[i, j] * s[j]
        for k in range(6):
            A[i, k] = 0.0
            for j in range(size):
                if j < 6 or is_leg[j]:
                    A[i, k] += M[i, j] * S[j, k]
    root, wrench = np.empty(6), np.empty(6)
    root_acceleration(physics, law, drives, M, h, A, b, root)
    for i in range(6):
        wrench[i] = b[i]
        for k in range(6):
            wrench[i] += A[i, k] * root[k]
    solve(A, lift)
    f = law.stance.force
    even_share(law, J, wrench, f)
    rows, low, high = bounds(physics, law, drives, M, h, J, S, s, lift, b, is_leg, f)
    give_up_least(law, M, J, lift, rows, low, high, f)
    for i in range(6):
        wrench[i] = -b[i]
        for r in range(m):
            wrench[i] += J[r, i] * f[r]
    for i in range(6):
        root[i] = 0.0
        for k in range(6):
            root[i] += lift[i, k] * wrench[k]
    for j in range(size):
        for k in range(6):
            s[j] += S[j, k] * root[k]
    give(physics, law, drives, J, s)


@compiled
def free_motion(J: Matrix, moved: Vector, is_leg: Flags, S: Matrix, s: Vector) -> None:
    """Write S and s, `a = S a_r + s`, with soles at rest."""
    m, size = J.shape
    R, x = np.empty((m, m)), np.empty(m)
    legs_squared(J, is_leg, R)
    factorise(R)
    for k in range(7):
        for r in range(m):
            if k < 6:
                x[r] = J[r, k]
            else:
                x[r] = moved[r]
                for j in range(6, size):
                    x[r] += J[r, j] * s[j]
        solve_lower(R, x)
        solve_upper(R, x)
        for j in range(6, size):
            if is_leg[j]:
                for r in range(m):
                    if k < 6:
                        S[j, k] -= J[r, j] * x[r]
                    else:
                        s[j] -= J[r, j] * x[r]
    for i in range(6):
        S[i, i], s[i] = 1.0, 0.0


@compiled
def root_acceleration(
    physics: Physics,
    law: CompiledRecords,
    drives: CompiledRecords,
    M: Matrix,
    h: Vector,
    A: Matrix,
    b: Vector,
    root: Vector,
) -> None:
    """Write what moves the centre of mass and turns the trunk as wanted."""
    size = M.shape[0]
    damping = 2.0 * np.sqrt(COM_STIFFNESS)
    turning = 2.0 * np.sqrt(TRUNK_STIFFNESS)
    position, velocity, com = np.empty(6), np.empty(6), np.empty(size)
    root_target(physics, law, position, velocity, com)
    for i in range(3):
        e, v = position[3 + i], velocity[3 + i]
        root[3 + i] = com[3 + i] + TRUNK_STIFFNESS * e + turning * v
    for j in range(size):
        if j < 6:
            e, v, ahead = position[j], velocity[j], com[j]
        else:
            drive = drives[law.first + j - 6]
            e, v, ahead = target_of(law, drive)
            e -= physics.qpos[drive.qpos]
            v -= physics.qvel[drive.dof]
        com[j] = ahead + COM_STIFFNESS * e + damping * v
    B, x = np.empty((3, 3)), np.empty((3, 1))
    for i in range(3):
        x[i, 0] = h[i] - b[i]
        for j in range(size):
            x[i, 0] += M[i, j] * com[j]
        for k in range(3):
            B[i, k] = A[i, k]
            x[i, 0] -= A[i, 3 + k] * root[3 + k]
    solve(B, x)
    for i in range(3):
        root[i] = x[i, 0]


@compiled
def even_share(law: CompiledRecords, J: Matrix, wrench: Vector, f: Vector) -> None:
    """Write the least f, by weights, with `J_r^T f = wrench`."""
    m = J.shape[0]
    A, x = np.zeros((6, 6)), wrench.copy()
    for i in range(6):
        for j in range(i + 1):
            for r in range(m):
                weight = 1.0 if r % 6 < 3 else TORQUE_ARM**2
                A[i, j] += J[r, i] * weight * J[r, j]
    factorise(A)
    solve_lower(A, x)
    solve_upper(A, x)
    for r in range(m):
        f[r] = 0.0
        for i in range(6):
            f[r] += (1.0 if r % 6 < 3 else TORQUE_ARM**2) * J[r, i] * x[i]


@compiled
def bounds(  # noqa: C901, flat loops over small matrices
    physics: Physics,
    law: CompiledRecords,
    drives: CompiledRecords,
    M: Matrix,
    h: Vector,
    J: Matrix,
    S: Matrix,
    s: Vector,
    lift: Matrix,
    b: Vector,
    is_leg: Flags,
    f: Vector,
) -> tuple[Matrix, Vector, Vector]:
    """Return rows of what soles can give and legs can carry, and room beside f."""
    m, size = J.shape
    feet, count = law.stance.feet, 11 * law.stance.feet
    for j in range(6, size):
        count += 1 if is_leg[j] else 0
    rows, low, high = np.zeros((count, m)), np.full(count, -np.inf), np.zeros(count)
    for k in range(feet):
        sole_bounds(physics, law, k, rows)
        rows[10 * feet + k, 6 * k + 2] = -1.0
        high[10 * feet + k] = -LEAST_PRESSURE
    row, x, y = 11 * feet, np.empty(6), np.empty(6)
    for j in range(6, size):
        if not is_leg[j]:
            continue
        offset = h[j]
        for i in range(size):
            offset += M[j, i] * s[i]
        for k in range(6):
            x[k] = 0.0
            for i in range(size):
                if i < 6 or is_leg[i]:
                    x[k] += M[j, i] * S[i, k]
        for k in range(6):
            y[k] = 0.0
            for i in range(6):
                y[k] += x[i] * lift[i, k]
            offset -= y[k] * b[k]
        for r in range(m):
            rows[row, r] = -J[r, j]
            for k in range(6):
                rows[row, r] += y[k] * J[r, k]
        drive = drives[law.first + j - 6]
        low[row] = TORQUE_SHARE * drive.low - offset
        high[row] = TORQUE_SHARE * drive.high - offset
        row += 1
    for k in range(count):
        total = 0.0
        for r in range(m):
            total += rows[k, r] * f[r]
        low[k], high[k] = low[k] - total, high[k] - total
    return rows, low, high


@compiled
def sole_bounds(physics: Physics, law: CompiledRecords, k: int, rows: Matrix) -> None:
    """Write `sole_rows` of a sole."""
    edges, R = law.stance.edges[k], physics.site_xmat[law.stance.site[k]]
    mu = FRICTION / np.sqrt(2.0)
    local = np.zeros((10, 6))
    for i in range(2):
        local[2 * i, i], local[2 * i, 2] = 1.0, -mu
        local[2 * i + 1, i], local[2 * i + 1, 2] = -1.0, -mu
        local[8 + i, 2], local[8 + i, 5] = -TWIST, 1.0 - 2.0 * i
    local[4, 2], local[4, 3] = -(edges[3] - EDGE), 1.0
    local[5, 2], local[5, 3] = edges[2] + EDGE, -1.0
    local[6, 2], local[6, 4] = -(edges[1] - EDGE), -1.0
    local[7, 2], local[7, 4] = edges[0] + EDGE, 1.0
    for r in range(10):
        for i in range(3):
            for j in range(3):
                rows[10 * k + r, 6 * k + i] += local[r, j] * R[3 * i + j]
                rows[10 * k + r, 6 * k + 3 + i] += local[r, 3 + j] * R[3 * i + j]


@compiled
def give_up_least(  # noqa: C901, flat loops over small matrices
    law: CompiledRecords,
    M: Matrix,
    J: Matrix,
    lift: Matrix,
    rows: Matrix,
    low: Vector,
    high: Vector,
    f: Vector,
) -> None:
    """Move f within its bounds, by the least change of what the robot does."""
    m, must = J.shape[0], False
    for k in range(rows.shape[0]):
        must = must or low[k] > 0.0 or high[k] < 0.0
    if not must:
        return
    W, R, x = np.zeros((6, m)), np.zeros((m, m)), np.empty(m)
    for r in range(m):
        for i in range(3):
            W[i, r] = J[r, i] / M[0, 0]
            for k in range(6):
                W[3 + i, r] += TRUNK_COST * lift[3 + i, k] * J[r, k]
    for r in range(m):
        for q in range(r + 1):
            for i in range(6):
                R[r, q] += W[i, r] * W[i, q]
        R[r, r] += SHARE_COST**2 * (1.0 if r % 6 < 3 else TORQUE_ARM**-2)
    factorise(R)
    for k in range(rows.shape[0]):
        solve_lower(R, rows[k])
        length = 0.0
        for r in range(m):
            length += rows[k, r] ** 2
        length = np.sqrt(length)
        low[k], high[k] = low[k] / length, high[k] / length
        for r in range(m):
            rows[k, r] /= length
    if least_change(rows, low, high, x, np.empty((2 * m + 3, m))):
        solve_upper(R, x)
        for r in range(m):
            f[r] += x[r]
