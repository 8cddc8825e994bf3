"""Equations of motion of a robot with a free root and feet on the ground.

Columns of all matrices: the six of the root in MuJoCo's velocity axes (linear in the
world's, angular in its own), then the joints of a law of feet.
"""

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from wbc_suite.compiling import compiled
from wbc_suite.control.loop.physics import Physics
from wbc_suite.control.loop.records import CompiledRecords, LawKind
from wbc_suite.control.loop.rigid_body import (
    matrix_product,
    point_jacobian_column,
    point_velocity_and_drift,
    rotated,
    rotation,
    write_inertia,
)
from wbc_suite.linear_algebra import cross
from wbc_suite.qp.lie import exp3, log3
from wbc_suite.typing import Indices, Matrix, Vector

Flags: TypeAlias = NDArray[np.bool_]
"""Which columns belong to joints that carry feet."""

CONTACT_DAMPING = 30.0
"""1/s; stops a foot that slips or tips."""

_STANCE, _BALANCE = int(LawKind.STANCE), int(LawKind.BALANCE)

SINGULAR = 0.01
"""m/rad; below it a leg is stretched."""


@dataclass(frozen=True, kw_only=True, slots=True)
class RootMotion:
    """Reference of a free root.

        start * exp(behind + twist s + curve s^2 / 2 + bend s^3 / 6)

    Attributes:
        start: A pose in the world.
        behind: Linear then angular, in the root's own axes, shape (6,).
        twist: The same per second.
        curve: The same per second squared.
        bend: The same per second cubed.
    """

    start: pin.SE3
    behind: Vector
    twist: Vector
    curve: Vector
    bend: Vector

    @classmethod
    def still(cls, pose: pin.SE3) -> "RootMotion":
        """Return a constant reference."""
        behind, twist, curve, bend = np.zeros((4, 6))
        return cls(start=pose, behind=behind, twist=twist, curve=curve, bend=bend)


@compiled
def contact_rows(law: CompiledRecords) -> int:
    """Return the number of rows of the Jacobian of all feet."""
    total = 0
    for k in range(law.stance.feet):
        total += law.stance.rows[k]
    return total


@compiled
def law_dofs(law: CompiledRecords, drives: CompiledRecords) -> Indices:
    """Return the degrees of freedom of root and joints, shape (6 + n,)."""
    n = law.last - law.first
    dofs = np.empty(6 + n, dtype=np.int64)
    for i in range(6):
        dofs[i] = law.stance.dof + i
    for j in range(n):
        dofs[6 + j] = drives[law.first + j].dof
    return dofs


@compiled
def equations_of_motion(
    physics: Physics, dofs: Indices
) -> tuple[Matrix, Vector, Vector]:
    """Return M, h, and the accelerations that other laws ask for."""
    h, a = np.empty(dofs.shape[0]), np.empty(dofs.shape[0])
    for i in range(dofs.shape[0]):
        h[i] = physics.qfrc_bias[dofs[i]] - physics.qfrc_passive[dofs[i]]
        a[i] = physics.acceleration[dofs[i]]
    M = np.empty((dofs.shape[0], dofs.shape[0]))
    write_inertia(physics, dofs, dofs.shape[0], M)
    return M, h, a


@compiled
def root_reference(
    physics: Physics, law: CompiledRecords
) -> tuple[Vector, Vector, Vector]:
    """Return errors of the root's pose and velocity, and the reference acceleration.

    All in MuJoCo's velocity axes, shape (6,) each; see `RootMotion`.
    """
    root, s = law.stance, law.since
    offset = root.behind + s * (
        root.twist + s * (0.5 * root.curve + s / 6.0 * root.bend)
    )
    twist = root.twist + s * (root.curve + 0.5 * s * root.bend)
    twist_rate = root.curve + s * root.bend
    v, w = twist[:3], twist[3:]
    R_start, R_turned = law.start[:9].reshape((3, 3)), np.empty((3, 3))
    R_goal, R_error = np.empty((3, 3)), np.empty((3, 3))
    exp3(offset[3], offset[4], offset[5], R_turned)
    matrix_product(R_start, R_turned, R_goal)
    R_root = rotation(physics.xmat, root.body)
    position, velocity, acceleration = np.empty(6), np.empty(6), np.empty(6)
    matrix_product(R_root.T, R_goal, R_error)
    log3(R_error, position[3:])
    p_goal = law.start[9:] + rotated(R_start, _exp6_translation(offset))
    position[:3] = p_goal - physics.qpos[root.qpos : root.qpos + 3]
    velocity[:3], velocity[3:] = rotated(R_goal, v), w
    velocity -= physics.qvel[root.dof : root.dof + 6]
    acceleration[:3] = rotated(R_goal, twist_rate[:3] + cross(w, v))
    acceleration[3:] = twist_rate[3:]
    return position, velocity, acceleration


