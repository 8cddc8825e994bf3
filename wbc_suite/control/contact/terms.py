"""Terms of the equations of motion of a robot on its feet, out of MuJoCo's arrays."""

import numpy as np

from wbc_suite.compiling import compiled, inner
from wbc_suite.control.contact.arrays import WholeBodyDynamics
from wbc_suite.control.ground.physics import Physics
from wbc_suite.control.ground.rigid_body import (
    point_jacobian_column,
    point_velocity_and_drift,
    rotated,
    rotation,
    write_inertia,
)
from wbc_suite.linear_algebra import copy_vector, dot, solve
from wbc_suite.typing import Vector


@compiled
def write_terms(physics: Physics, body: WholeBodyDynamics) -> None:
    """Write inertia, bias and velocity.

    The velocity is the last one and what the last accelerations add, corrected by a
    part of the distance from the measured velocity: a low-pass filter without lag
    where the robot moves as the law asks.
    """
    terms, dofs, state = body.terms, body.dofs, body.state[0]
    write_inertia(physics, dofs, dofs.shape[0], terms.M)
    for i in range(0 if state.is_free == 1 else 6, dofs.shape[0]):
        measured = physics.qvel[dofs[i]]
        if state.trust < 1.0 and state.ticks > 0:
            predicted = terms.v[i] + state.dt * terms.a[i]
            measured = predicted + state.trust * (measured - predicted)
        terms.v[i] = measured
        terms.h[i] = physics.qfrc_bias[dofs[i]] - physics.qfrc_passive[dofs[i]]


@inner
def measure(physics: Physics, body: WholeBodyDynamics) -> None:
    """Write what the planner reads, and the angular momentum.

    The planner is told where gravity's line through the centre of mass meets the
    ground, so that it walks on slopes as on level ground. Hands of a robot whose root
    is not free are carried by its base, in place of the centre of mass.
    """
    state, terms, measured = body.state[0], body.terms, body.measured
    if state.is_free == 0:
        _measure_base(physics, body)
        return
    size = body.dofs.shape[0]
    state.mass, momentum = terms.M[0, 0], np.empty(6)
    for i in range(6):
        momentum[i] = dot(terms.M[i], terms.v, size)
    com = physics.subtree_com[state.body]
    root = physics.qpos[state.root_qpos : state.root_qpos + 3]
    spin = rotated(rotation(physics.xmat, state.body), momentum[3:])
    x, y, z = com[0] - root[0], com[1] - root[1], com[2] - root[2]
    terms.spin[0] = spin[0] - (y * momentum[2] - z * momentum[1])
    terms.spin[1] = spin[1] - (z * momentum[0] - x * momentum[2])
    terms.spin[2] = spin[2] - (x * momentum[1] - y * momentum[0])
    for i in range(3):
        measured.com[i] = terms.com[i] = com[i]
        if i < 2:
            way = (com[2] - body.gait.state[0].ground) / min(physics.gravity[2], -1.0)
            measured.com[i] -= way * physics.gravity[i]
        measured.com_velocity[i] = momentum[i] / state.mass
    for k in range(body.site.shape[0]):
        R = rotation(physics.site_xmat, body.site[k])
        measured.foot_yaw[k] = np.arctan2(R[1, 0], R[0, 0])
        copy_vector(foot_middle(physics, body, k), measured.foot[k])
        link = int(physics.site_bodyid[body.site[k]])
        point_velocity_and_drift(
            physics, link, measured.foot[k], terms.velocity, terms.drift
        )
        measured.slip[k] = np.sqrt(terms.velocity[0] ** 2 + terms.velocity[1] ** 2)
        measured.rise[k] = terms.velocity[2]


@inner
def _measure_base(physics: Physics, body: WholeBodyDynamics) -> None:
    """Write place and motion of the base as those of the centre of mass and heading."""
    gait, terms, measured = body.gait.state[0], body.terms, body.measured
    link = int(body.state[0].body)
    R, p = rotation(physics.xmat, link), physics.xpos[link]
    point_velocity_and_drift(physics, link, p, terms.velocity, terms.drift)
    gait.yaw, gait.ground = np.arctan2(R[1, 0], R[0, 0]), p[2]
    gait.velocity[2] = terms.velocity[5]
    copy_vector(p, terms.com)
    copy_vector(terms.velocity[:3], measured.com_velocity)


@inner
def foot_middle(physics: Physics, body: WholeBodyDynamics, k: int) -> Vector:
    """Return the middle of a foot's contact, world axes, m, shape (3,)."""
    site, middle = body.site[k], body.middle[k]
    if body.is_sole[k] == 1:
        middle = rotated(rotation(physics.site_xmat, site), middle)
    found = np.empty(3)
    for i in range(3):
        found[i] = physics.site_xpos[site, i] + middle[i]
    return found


@compiled
def write_frame_terms(
    physics: Physics, body: WholeBodyDynamics, link: int, p: Vector
) -> None:
    """Write J, J v and J' v of a point of a link, world axes."""
    terms, column = body.terms, np.empty(6)
    point_velocity_and_drift(physics, link, p, terms.velocity, terms.drift)
    terms.J[:] = 0.0
    dof = int(physics.body_last_dof[link])
    while dof >= 0:
        j = body.place[dof]
        if j >= 0:
            point_jacobian_column(physics, dof, link, p, column)
            for i in range(6):
                terms.J[i, j] = column[i]
        dof = int(physics.dof_parentid[dof])
    for i in range(6):
        terms.velocity[i] = dot(terms.J[i], terms.v, terms.v.shape[0])


@inner
def eliminate_root(body: WholeBodyDynamics) -> None:
    """Write [X | x] with `a_root = X y + x`: the root's six equations of motion.

    Edges of feet that swing count as well; their forces are held at zero.
    """
    terms = body.terms
    edges, n = terms.B.shape[0], body.qpos.shape[0]
    A = terms.M[:6, :6].copy()
    for i in range(6):
        row = terms.root[i]
        for k in range(edges):
            row[k] = terms.B[k, i]
        for j in range(n):
            row[edges + j] = -terms.M[i, 6 + j]
        row[edges + n] = -terms.h[i]
    solve(A, terms.root, 6)
