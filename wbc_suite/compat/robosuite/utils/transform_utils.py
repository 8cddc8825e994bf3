"""Rotations, poses and twists; quaternions are x y z w.

Rotations are those of SciPy and Pinocchio.
"""

from typing import Any

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation, Slerp

from wbc_suite.typing import Array, Vector

PI = np.pi
EPS = np.finfo(float).eps * 4.0


def _positive(quat: Any) -> Vector:
    """Return the sign of a quaternion x y z w with w >= 0."""
    quat = np.asarray(quat, dtype=np.float64)
    return -quat if quat[3] < 0.0 else quat


def convert_quat(q: Any, to: str = "xyzw") -> Vector:
    """Return a quaternion in the order `xyzw`, from `wxyz`, or the other way round."""
    if to not in ("xyzw", "wxyz"):
        raise ValueError("convert_quat: `to` is 'xyzw' or 'wxyz'.")
    return np.asarray(q)[[1, 2, 3, 0] if to == "xyzw" else [3, 0, 1, 2]]


def quat_multiply(quaternion1: Any, quaternion0: Any) -> Array:
    """Return the product: the rotation 0, then the rotation 1."""
    (a, b, c, w), (x, y, z, v) = quaternion1, quaternion0
    product = (
        w * x + a * v + b * z - c * y,
        w * y + b * v + c * x - a * z,
        w * z + c * v + a * y - b * x,
        w * v - a * x - b * y - c * z,
    )
    return np.array(product, dtype=np.float32)


def quat_conjugate(quaternion: Any) -> Array:
    """Return the conjugate."""
    x, y, z, w = quaternion
    return np.array((-x, -y, -z, w), dtype=np.float32)


def quat_inverse(quaternion: Any) -> Array:
    """Return the inverse."""
    return quat_conjugate(quaternion) / np.dot(quaternion, quaternion)


def quat_distance(quaternion1: Any, quaternion0: Any) -> Array:
    """Return the rotation from 0 to 1."""
    return quat_multiply(quaternion1, quat_inverse(quaternion0))


def quat_slerp(
    quat0: Any, quat1: Any, fraction: float, shortestpath: bool = True
) -> Vector:
    """Return the rotation at a fraction of the way from 0 to 1."""
    q0 = np.asarray(quat0) / np.linalg.norm(quat0)
    q1 = np.asarray(quat1) / np.linalg.norm(quat1)
    if fraction <= 0.0:
        return q0
    if fraction >= 1.0:
        return q1
    found = Slerp([0.0, 1.0], Rotation.from_quat([q0, q1]))(fraction).as_quat()
    return -found if np.dot(found, q0) < 0.0 and shortestpath else found


def random_quat(rand: Any = None) -> Vector:
    """Return a rotation drawn uniformly; `rand` are three numbers in [0, 1)."""
    u, v, w = np.random.rand(3) if rand is None else rand  # noqa: NPY002 - robosuite's users seed NumPy's global generator
    a, b = np.sqrt(1.0 - u), np.sqrt(u)
    t1, t2 = 2 * PI * v, 2 * PI * w
    return np.array((np.sin(t1) * a, np.cos(t1) * a, np.sin(t2) * b, np.cos(t2) * b))


def random_axis_angle(
    angle_limit: float | None = None, random_state: Any = None
) -> tuple[Vector, float]:
    """Return a random unit axis and an angle below the limit, rad."""
    rng = np.random if random_state is None else random_state
    axis = rng.normal(size=3)
    limit = 2.0 * PI if angle_limit is None else angle_limit
    return axis / np.linalg.norm(axis), float(rng.uniform(high=limit))


def vec(values: Any) -> Array:
    """Return values as a float32 vector."""
    return np.array(values, dtype=np.float32)


def mat4(array: Any) -> Array:
    """Return 16 values as a float32 matrix, shape (4, 4)."""
    return np.array(array, dtype=np.float32).reshape(4, 4)


def mat2pose(hmat: Any) -> tuple[Vector, Vector]:
    """Return position and quaternion of a homogeneous matrix."""
    return hmat[:3, 3], mat2quat(hmat[:3, :3])


def mat2quat(rmat: Any) -> Vector:
    """Return the quaternion of a rotation matrix, w >= 0."""
    return _positive(Rotation.from_matrix(np.asarray(rmat)[:3, :3]).as_quat())


def euler2mat(euler: Any) -> Array:
    """Return the rotation matrix of roll, pitch, yaw, about the fixed x, y, z."""
    return Rotation.from_euler("xyz", np.asarray(euler, np.float64)).as_matrix()


def mat2euler(rmat: Any, axes: str = "sxyz") -> Array:
    """Return Euler angles; `axes` is `s` (fixed) or `r` (moving), then three axes."""
    order: Any = axes[1:] if axes[0] == "s" else axes[1:].upper()
    found = Rotation.from_matrix(np.asarray(rmat)[:3, :3]).as_euler(order)
    return vec(found)


