"""Joint torques of a motion, compiled; `pin.rnea` is the reference."""

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.compiling import compiled_inline, inner, struct
from wbc_suite.kinematics.forward import RobotArrays, compute_joint_poses
from wbc_suite.typing import Matrix, Vector


@struct
class InertiaArrays(NamedTuple):
    """Inertia of a robot's links, with scratch for `compute_torques`.

    Spatial vectors are linear, then angular, with world axes at the world's origin.

    Attributes:
        inertia: Inertia of each joint's links about their centre of mass, in the
            joint's axes, kg m^2, shape (njoints, 3, 3).
        armature: Inertia of the motors' rotors as the joints feel it, shape (nv,).
        velocity: Spatial velocity of each joint, shape (njoints, 6).
        acceleration: Its rate, less that of free fall, shape (njoints, 6).
        force: Spatial force on each joint's subtree, shape (njoints, 6).
    """

    inertia: Matrix
    armature: Vector
    velocity: Matrix
    acceleration: Matrix
    force: Matrix


def inertia_arrays(model: pin.Model) -> InertiaArrays:
    """Return the arrays of a model."""
    count = int(model.njoints)
    acceleration = np.zeros((count, 6))
    acceleration[0] = -model.gravity.vector
    return InertiaArrays(
        inertia=np.array([body.inertia for body in model.inertias]),
        armature=np.array(model.armature),
        velocity=np.zeros((count, 6)),
        acceleration=acceleration,
        force=np.zeros((count, 6)),
    )


@compiled_inline
def compute_torques(
    robot: RobotArrays, inertias: InertiaArrays, v: Vector, a: Vector, tau: Vector
) -> None:
    """Write `tau = M a + h` by the recursive Newton-Euler algorithm.

    With the columns S of the joint Jacobians, each constant in its joint's axes,

        v_j = v_parent + S qd,    a_j = a_parent + S qdd + v_j x S qd.

    v, a and the output tau have the shape (nv,).

    Source: Featherstone (2008), "Rigid Body Dynamics Algorithms", section 5.3.
    """
    compute_joint_poses(robot)
    joints, columns, count = robot.joints, robot.jacobian, robot.joints.shape[0]
    velocities, rates = inertias.velocity, inertias.acceleration
    forces = inertias.force
    for j in range(1, count):
        velocity, rate, joint = velocities[j], rates[j], joints[j]
        first, end = joint.v_start, joint.v_start + joint.v_count
        for i in range(6):
            velocity[i] = velocities[joint.parent, i]
            rate[i] = rates[joint.parent, i]
        for k in range(first, end):
            for i in range(6):
                velocity[i] += columns[k, i] * v[k]
                rate[i] += columns[k, i] * a[k]
        for k in range(first, end):
            _add_rate_of_column(velocity, columns[k], float(v[k]), rate)
        _write_link_force(
            robot.pose[j],
            joint.mass,
            joint.lever,
            inertias.inertia[j],
            velocity,
            rate,
            forces[j],
        )
    for j in range(count - 1, 0, -1):
        force, joint = forces[j], joints[j]
        for k in range(joint.v_start, joint.v_start + joint.v_count):
            tau[k] = inertias.armature[k] * a[k]
            for i in range(6):
                tau[k] += columns[k, i] * force[i]
        for i in range(6):
            forces[joint.parent, i] += force[i]


@inner
def _add_rate_of_column(
    velocity: Vector, column: Vector, speed: float, rate: Vector
) -> None:
    """Add `v x S qd` to an acceleration, the cross product of spatial motions."""
    v_x, v_y, v_z, w_x, w_y, w_z = velocity
    s_x, s_y, s_z, r_x, r_y, r_z = column
    rate[0] += speed * (w_y * s_z - w_z * s_y + v_y * r_z - v_z * r_y)
    rate[1] += speed * (w_z * s_x - w_x * s_z + v_z * r_x - v_x * r_z)
    rate[2] += speed * (w_x * s_y - w_y * s_x + v_x * r_y - v_y * r_x)
    rate[3] += speed * (w_y * r_z - w_z * r_y)
    rate[4] += speed * (w_z * r_x - w_x * r_z)
    rate[5] += speed * (w_x * r_y - w_y * r_x)


@inner
def _write_link_force(
    T: Vector,
    mass: float,
    lever: Vector,
    inertia: Matrix,
    velocity: Vector,
    rate: Vector,
    force: Vector,
) -> None:
    """Write the spatial force that moves one link.

    At its centre c: `f = m c''` and `n = I w' + w x I w`; about the origin `n + c x f`.
    """
    c, acceleration = np.empty(3), np.empty(3)
    local, turn = np.empty(3), np.empty(3)  # w and w' in the joint's axes
    for i in range(3):
        c[i] = T[9 + i]
        local[i], turn[i] = 0.0, 0.0
        for j in range(3):
            c[i] += T[3 * j + i] * lever[j]
            local[i] += T[3 * i + j] * velocity[3 + j]
            turn[i] += T[3 * i + j] * rate[3 + j]
    w, alpha, speed = velocity[3:], rate[3:], np.empty(3)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        speed[i] = velocity[i] + w[j] * c[k] - w[k] * c[j]
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        acceleration[i] = rate[i] + alpha[j] * c[k] - alpha[k] * c[j]
        acceleration[i] += w[j] * speed[k] - w[k] * speed[j]
        force[i] = mass * acceleration[i]
    momentum, moment = np.empty(3), np.empty(3)
    for i in range(3):
        momentum[i], moment[i] = 0.0, 0.0
        for j in range(3):
            momentum[i] += inertia[i, j] * local[j]
            moment[i] += inertia[i, j] * turn[j]
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        turn[i] = moment[i] + local[j] * momentum[k] - local[k] * momentum[j]
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        force[3 + i] = c[j] * force[k] - c[k] * force[j]
        for n in range(3):
            force[3 + i] += T[3 * n + i] * turn[n]
