"""What feet have to give so that the rest can move: the kernel of `StanceLaw`.

Columns of all matrices: the six of the free root, then the law's drives.
"""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from wbc_suite.compiling import compiled
from wbc_suite.control.loop.linear import (
    factorise,
    pseudo_inverse,
    solve_lower,
    solve_upper,
)
from wbc_suite.control.loop.motion import (
    multiply,
    point_column,
    point_motion,
    rotate,
)
from wbc_suite.control.loop.physics import Physics
from wbc_suite.control.loop.table import CompiledRecords, LawKind
from wbc_suite.qp.lie import exp3, log3
from wbc_suite.typing import Matrix, Vector

__all__ = [
    "CONTACT_DAMPING",
    "LEAST_PRESSURE",
    "RANK",
    "SINGULAR",
    "TORQUE_ARM",
    "Flags",
    "count_rows",
    "follow_feet",
    "give",
    "inertia_and_bias",
    "root_target",
    "stance_law",
    "take_contact_forces",
    "write_feet",
]

Flags: TypeAlias = NDArray[np.bool_]
"""Which columns belong to joints that carry feet."""

CONTACT_DAMPING = 30.0
"""1/s; stops a foot that slips or tips."""

SINGULAR = 0.01
"""m/rad; below it a leg is stretched."""

TORQUE_ARM = 0.05
"""m; a contact torque of 0.05 N m counts as much as a force of 1 N: soles are small."""

LEAST_PRESSURE = 10.0
"""N; what arms do leaves each foot so much to press with."""

RANK = 1e-9
"""Part of the stiffest direction; in softer ones feet give nothing."""

_STANCE = int(LawKind.STANCE)


@compiled
def stance_law(physics: Physics, law: CompiledRecords, drives: CompiledRecords) -> None:
    """Do what `StanceLaw.stand` does."""
    size, m = 6 + law.last - law.first, count_rows(law)
    J, moved = np.zeros((m, size)), np.empty(m)
    M, h, a = np.zeros((size, size)), np.empty(size), np.empty(size)
    is_leg = np.zeros(size, dtype=np.bool_)
    inertia_and_bias(physics, law, drives, M, h, a)
    position, velocity = np.empty(6), np.empty(6)
    root_target(physics, law, position, velocity, a)
    for i in range(6):
        a[i] += law.kp[i] * position[i] + law.kd[i] * velocity[i]
    write_feet(physics, law, drives, J, moved, is_leg)
    follow_feet(J, moved, is_leg, a)
    still, swung = np.empty(6), np.zeros(6)
    for i in range(6):
        still[i] = h[i]
        for j in range(size):
            if j < 6 or is_leg[j]:
                still[i] += M[i, j] * a[j]
            else:
                swung[i] += M[i, j] * a[j]
    part = share(law, J, still, swung)
    for j in range(6, size):
        if not is_leg[j]:
            a[j] *= part
    give(physics, law, drives, J, a)


@compiled
def count_rows(law: CompiledRecords) -> int:
    """Return how many rows the Jacobian of all feet has."""
    total = 0
    for k in range(law.stance.feet):
        total += law.stance.rows[k]
    return total


@compiled
def inertia_and_bias(
    physics: Physics,
    law: CompiledRecords,
    drives: CompiledRecords,
    M: Matrix,
    h: Vector,
    a: Vector,
) -> None:
    """Write M and h of root and drives, and what is asked of them so far."""
    root, size = law.stance.dof, M.shape[0]
    place = np.full(physics.acceleration.shape[0], -1)
    for i in range(size):
        dof = root + i if i < 6 else drives[law.first + i - 6].dof
        place[dof] = i
    for row in range(place.shape[0]):
        i = place[row]
        if i < 0:
            continue
        h[i] = physics.qfrc_bias[row] - physics.qfrc_passive[row]
        a[i] = physics.acceleration[row]
        first = physics.M_rowadr[row]
        for k in range(first, first + physics.M_rownnz[row]):
            j = place[physics.M_colind[k]]
            if j >= 0:
                M[i, j] = M[j, i] = physics.M[k]