@compiled
def _exp6_translation(twist: Vector) -> Vector:
    """Return the translation of `exp(twist)`, linear then angular, shape (3,)."""
    v, w = twist[:3], twist[3:]
    angle = np.sqrt(np.sum(w * w))
    if angle < 1e-4:
        b, c = 0.5, 1.0 / 6.0
    else:
        b = (1.0 - np.cos(angle)) / angle**2
        c = (angle - np.sin(angle)) / angle**3
    side = cross(w, v)
    return v + b * side + c * cross(w, side)


@compiled
def contact_jacobian(
    physics: Physics, law: CompiledRecords, dofs: Indices
) -> tuple[Matrix, Vector, Flags]:
    """Return J of all feet, `J' v + k J v`, and which columns are those of legs.

    Shapes (m, 6 + n), (m,) and (6 + n,); k is `CONTACT_DAMPING`.
    """
    m, size = contact_rows(law), dofs.shape[0]
    J, drift, is_leg = np.zeros((m, size)), np.empty(m), np.zeros(size, np.bool_)
    place, column = np.full(physics.qvel.shape[0], -1), np.empty(6)
    velocity, rate = np.empty(6), np.empty(6)
    for i in range(size):
        place[dofs[i]] = i
    row = 0
    for k in range(law.stance.feet):
        body = int(physics.site_bodyid[law.stance.site[k]])
        p = physics.site_xpos[law.stance.site[k]]
        point_velocity_and_drift(physics, body, p, velocity, rate)
        for i in range(law.stance.rows[k]):
            drift[row + i] = rate[i] + CONTACT_DAMPING * velocity[i]
        dof = int(physics.body_last_dof[body])
        while dof >= 0:
            if place[dof] >= 0:
                is_leg[place[dof]] = place[dof] >= 6
                point_jacobian_column(physics, dof, body, p, column)
                for i in range(law.stance.rows[k]):
                    J[row + i, place[dof]] = column[i]
            dof = int(physics.dof_parentid[dof])
        row += law.stance.rows[k]
    return J, drift, is_leg


@compiled
def leg_gram(J: Matrix, is_leg: Flags) -> Matrix:
    """Return `J_l J_l^T + eps`, shape (m, m), with the columns of legs."""
    m, size = J.shape
    A = np.empty((m, m))
    for r in range(m):
        for s in range(r + 1):
            total = SINGULAR**2 if r == s else 0.0
            for j in range(6, size):
                if is_leg[j]:
                    total += J[r, j] * J[s, j]
            A[r, s] = A[s, r] = total
    return A


@compiled
def write_motion(
    physics: Physics,
    law: CompiledRecords,
    drives: CompiledRecords,
    J: Matrix,
    a: Vector,
    f: Vector,
) -> None:
    """Write desired accelerations, contact forces, and their torques at the joints."""
    root = law.stance
    for i in range(6):
        physics.acceleration[root.dof + i] = root.desired[i] = a[i]
        root.last_velocity[i] = physics.qvel[root.dof + i]
    for r in range(f.shape[0]):
        root.force[r] = f[r]
    for j in range(6, J.shape[1]):
        drive = drives[law.first + j - 6]
        physics.acceleration[drive.dof], drive.command = a[j], 0.0
        for r in range(f.shape[0]):
            drive.command += J[r, j] * f[r]


@compiled
def is_of_feet(law: CompiledRecords) -> bool:
    """Return whether a law plans contact forces."""
    return law.kind == _STANCE or law.kind == _BALANCE


@compiled
def subtract_contact_forces(
    physics: Physics, laws: CompiledRecords, drives: CompiledRecords, bodies: Any
) -> None:
    """Subtract `J^T f` of all feet from the forces that the joints need."""
    if bodies is not None:
        for body in bodies:
            for j in range(body.torque.shape[0]):
                physics.force[body.dofs[6 + j]] -= body.torque[j]
    for k in range(laws.shape[0]):
        if is_of_feet(laws[k]):
            for j in range(laws[k].first, laws[k].last):
                physics.force[drives[j].dof] -= drives[j].command
