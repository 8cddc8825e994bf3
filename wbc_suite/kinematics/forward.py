"""Forward kinematics, joint Jacobians and centre of mass, compiled.

Tests hold these kernels to Pinocchio at 1e-12.
"""

from enum import IntEnum
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.compiling import compiled, inner, struct
from wbc_suite.typing import Indices, Matrix, Vector


@struct
class RobotArrays(NamedTuple):
    """The joints of a robot, the universe first, and where q places them.

    Poses have the rotation column by column, then the position. Jacobians are
    transposed, with world axes at the world's origin.

    Attributes:
        q: Joint positions, shape (nq,).
        is_current: Whether joint poses with Jacobians, the centre of mass, and
            Pinocchio's data belong to the present q, shape (3,).
        kind: `JointKind` of each joint; then its parent, first position, first velocity
            and number of velocities.
        mount: Pose of each joint in its parent at q = 0, shape (njoints, 12).
        axis: Axis of each joint, shape (njoints, 3).
        mass: Mass that each joint carries itself, kg.
        lever: Its centre of mass in the joint, m, shape (njoints, 3).
        pose: Pose of each joint in the world, shape (njoints, 12).
        jacobian: Joint Jacobians, shape (nv, 6).
        com: Centre of mass, m, shape (3,).
        com_jacobian: Its Jacobian, shape (nv, 3).
    """

    q: Vector
    is_current: Indices
    kind: Indices
    parent: Indices
    q_start: Indices
    v_start: Indices
    v_count: Indices
    mount: Matrix
    axis: Matrix
    mass: Vector
    lever: Matrix
    pose: Matrix
    jacobian: Matrix
    com: Vector
    com_jacobian: Matrix


class JointKind(IntEnum):
    """How a joint moves: about or along an axis of its mount, or freely."""

    OTHER = -1
    """Unknown to the kernels; Pinocchio computes models with such joints."""
    REVOLUTE_X = 0
    REVOLUTE_Y = 1
    REVOLUTE_Z = 2
    REVOLUTE = 3
    PRISMATIC = 4
    FREE = 5


_KINDS = {
    "RX": (JointKind.REVOLUTE_X, (1.0, 0.0, 0.0)),
    "RY": (JointKind.REVOLUTE_Y, (0.0, 1.0, 0.0)),
    "RZ": (JointKind.REVOLUTE_Z, (0.0, 0.0, 1.0)),
    "PX": (JointKind.PRISMATIC, (1.0, 0.0, 0.0)),
    "PY": (JointKind.PRISMATIC, (0.0, 1.0, 0.0)),
    "PZ": (JointKind.PRISMATIC, (0.0, 0.0, 1.0)),
    "RevoluteUnaligned": (JointKind.REVOLUTE, None),
    "PrismaticUnaligned": (JointKind.PRISMATIC, None),
    "FreeFlyer": (JointKind.FREE, (0.0, 0.0, 0.0)),
}
"""By Pinocchio's names; unaligned joints have their own axis."""


def robot_arrays(model: pin.Model) -> RobotArrays:
    """Return the arrays of a model at its neutral configuration, not yet computed."""
    count, nv = int(model.njoints), int(model.nv)
    kind = np.full(count, JointKind.OTHER, dtype=np.int64)
    axis = np.zeros((count, 3))
    for j, joint in enumerate(list(model.joints)[1:], start=1):
        name = joint.shortname().removeprefix("JointModel")
        if name in _KINDS:
            kind[j], fixed = _KINDS[name]
            axis[j] = joint.extract().axis if fixed is None else fixed
    pose = np.zeros((count, 12))
    pose[0] = pack_pose(pin.SE3.Identity())
    return RobotArrays(
        q=pin.neutral(model),
        is_current=np.zeros(3, dtype=np.int64),
        kind=kind,
        parent=np.array(model.parents, dtype=np.int64),
        q_start=np.array(model.idx_qs, dtype=np.int64),
        v_start=np.array(model.idx_vs, dtype=np.int64),
        v_count=np.array(model.nvs, dtype=np.int64),
        mount=np.array([pack_pose(T) for T in model.jointPlacements]),
        axis=axis,
        mass=np.array([body.mass for body in model.inertias]),
        lever=np.array([body.lever for body in model.inertias]),
        pose=pose,
        jacobian=np.zeros((nv, 6)),
        com=np.zeros(3),
        com_jacobian=np.zeros((nv, 3)),
    )