@compiled
def root_target(
    physics: Physics,
    law: CompiledRecords,
    position: Vector,
    velocity: Vector,
    a: Vector,
) -> None:
    """Write errors of the root (MuJoCo's velocity axes), and its target's acceleration.

    The target is that of `StanceLaw.root_target`.
    """
    stance, s = law.stance, law.since
    way, twist, u = np.empty(6), np.empty(6), np.empty(6)
    for i in range(6):
        rate, curve, bend = stance.twist[i], stance.curve[i], stance.bend[i]
        way[i] = stance.behind[i] + s * (rate + s * (0.5 * curve + s / 6.0 * bend))
        twist[i], u[i] = rate + s * (curve + 0.5 * s * bend), curve + s * bend
    start, turned, R = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    inverse, error = np.empty((3, 3)), np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            start[i, j] = law.start[3 * i + j]
            inverse[i, j] = physics.xmat[stance.body, 3 * j + i]
    exp3(way[3], way[4], way[5], turned)
    multiply(start, turned, R)
    multiply(inverse, R, error)
    log3(error, position[3:])
    moved = np.empty(3)
    slide(way, moved)
    rotate(start, moved, position[:3])
    rotate(R, twist[:3], velocity[:3])
    w, v = twist[3:], twist[:3]
    moved[0] = u[0] + w[1] * v[2] - w[2] * v[1]
    moved[1] = u[1] + w[2] * v[0] - w[0] * v[2]
    moved[2] = u[2] + w[0] * v[1] - w[1] * v[0]
    rotate(R, moved, a[:3])
    for i in range(3):
        position[i] += law.start[9 + i] - physics.qpos[stance.qpos + i]
        velocity[3 + i], a[3 + i] = twist[3 + i], u[3 + i]
    for i in range(6):
        velocity[i] -= physics.qvel[stance.dof + i]


@compiled
def slide(way: Vector, out: Vector) -> None:
    """Write the translation of `exp(way)`, linear then angular, shape (3,)."""
    v, w = way[:3], way[3:]
    angle = np.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    if angle < 1e-4:
        b, c = 0.5, 1.0 / 6.0
    else:
        b = (1.0 - np.cos(angle)) / angle**2
        c = (angle - np.sin(angle)) / angle**3
    x = w[1] * v[2] - w[2] * v[1]
    y = w[2] * v[0] - w[0] * v[2]
    z = w[0] * v[1] - w[1] * v[0]
    out[0] = v[0] + b * x + c * (w[1] * z - w[2] * y)
    out[1] = v[1] + b * y + c * (w[2] * x - w[0] * z)
    out[2] = v[2] + b * z + c * (w[0] * y - w[1] * x)


@compiled
def write_feet(
    physics: Physics,
    law: CompiledRecords,
    drives: CompiledRecords,
    J: Matrix,
    moved: Vector,
    is_leg: Flags,
) -> None:
    """Write Jacobian and `J' v + k J v` of all feet, and which joints carry them."""
    stance, n = law.stance, law.last - law.first
    velocity, drift, column = np.empty(6), np.empty(6), np.empty(6)
    row = 0
    for k in range(stance.feet):
        body = int(physics.site_bodyid[stance.site[k]])
        p = physics.site_xpos[stance.site[k]]
        point_motion(physics, body, p, velocity, drift)
        for i in range(stance.rows[k]):
            moved[row + i] = drift[i] + CONTACT_DAMPING * velocity[i]
        dof = int(physics.body_last_dof[body])
        while dof >= 0:
            place = dof - stance.dof if dof - stance.dof < 6 else -1
            for j in range(n):
                if drives[law.first + j].dof == dof:
                    place = 6 + j
                    is_leg[place] = True
            if place >= 0:
                point_column(physics, dof, int(physics.body_rootid[body]), p, column)
                for i in range(stance.rows[k]):
                    J[row + i, place] = column[i]
            dof = int(physics.dof_parentid[dof])
        row += stance.rows[k]


@compiled
def follow_feet(J: Matrix, moved: Vector, is_leg: Flags, a: Vector) -> None:
    """Take `J_l^+ (J a + moved)` off the legs' accelerations; moved is used up."""
    m, size = J.shape
    A = np.empty((m, m))
    for r in range(m):
        for j in range(size):
            moved[r] += J[r, j] * a[j]
    legs_squared(J, is_leg, A)
    factorise(A)
    solve_lower(A, moved)
    solve_upper(A, moved)
    for j in range(6, size):
        if is_leg[j]:
            for r in range(m):
                a[j] -= J[r, j] * moved[r]


