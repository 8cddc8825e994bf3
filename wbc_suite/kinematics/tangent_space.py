"""Steps between configurations: `q (+) dq`, and `q (-) q_0`.

Tests hold the kernels to Pinocchio: `pin.integrate` and `pin.difference`.
"""

import numpy as np

from wbc_suite.compiling import compiled, inner
from wbc_suite.kinematics.forward import JointKind, RobotArrays
from wbc_suite.typing import Vector


@compiled
def integrate_joints(robot: RobotArrays, dq: Vector) -> None:
    """Move the robot by a step in the tangent space, shape (nv,)."""
    integrate(robot, robot.q, dq)
    robot.is_current[0] = robot.is_current[1] = robot.is_current[2] = 0


@compiled
def integrate(robot: RobotArrays, q: Vector, dq: Vector) -> None:
    """Move q in place: `q (+) dq`; the robot has no joint of kind `OTHER`."""
    joints = robot.joints
    for j in range(1, joints.shape[0]):
        k, i = joints[j].q_start, joints[j].v_start
        if joints[j].kind == JointKind.FREE:
            _integrate_free(q[k:], dq[i:])
        else:
            q[k] += dq[i]


@compiled
def difference(robot: RobotArrays, origin: Vector, q: Vector, out: Vector) -> None:
    """Write `q (-) origin`, shape (nv,); the robot has no joint of kind `OTHER`."""
    joints = robot.joints
    for j in range(1, joints.shape[0]):
        k, i = joints[j].q_start, joints[j].v_start
        if joints[j].kind == JointKind.FREE:
            _free_difference(origin[k:], q[k:], out[i:])
        else:
            out[i] = q[k] - origin[k]


@inner
def _free_difference(origin: Vector, q: Vector, out: Vector) -> None:
    """Write `log6(T_origin^-1 T_q)`; positions and quaternions x y z w.

    Source: Lynch and Park (2017), "Modern Robotics", equation 3.92.
    """
    ax, ay, az, aw = -origin[3], -origin[4], -origin[5], origin[6]
    bx, by, bz, bw = q[3], q[4], q[5], q[6]
    # Translation in the axes of the origin: p = R^T (q - origin)
    d_x, d_y, d_z = q[0] - origin[0], q[1] - origin[1], q[2] - origin[2]
    t_x, t_y = 2.0 * (ay * d_z - az * d_y), 2.0 * (az * d_x - ax * d_z)
    t_z = 2.0 * (ax * d_y - ay * d_x)
    p_x = d_x + aw * t_x + ay * t_z - az * t_y
    p_y = d_y + aw * t_y + az * t_x - ax * t_z
    p_z = d_z + aw * t_z + ax * t_y - ay * t_x
    # Rotation vector of conj(origin) q
    x = aw * bx + ax * bw + ay * bz - az * by
    y = aw * by - ax * bz + ay * bw + az * bx
    z = aw * bz + ax * by - ay * bx + az * bw
    w = aw * bw - ax * bx - ay * by - az * bz
    if w < 0.0:
        x, y, z, w = -x, -y, -z, -w
    sine = np.sqrt(x * x + y * y + z * z)
    angle = 2.0 * np.arctan2(sine, w)
    scale = angle / sine if sine > 1e-9 else 2.0
    r_x, r_y, r_z = scale * x, scale * y, scale * z
    if angle < 1e-4:  # series, exact to 1e-16
        b = 1.0 / 12.0
    else:
        b = 1.0 / angle**2 - 0.5 / (angle * np.tan(0.5 * angle))
    # V^-1 p = p - (r x p) / 2 + b r x (r x p)
    c_x, c_y, c_z = r_y * p_z - r_z * p_y, r_z * p_x - r_x * p_z, r_x * p_y - r_y * p_x
    out[0] = p_x - 0.5 * c_x + b * (r_y * c_z - r_z * c_y)
    out[1] = p_y - 0.5 * c_y + b * (r_z * c_x - r_x * c_z)
    out[2] = p_z - 0.5 * c_z + b * (r_x * c_y - r_y * c_x)
    out[3], out[4], out[5] = r_x, r_y, r_z


@inner
def _integrate_free(q: Vector, dq: Vector) -> None:
    """Move position and quaternion x y z w by `exp6(dq)`, in the body's axes.

    Source: Lynch and Park (2017), "Modern Robotics", equation 3.88.
    """
    v, w = dq[:3], dq[3:6]
    square = w[0] * w[0] + w[1] * w[1] + w[2] * w[2]
    angle = np.sqrt(square)
    if angle < 1e-4:  # series, exact to 1e-16
        b, c, s = 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0, 0.5 - square / 48.0
    else:
        b = 2.0 * (np.sin(0.5 * angle) / angle) ** 2
        c = (angle - np.sin(angle)) / (square * angle)
        s = np.sin(0.5 * angle) / angle
    cross_x, cross_y = w[1] * v[2] - w[2] * v[1], w[2] * v[0] - w[0] * v[2]
    cross_z = w[0] * v[1] - w[1] * v[0]
    along = w[0] * v[0] + w[1] * v[1] + w[2] * v[2]
    p_x = v[0] + b * cross_x + c * (w[0] * along - square * v[0])
    p_y = v[1] + b * cross_y + c * (w[1] * along - square * v[1])
    p_z = v[2] + b * cross_z + c * (w[2] * along - square * v[2])
    x, y, z, r = q[3], q[4], q[5], q[6]
    # p = R(quaternion) p_local
    t_x, t_y = 2.0 * (y * p_z - z * p_y), 2.0 * (z * p_x - x * p_z)
    t_z = 2.0 * (x * p_y - y * p_x)
    q[0] += p_x + r * t_x + y * t_z - z * t_y
    q[1] += p_y + r * t_y + z * t_x - x * t_z
    q[2] += p_z + r * t_z + x * t_y - y * t_x
    i, j, k, u = s * w[0], s * w[1], s * w[2], np.cos(0.5 * angle)
    q[3] = r * i + x * u + y * k - z * j
    q[4] = r * j - x * k + y * u + z * i
    q[5] = r * k + x * j - y * i + z * u
    q[6] = r * u - x * i - y * j - z * k
    norm = np.sqrt(q[3] ** 2 + q[4] ** 2 + q[5] ** 2 + q[6] ** 2)
    for n in range(3, 7):  # of both signs, the one nearer to the quaternion before
        q[n] /= norm if u >= 0.0 else -norm
