"""Robots on their feet that track a motion: no foot steps.

The motion is that of whole-body inverse kinematics, or a pose to stay in. Joints follow
the accelerations that their laws ask for; here is what root and centre of mass need.
"""

import numpy as np

from wbc_suite.compiling import inner
from wbc_suite.control.contact.arrays import WholeBodyDynamics
from wbc_suite.control.ground.physics import Physics
from wbc_suite.control.ground.rigid_body import matrix_product, rotated, rotation
from wbc_suite.linear_algebra import cross, dot
from wbc_suite.qp.lie import exp3, log3
from wbc_suite.typing import Matrix, Vector


@inner
def track_motion(physics: Physics, body: WholeBodyDynamics) -> None:
    """Write the accelerations of root and centre of mass that track the motion.

        a = a* + kp e + kd e'

    with errors of the root for its own acceleration, and with those of all joints, by
    the Jacobian of the centre of mass, for that. All feet stand.
    """
    state, terms, tracked, plan = body.state[0], body.terms, body.tracked, body.plan
    size = body.dofs.shape[0]
    tracked.since[0] += state.dt
    error, rate, wanted = np.empty(size), np.empty(size), np.empty(size)
    _write_root_errors(physics, body, error, rate, wanted)
    _write_joint_errors(physics, body, error, rate, wanted)
    for i in range(6):
        kp = state.stiffness[i // 3]
        tracked.wanted[i] = wanted[i] + kp * error[i] + 2.0 * np.sqrt(kp) * rate[i]
    kp = state.stiffness[0]
    for i in range(size):
        wanted[i] += kp * error[i] + 2.0 * np.sqrt(kp) * rate[i]
    for i in range(3):  # the root's linear rows of M are m J of the centre of mass
        force = dot(terms.M[i], wanted, size) + terms.h[i]
        plan.com_acceleration[i] = force / state.mass + physics.gravity[i]
    plan.margin[0] = 1.0


@inner
def _write_root_errors(
    physics: Physics,
    body: WholeBodyDynamics,
    error: Vector,
    rate: Vector,
    acceleration: Vector,
) -> None:
    """Write errors of the root's pose and velocity, and the acceleration it tracks.

    In MuJoCo's axes: linear in the world's, angular in its own.
    """
    # In loops: numba compiles an expression of vectors for 0.1 s.
    state, root, s = body.state[0], body.tracked.root, body.tracked.since[0]
    offset, twist, change = np.empty(6), np.empty(6), np.empty(6)
    for i in range(6):
        v, a, jerk = root[1, i], root[2, i], root[3, i]
        offset[i] = root[0, i] + s * (v + s * (0.5 * a + s / 6.0 * jerk))
        twist[i] = v + s * (a + 0.5 * s * jerk)
        change[i] = a + s * jerk
    R_start, R_turned = np.empty((3, 3)), np.empty((3, 3))
    R_goal, R_error = np.empty((3, 3)), np.empty((3, 3))
    start, measured = body.tracked.start, physics.qpos[state.root_qpos :]
    _write_rotation(start[3:], R_start)
    exp3(offset[3], offset[4], offset[5], R_turned)
    matrix_product(R_start, R_turned, R_goal)
    matrix_product(rotation(physics.xmat, state.body).T, R_goal, R_error)
    log3(R_error, error[3:6])
    way, speed = rotated(R_start, offset), rotated(R_goal, twist)
    turning = cross(twist[3:], twist)
    for i in range(3):
        change[i] += turning[i]
        error[i] = start[i] + way[i] - measured[i]
        rate[i], rate[3 + i] = speed[i], twist[3 + i]
    gained = rotated(R_goal, change)
    for i in range(6):
        rate[i] -= body.terms.v[i]
        acceleration[i] = gained[i] if i < 3 else change[i]


@inner
def _write_joint_errors(
    physics: Physics,
    body: WholeBodyDynamics,
    error: Vector,
    rate: Vector,
    acceleration: Vector,
) -> None:
    """Write errors of joints and their velocities, and the accelerations they track."""
    motion, s = body.tracked.joints, body.tracked.since[0]
    for j in range(body.qpos.shape[0]):
        q, v, a, jerk = motion[0, j], motion[1, j], motion[2, j], motion[3, j]
        q += s * (v + s * (0.5 * a + s / 6.0 * jerk))
        v += s * (a + 0.5 * s * jerk)
        error[6 + j] = q - physics.qpos[body.qpos[j]]
        rate[6 + j] = v - body.terms.v[6 + j]
        acceleration[6 + j] = a + s * jerk


@inner
def _write_rotation(quaternion: Vector, R: Matrix) -> None:
    """Write the rotation of a unit quaternion xyzw, shape (3, 3)."""
    x, y, z, w = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    R[0, 0] = 1.0 - 2.0 * (y * y + z * z)
    R[1, 1] = 1.0 - 2.0 * (x * x + z * z)
    R[2, 2] = 1.0 - 2.0 * (x * x + y * y)
    R[0, 1], R[1, 0] = 2.0 * (x * y - w * z), 2.0 * (x * y + w * z)
    R[0, 2], R[2, 0] = 2.0 * (x * z + w * y), 2.0 * (x * z - w * y)
    R[1, 2], R[2, 1] = 2.0 * (y * z - w * x), 2.0 * (y * z + w * x)
