"""The compiled law in operational space; `OscLaw` is its readable form."""

import numpy as np

from wbc_suite.compiling import compiled_inner, inlined
from wbc_suite.control.loop.factors import (
    cholesky,
    least_eigenvalue,
    orthonormalise,
    shortest,
    solve_lower,
    solve_upper,
)
from wbc_suite.control.loop.motion import (
    carries,
    multiply,
    point_column,
    point_motion,
    rotate,
)
from wbc_suite.control.loop.physics import (
    CHANGE,
    COLUMN,
    INERTIA,
    PLACE,
    PULL,
    REST,
    ROTATIONS,
    VECTORS,
    WANTED,
    Physics,
)
from wbc_suite.control.loop.straight import keep_straight
from wbc_suite.control.loop.table import CompiledRecords
from wbc_suite.control.loop.window import keep_window
from wbc_suite.qp.lie import exp3, log3, saturate
from wbc_suite.typing import Matrix, Vector

__all__ = ["LEAST_DAMPING", "SINGULAR", "osc_law"]

SINGULAR = 1e-4
"""1/kg or 1/(kg m^2); directions in which the hand is less mobile are damped."""

LEAST_DAMPING = 1e-9
"""1/s; speeds that stiffness asks for are kp / kd."""


@compiled_inner
def osc_law(physics: Physics, law: CompiledRecords, drives: CompiledRecords) -> None:
    """Write the accelerations of `OscLaw`, within its limits."""
    n, work = law.last - law.first, physics.work
    J, Q, C, L = work[0:6], work[6:12], work[12:18], work[INERTIA : INERTIA + n]
    wanted, pull, p = work[WANTED], work[PULL], work[PLACE]
    rest, change = work[REST], work[CHANGE]
    task_acceleration(physics, law, p, wanted, pull)
    number_joints(physics, law, drives)
    site_jacobian(physics, law, p, J, wanted)
    inertia_block(physics, law, drives, L)
    cholesky(L, n)
    for j in range(n):
        drive = drives[law.first + j]
        error = drive.position - physics.qpos[drive.qpos]
        rest[j] = drive.kp * error - drive.kd * physics.qvel[drive.dof]
        for i in range(6):
            wanted[i] -= J[i, j] * rest[j]
    for i in range(6):  # J becomes Y = J L^-T
        solve_lower(L, J[i], n)
    columns = factorise(J, n, C, Q, change)
    solve_lower(C, wanted, 6)
    shortest(Q, columns, wanted, change)
    solve_upper(L, change, n)
    for j in range(n):
        physics.acceleration[drives[law.first + j].dof] = rest[j] + change[j]
    if law.straight > 0.0:
        keep_straight(physics, law, drives, L, Q, C, pull)
    else:
        keep_window(physics, law, drives)


@inlined
def factorise(Y: Matrix, n: int, C: Matrix, Q: Matrix, scratch: Vector) -> int:
    """Write the factors of `OscLaw.factors`; return how many columns Q has."""
    for i in range(6):
        for j in range(n + 6):
            Q[i, j] = Y[i, j] if j < n else 0.0
    orthonormalise(Q, n, C)
    missing = SINGULAR - least_eigenvalue(C, scratch)
    if missing <= 0.0:
        return n
    for i in range(6):
        for j in range(n + 6):
            Q[i, j] = Y[i, j] if j < n else 0.0
        Q[i, n + i] = np.sqrt(missing)
    orthonormalise(Q, n + 6, C)
    return n + 6


@inlined
def number_joints(
    physics: Physics, law: CompiledRecords, drives: CompiledRecords
) -> None:
    """Write the slots of a law's joints."""
    physics.slots[:] = -1
    for j in range(law.first, law.last):
        physics.slots[drives[j].dof] = j - law.first


@inlined
def site_jacobian(
    physics: Physics, law: CompiledRecords, p: Vector, J: Matrix, wanted: Vector
) -> None:
    """Write the site's Jacobian; take what other joints give it off the wanted."""
    for i in range(6):
        for j in range(law.last - law.first):
            J[i, j] = 0.0
    body = int(physics.site_bodyid[law.site])
    root = int(physics.body_rootid[body])
    column = physics.work[COLUMN]
    dof = int(physics.body_last_dof[body])
    while dof >= 0:
        place = physics.slots[dof]
        if place >= 0:
            point_column(physics, dof, root, p, column)
            for i in range(6):
                J[i, place] = column[i]
        elif physics.acceleration[dof] != 0.0 and not carries(
            physics, dof, law.reference
        ):
            point_column(physics, dof, root, p, column)
            for i in range(6):
                wanted[i] -= column[i] * physics.acceleration[dof]
        dof = int(physics.dof_parentid[dof])