def pack_pose(T: pin.SE3) -> Vector:
    """Return a pose as a row: its rotation column by column, then its position."""
    return np.concatenate([T.rotation.T.ravel(), T.translation])


@compiled
def compute_joint_poses(robot: RobotArrays) -> None:
    """Compute joint poses and Jacobians from q, unless they are current.

    A joint's pose is `T_parent T_mount T_joint(q)`. The column of a revolute joint with
    the axis a and the origin p is `(p x a, a)`, of a prismatic one `(a, 0)`.
    """
    if robot.is_current[0]:
        return
    # Fields are read once: each access counts references.
    kinds, poses, axes, parents = robot.kind, robot.pose, robot.axis, robot.parent
    columns, q, mounts = robot.jacobian, robot.q, robot.mount
    q_start, v_start = robot.q_start, robot.v_start
    for j in range(1, kinds.shape[0]):
        kind, T, k, column = kinds[j], poses[j], q_start[j], columns[v_start[j]]
        multiply_poses(poses[parents[j]], mounts[j], T)
        if kind == JointKind.FREE:
            _move_freely(T, q[k:], columns[v_start[j] :])
        elif kind == JointKind.PRISMATIC:
            _shift(T, axes[j], float(q[k]), column)
        elif kind == JointKind.REVOLUTE:
            _turn(T, axes[j], float(q[k]), column)
        else:
            _turn_about(T, kind, float(q[k]), column)
    robot.is_current[0] = 1


@compiled
def compute_com(robot: RobotArrays) -> None:
    """Compute the centre of mass and its Jacobian, unless they are current.

    The velocity of joint j moves its subtree, of mass m_j and centre c_j, and so the
    robot's centre by `m_j (v_j + w_j x c_j) / m`, with (v_j, w_j) its Jacobian's
    column. Joint poses and Jacobians are current.
    """
    if robot.is_current[1]:
        return
    joints, parents, poses = robot.parent.shape[0], robot.parent, robot.pose
    columns, com_columns = robot.jacobian, robot.com_jacobian
    subtree = np.zeros((joints, 4))  # first moment and mass
    for j in range(joints - 1, 0, -1):
        T, m, lever = poses[j], robot.mass[j], robot.lever[j]
        for i in range(3):
            along = T[i] * lever[0] + T[3 + i] * lever[1] + T[6 + i] * lever[2]
            subtree[j, i] += m * (T[9 + i] + along)
        subtree[j, 3] += m
        for i in range(4):
            subtree[parents[j], i] += subtree[j, i]
    scale = 1.0 / subtree[0, 3]
    for j in range(1, joints):
        x, y, z, m = subtree[j, 0], subtree[j, 1], subtree[j, 2], subtree[j, 3]
        for k in range(robot.v_start[j], robot.v_start[j] + robot.v_count[j]):
            v, out = columns[k], com_columns[k]
            out[0] = scale * (m * v[0] + v[4] * z - v[5] * y)
            out[1] = scale * (m * v[1] + v[5] * x - v[3] * z)
            out[2] = scale * (m * v[2] + v[3] * y - v[4] * x)
    for i in range(3):
        robot.com[i] = scale * subtree[0, i]
    robot.is_current[1] = 1