@compiled
def legs_squared(J: Matrix, is_leg: Flags, A: Matrix) -> None:
    """Write `J_l J_l^T + eps`, shape (m, m)."""
    m, size = J.shape
    for r in range(m):
        for s in range(r + 1):
            total = SINGULAR**2 if r == s else 0.0
            for j in range(6, size):
                if is_leg[j]:
                    total += J[r, j] * J[s, j]
            A[r, s] = A[s, r] = total


@compiled
def share(  # noqa: C901, loops over feet
    law: CompiledRecords, J: Matrix, still: Vector, swung: Vector
) -> float:
    """Write forces of feet, as `contact_forces` does; return the part of the arms.

    Args:
        law: The law; its forces are written.
        J: Jacobian of all feet.
        still: Wrench on the root that is needed when arms do nothing, shape (6,).
        swung: What they would need on top; becomes all that is needed.
    """
    m, feet, stance = J.shape[0], law.stance.feet, law.stance
    weight, f = np.empty(m), stance.force
    row = 0
    for k in range(feet):
        for i in range(stance.rows[k]):
            weight[row + i] = 1.0 if i < 3 else TORQUE_ARM**2
        row += stance.rows[k]
    P, more, part = np.empty((6, 6)), np.empty(m), 1.0
    invert(J, weight, P)
    press(J, weight, P, still, f)
    press(J, weight, P, swung, more)
    row = 0
    for k in range(feet):
        z = row + 2
        if more[z] < 0.0:
            part = min(part, max((f[z] - LEAST_PRESSURE) / -more[z], 0.0))
        row += stance.rows[k]
    for i in range(6):
        swung[i] = still[i] + part * swung[i]
    press(J, weight, P, swung, f)
    for _ in range(feet):
        worst, least, row = 0, np.inf, 0
        for k in range(feet):
            if f[row + 2] < least:
                worst, least = row, f[row + 2]
            row += stance.rows[k]
        if least >= 0.0:
            break
        row = 0
        for k in range(feet):
            if row == worst:
                for i in range(stance.rows[k]):
                    weight[row + i] = 0.0
            row += stance.rows[k]
        invert(J, weight, P)
        press(J, weight, P, swung, f)
    return part


@compiled
def invert(J: Matrix, weight: Vector, P: Matrix) -> None:
    """Write `(J_r^T W^-1 J_r)^+`, shape (6, 6); weight is the diagonal of W^-1."""
    A = np.zeros((6, 6))
    for i in range(6):
        for j in range(6):
            for r in range(J.shape[0]):
                A[i, j] += J[r, i] * weight[r] * J[r, j]
    pseudo_inverse(A, RANK, P)


@compiled
def press(J: Matrix, weight: Vector, P: Matrix, wrench: Vector, f: Vector) -> None:
    """Write `f = W^-1 J_r P wrench`."""
    x = np.zeros(6)
    for i in range(6):
        for j in range(6):
            x[i] += P[i, j] * wrench[j]
    for r in range(J.shape[0]):
        f[r] = 0.0
        for i in range(6):
            f[r] += weight[r] * J[r, i] * x[i]


@compiled
def give(
    physics: Physics,
    law: CompiledRecords,
    drives: CompiledRecords,
    J: Matrix,
    a: Vector,
) -> None:
    """Hand on accelerations, and what the feet's forces do at the joints."""
    stance, m = law.stance, J.shape[0]
    for i in range(6):
        physics.acceleration[stance.dof + i] = stance.asked[i] = a[i]
        stance.before[i] = physics.qvel[stance.dof + i]
    for j in range(6, J.shape[1]):
        drive = drives[law.first + j - 6]
        physics.acceleration[drive.dof], drive.command = a[j], 0.0
        for r in range(m):
            drive.command += J[r, j] * stance.force[r]


@compiled
def take_contact_forces(
    physics: Physics, laws: CompiledRecords, drives: CompiledRecords
) -> None:
    """Take what feet give off the forces that the joints need."""
    for k in range(laws.shape[0]):
        law = laws[k]
        if law.kind >= _STANCE:
            for j in range(law.first, law.last):
                physics.force[drives[j].dof] -= drives[j].command