def pose2mat(pose: Any) -> Array:
    """Return the homogeneous matrix of a position and a quaternion."""
    return make_pose(pose[0], quat2mat(pose[1]))


def quat2mat(quaternion: Any) -> Array:
    """Return the rotation matrix of a quaternion."""
    return Rotation.from_quat(np.asarray(quaternion, np.float64)).as_matrix()


def quat2axisangle(quat: Any) -> Vector:
    """Return axis times angle, rad."""
    quat = np.asarray(quat, np.float64)
    w = float(np.clip(quat[3], -1.0, 1.0))
    sine = np.sqrt(1.0 - w * w)
    if np.isclose(sine, 0.0):
        return np.zeros(3)
    return quat[:3] * 2.0 * np.arccos(w) / sine


def axisangle2quat(vec: Any) -> Vector:
    """Return the quaternion of axis times angle, rad."""
    return Rotation.from_rotvec(np.asarray(vec, np.float64)).as_quat()


def pose_in_A_to_pose_in_B(pose_A: Any, pose_A_in_B: Any) -> Array:
    """Return in B the pose given in A; homogeneous matrices."""
    return pose_A_in_B.dot(pose_A)


def pose_inv(pose: Any) -> Array:
    """Return the inverse of a homogeneous matrix."""
    return make_pose(-pose[:3, :3].T @ pose[:3, 3], pose[:3, :3].T)


def vel_in_A_to_vel_in_B(vel_A: Any, ang_vel_A: Any, pose_A_in_B: Any) -> Any:
    """Return linear and angular velocity in B of a twist given in A."""
    R, p = pose_A_in_B[:3, :3], pose_A_in_B[:3, 3]
    turn = R @ ang_vel_A
    return R @ vel_A + np.cross(p, turn), turn


def force_in_A_to_force_in_B(force_A: Any, torque_A: Any, pose_A_in_B: Any) -> Any:
    """Return force and torque in B of a wrench given in A."""
    R, p = pose_A_in_B[:3, :3], pose_A_in_B[:3, 3]
    return R.T @ force_A, R.T @ (np.asarray(torque_A) + np.cross(force_A, p))


def rotation_matrix(angle: float, direction: Any, point: Any = None) -> Array:
    """Return the homogeneous matrix of a turn about an axis through a point."""
    R = Rotation.from_rotvec(angle * unit_vector(np.asarray(direction)[:3])).as_matrix()
    p = np.zeros(3) if point is None else np.asarray(point)[:3]
    return make_pose(p - R @ p, R).astype(np.float32)


def clip_translation(dpos: Any, limit: float) -> tuple[Any, bool]:
    """Return a step of at most a length, and whether it was shortened."""
    length = np.linalg.norm(dpos)
    return (dpos * limit / length, True) if length > limit else (dpos, False)


def clip_rotation(quat: Any, limit: float) -> tuple[Vector, bool]:
    """Return a turn of at most an angle, and whether it was shortened."""
    turn = Rotation.from_quat(quat)
    angle = turn.magnitude()
    if angle <= limit:
        return np.asarray(quat), False
    return Rotation.from_rotvec(turn.as_rotvec() * limit / angle).as_quat(), True


def make_pose(translation: Any, rotation: Any) -> Array:
    """Return a homogeneous matrix."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, translation
    return pose


def unit_vector(data: Any, axis: int | None = None, out: Any = None) -> Any:
    """Return data divided by its norm."""
    data = np.asarray(data, np.float64)
    norm = np.linalg.norm(data, axis=axis, keepdims=axis is not None)
    if out is None:
        return data / norm
    out[:] = data / norm
    return None


def get_orientation_error(target_orn: Any, current_orn: Any) -> Vector:
    """Return twice the vector part of the rotation from current to target."""
    q = pin.Quaternion(*np.asarray(target_orn)[[3, 0, 1, 2]])
    p = pin.Quaternion(*np.asarray(current_orn)[[3, 0, 1, 2]])
    error = (q * p.conjugate()).coeffs()
    return error[:3] * np.sign(error[3])


def get_pose_error(target_pose: Any, current_pose: Any) -> Vector:
    """Return the differences of position and orientation, shape (6,)."""
    now, goal = current_pose[:3, :3], target_pose[:3, :3]
    turn = 0.5 * sum(np.cross(now[:, k], goal[:, k]) for k in range(3))
    return np.concatenate([target_pose[:3, 3] - current_pose[:3, 3], turn])


matrix_inverse = np.linalg.inv


def rotate_2d_point(input: Any, rot: float) -> Vector:
    """Return a point of the plane turned by an angle, rad."""
    x, y = input
    c, s = np.cos(rot), np.sin(rot)
    return np.array([x * c - y * s, x * s + y * c])