@inner
def multiply_poses(A: Vector, B: Vector, out: Vector) -> None:
    """Write the pose `A B`; rotations by columns, then positions."""
    for i in range(3):
        a, b, c = A[i], A[3 + i], A[6 + i]
        for j in range(3):
            out[3 * j + i] = a * B[3 * j] + b * B[3 * j + 1] + c * B[3 * j + 2]
        out[9 + i] = A[9 + i] + a * B[9] + b * B[10] + c * B[11]


@inner
def _turn_about(T: Vector, k: int, angle: float, column: Vector) -> None:
    """Turn a pose about its own axis k, which mixes the two other columns."""
    s, c = np.sin(angle), np.cos(angle)
    a, b = 3 * ((k + 1) % 3), 3 * ((k + 2) % 3)
    for i in range(3):
        u, v = T[a + i], T[b + i]
        T[a + i], T[b + i] = c * u + s * v, c * v - s * u
    _write_revolute(T, T[3 * k], T[3 * k + 1], T[3 * k + 2], column)


@inner
def _turn(T: Vector, axis: Vector, angle: float, column: Vector) -> None:
    """Turn a pose about a unit axis of its own: `R (c I + s [a] + (1 - c) a a^T)`."""
    x, y, z = axis[0], axis[1], axis[2]
    s, c = np.sin(angle), np.cos(angle)
    for i in range(3):
        u, v, w = T[i], T[3 + i], T[6 + i]
        along = (1.0 - c) * (u * x + v * y + w * z)
        T[i] = c * u + s * (v * z - w * y) + along * x
        T[3 + i] = c * v + s * (w * x - u * z) + along * y
        T[6 + i] = c * w + s * (u * y - v * x) + along * z
    _write_revolute(T, *_in_world(T, axis), column)


@inner
def _shift(T: Vector, axis: Vector, distance: float, column: Vector) -> None:
    """Shift a pose along a unit axis of its own."""
    x, y, z = _in_world(T, axis)
    T[9] += distance * x
    T[10] += distance * y
    T[11] += distance * z
    column[0], column[1], column[2] = x, y, z
    for i in range(3, 6):
        column[i] = 0.0


@inner
def _move_freely(T: Vector, q: Vector, columns: Matrix) -> None:
    """Move a pose by a position and unit quaternion x y z w."""
    x, y, z, w = q[3], q[4], q[5], q[6]
    local = np.empty(12)
    local[0] = 1.0 - 2.0 * (y * y + z * z)
    local[4] = 1.0 - 2.0 * (x * x + z * z)
    local[8] = 1.0 - 2.0 * (x * x + y * y)
    local[1], local[3] = 2.0 * (x * y + w * z), 2.0 * (x * y - w * z)
    local[2], local[6] = 2.0 * (x * z - w * y), 2.0 * (x * z + w * y)
    local[5], local[7] = 2.0 * (y * z + w * x), 2.0 * (y * z - w * x)
    local[9], local[10], local[11] = q[0], q[1], q[2]
    parent = np.empty(12)
    for i in range(12):
        parent[i] = T[i]
    multiply_poses(parent, local, T)
    for k in range(3):
        for i in range(3):
            columns[k, i], columns[k, 3 + i] = T[3 * k + i], 0.0
        _write_revolute(T, T[3 * k], T[3 * k + 1], T[3 * k + 2], columns[3 + k])


@inner
def _in_world(T: Vector, axis: Vector) -> tuple[float, float, float]:
    """Return an axis of a pose in world coordinates."""
    x, y, z = axis[0], axis[1], axis[2]
    return (
        T[0] * x + T[3] * y + T[6] * z,
        T[1] * x + T[4] * y + T[7] * z,
        T[2] * x + T[5] * y + T[8] * z,
    )


@inner
def _write_revolute(T: Vector, u: float, v: float, w: float, column: Vector) -> None:
    """Write `(p x a, a)` for the axis a through a pose's origin p."""
    x, y, z = T[9], T[10], T[11]
    column[0], column[1], column[2] = y * w - z * v, z * u - x * w, x * v - y * u
    column[3], column[4], column[5] = u, v, w
