"""Forward kinematics, joint Jacobians and centre of mass, compiled.

Tests hold these kernels to Pinocchio at 1e-12.
"""

from enum import IntEnum
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.compiling import compiled, inner, record_type, struct
from wbc_suite.typing import CompiledRecords, Indices, Matrix, Vector

JOINT = record_type(
    ("kind", "i8"),  # `JointKind`
    ("parent", "i8"),
    ("q_start", "i8"),  # first position
    ("v_start", "i8"),  # first velocity
    ("v_count", "i8"),  # number of velocities
    ("mount", "f8", (12,)),  # pose in the parent at q = 0
    ("axis", "f8", (3,)),
    ("mass", "f8"),  # that the joint carries itself, kg
    ("lever", "f8", (3,)),  # centre of mass of that in the joint, m
)
"""A joint of a robot."""


@struct
class RobotArrays(NamedTuple):
    """The joints of a robot, the universe first, and where q places them.

    Poses have the rotation column by column, then the position. Jacobians are
    transposed, with world axes at the world's origin.

    Attributes:
        q: Joint positions, shape (nq,).
        is_current: Whether joint poses with Jacobians, the centre of mass, and
            Pinocchio's data belong to the present q, shape (3,).
        joints: `JOINT` records, shape (njoints,).
        pose: Pose of each joint in the world, shape (njoints, 12).
        jacobian: Joint Jacobians, shape (nv, 6).
        com: Centre of mass, m, shape (3,).
        com_jacobian: Its Jacobian, shape (nv, 3).
    """

    q: Vector
    is_current: Indices
    joints: CompiledRecords
    pose: Matrix
    jacobian: Matrix
    com: Vector
    com_jacobian: Matrix


class JointKind(IntEnum):
    """How a joint moves: about or along an axis of its mount, or freely."""

    OTHER = -1
    """Unknown to the kernels; Pinocchio computes models with such joints."""
    REVOLUTE = 0
    PRISMATIC = 1
    FREE = 2


_KINDS = {
    "RX": (JointKind.REVOLUTE, (1.0, 0.0, 0.0)),
    "RY": (JointKind.REVOLUTE, (0.0, 1.0, 0.0)),
    "RZ": (JointKind.REVOLUTE, (0.0, 0.0, 1.0)),
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
    joints = np.zeros(count, JOINT)
    joints["kind"], joints["parent"] = JointKind.OTHER, model.parents
    joints["q_start"], joints["v_start"] = model.idx_qs, model.idx_vs
    joints["v_count"] = model.nvs
    joints["mount"] = [pack_pose(T) for T in model.jointPlacements]
    joints["mass"] = [body.mass for body in model.inertias]
    joints["lever"] = [body.lever for body in model.inertias]
    for own, joint in zip(joints[1:], list(model.joints)[1:], strict=True):
        name = joint.shortname().removeprefix("JointModel")
        if name in _KINDS:
            own["kind"], axis = _KINDS[name]
            own["axis"] = joint.extract().axis if axis is None else axis
    pose = np.zeros((count, 12))
    pose[0] = pack_pose(pin.SE3.Identity())
    return RobotArrays(
        q=pin.neutral(model),
        is_current=np.zeros(3, dtype=np.int64),
        joints=joints,
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
    joints, poses, columns, q = robot.joints, robot.pose, robot.jacobian, robot.q
    mount = np.empty(12)
    for j in range(1, joints.shape[0]):
        joint, T = joints[j], poses[j]
        k, i = joint.q_start, joint.v_start
        for m in range(12):
            mount[m] = joint.mount[m]
        multiply_poses(poses[joint.parent], mount, T)
        if joint.kind == JointKind.FREE:
            _move_freely(T, q[k:], columns[i:])
        elif joint.kind == JointKind.PRISMATIC:
            _shift(T, joint.axis, float(q[k]), columns[i])
        else:
            _turn(T, joint.axis, float(q[k]), columns[i])
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
    joints, count, poses = robot.joints, robot.joints.shape[0], robot.pose
    columns, com_columns, com = robot.jacobian, robot.com_jacobian, robot.com
    subtree = np.zeros((count, 4))  # first moment and mass
    for j in range(count - 1, 0, -1):
        joint, T = joints[j], poses[j]
        m, lever, parent = joint.mass, joint.lever, joint.parent
        for i in range(3):
            along = T[i] * lever[0] + T[3 + i] * lever[1] + T[6 + i] * lever[2]
            subtree[j, i] += m * (T[9 + i] + along)
        subtree[j, 3] += m
        for i in range(4):
            subtree[parent, i] += subtree[j, i]
    scale = 1.0 / subtree[0, 3]
    for j in range(1, count):
        x, y, z, m = subtree[j, 0], subtree[j, 1], subtree[j, 2], subtree[j, 3]
        first = joints[j].v_start
        for k in range(first, first + joints[j].v_count):
            v, out = columns[k], com_columns[k]
            out[0] = scale * (m * v[0] + v[4] * z - v[5] * y)
            out[1] = scale * (m * v[1] + v[5] * x - v[3] * z)
            out[2] = scale * (m * v[2] + v[3] * y - v[4] * x)
    for i in range(3):
        com[i] = scale * subtree[0, i]
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