@inlined
def task_acceleration(
    physics: Physics,
    law: CompiledRecords,
    p: Vector,
    wanted: Vector,
    pull: Vector,
) -> None:
    """Write `x'' - J' v`, the pull of x'' to the goal, and the site's position p."""
    since = min(law.since, law.duration)
    phase = since / law.duration if law.duration > 0.0 else 1.0
    moving = 1.0 / law.duration if 0.0 < law.duration >= law.since else 0.0
    body, site = law.reference, law.site
    work, k = physics.work, ROTATIONS
    R_bs, R_wb, turned = work[k : k + 3], work[k + 3 : k + 6], work[k + 6 : k + 9]
    R_bg, R_wd = work[k + 9 : k + 12], work[k + 12 : k + 15]
    R_sw, E = work[k + 15 : k + 18], work[k + 18 : k + 21]
    k = VECTORS
    place, step, turn, goal = work[k], work[k + 1], work[k + 2], work[k + 3]
    error, velocity, drift = work[k + 4], work[k + 5], work[k + 6]
    own, twist = work[k + 7], work[k + 8]
    for i in range(3):
        for j in range(3):
            R_bs[i, j] = law.start[3 * i + j]  # where the target started
            R_wb[i, j] = physics.xmat[body, 3 * i + j]
            R_sw[j, i] = physics.site_xmat[site, 3 * i + j]
    spin = law.turn
    exp3(phase * spin[0], phase * spin[1], phase * spin[2], turned)
    multiply(R_bs, turned, R_bg)
    multiply(R_wb, R_bg, R_wd)
    for i in range(3):
        place[i] = law.start[9 + i] + phase * law.shift[i]
    rotate(R_wb, place, goal)
    rotate(R_wb, law.shift, step)
    rotate(R_bs, law.turn, place)
    rotate(R_wb, place, turn)
    multiply(R_wd, R_sw, E)
    log3(E, error[3:])
    for i in range(3):
        goal[i] += physics.xpos[body, i]
        p[i] = physics.site_xpos[site, i]
        error[i] = goal[i] - p[i]
    point_motion(physics, body, goal, velocity, drift)
    for i in range(3):
        twist[i], twist[3 + i] = moving * step[i], moving * turn[i]
        wanted[i], wanted[3 + i] = drift[i], drift[3 + i]
    point_motion(physics, int(physics.site_bodyid[site]), p, own, drift)
    for i in range(6):
        velocity[i] -= own[i]
        wanted[i] -= drift[i]
    gains(law, R_wb, error, twist, velocity, wanted, pull, place)


@inlined
def gains(
    law: CompiledRecords,
    R_wb: Matrix,
    error: Vector,
    twist: Vector,
    velocity: Vector,
    wanted: Vector,
    pull: Vector,
    u: Vector,
) -> None:
    """Write `kd u`, and add x'' = `kd (u - v)`, gains along the reference's axes.

    The speed `u = kp / kd e + v*` is limited. Twist is that of the target in the
    reference, velocity that of the reference less the site's; u is scratch.
    """
    for half in range(2):
        f = 3 * half
        for i in range(3):
            rate, u[i] = law.kp[f + i] / max(law.kd[f + i], LEAST_DAMPING), 0.0
            for k in range(3):
                u[i] += R_wb[k, i] * (rate * error[f + k] + twist[f + k])
        saturate(u, law.speed[half])
        for i in range(3):
            pull[f + i] = 0.0
        for k in range(3):
            kd, left = max(law.kd[f + k], LEAST_DAMPING), u[k]
            for i in range(3):
                left += R_wb[i, k] * velocity[f + i]
            for i in range(3):
                pull[f + i] += R_wb[i, k] * kd * u[k]
                wanted[f + i] += R_wb[i, k] * kd * left


@inlined
def inertia_block(
    physics: Physics, law: CompiledRecords, drives: CompiledRecords, M: Matrix
) -> None:
    """Write the lower triangle of the inertia of a law's joints, shape (n, n).

    MuJoCo keeps the lower triangle, row by row; a column is an ancestor of its row.
    """
    n = law.last - law.first
    for i in range(n):
        for j in range(i + 1):
            M[i, j] = 0.0
    for i in range(n):
        row = drives[law.first + i].dof
        first = physics.M_rowadr[row]
        for k in range(first, first + physics.M_rownnz[row]):
            j = physics.slots[physics.M_colind[k]]
            if j >= 0:
                M[max(i, j), min(i, j)] = physics.M[k]
