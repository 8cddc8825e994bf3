"""Forward kinematics, joint Jacobians and centre of mass, compiled.

Pinocchio is the specification: `pin.computeJointJacobians` and
`pin.jacobianCenterOfMass`, to which a test holds these kernels at 1e-12. They write
into Pinocchio's own memory, so that its frames and frame Jacobians follow, and they are
kernels so that a task stack's compiled tick can run them inside.
"""

from enum import IntEnum

import numpy as np
import pinocchio as pin

from wbc_suite.compiling import compiled
from wbc_suite.kinematics.array_table import indices, matrix, vector
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["JointKind", "RobotField", "joint_kinds", "place_joints", "weigh_joints"]


class RobotField(IntEnum):
    """Arrays of a robot: what its joints are, and where q puts them.

    By joint, the universe first: kind, parent, first and number of velocities, first
    position, mount (pose in the parent: rotation by columns, then position), axis, mass
    and centre of mass of what it carries, placement (pose in the world, as a mount).
    By velocity: Jacobian, world axes at the world's origin, and that of the robot's
    centre of mass. `CURRENT` tells what follows from the present q: placements with
    Jacobians, and the centre of mass.
    """

    Q = 0
    CURRENT = 1
    KIND = 2
    PARENT = 3
    V_FIRST = 4
    V_COUNT = 5
    Q_FIRST = 6
    MOUNT = 7
    AXIS = 8
    MASS = 9
    LEVER = 10
    PLACEMENT = 11
    JACOBIAN = 12
    COM = 13
    COM_JACOBIAN = 14


class JointKind(IntEnum):
    """How a joint moves; it turns about an axis of its mount or about any."""

    OTHER = -1
    TURN_X = 0
    TURN_Y = 1
    TURN_Z = 2
    TURN = 3
    SHIFT = 4
    FREE = 5


_KINDS = {
    "RX": (JointKind.TURN_X, (1.0, 0.0, 0.0)),
    "RY": (JointKind.TURN_Y, (0.0, 1.0, 0.0)),
    "RZ": (JointKind.TURN_Z, (0.0, 0.0, 1.0)),
    "PX": (JointKind.SHIFT, (1.0, 0.0, 0.0)),
    "PY": (JointKind.SHIFT, (0.0, 1.0, 0.0)),
    "PZ": (JointKind.SHIFT, (0.0, 0.0, 1.0)),
    "RevoluteUnaligned": (JointKind.TURN, None),
    "PrismaticUnaligned": (JointKind.SHIFT, None),
    "FreeFlyer": (JointKind.FREE, (0.0, 0.0, 0.0)),
}
"""By Pinocchio's names; unaligned joints know their axis."""


def joint_kinds(model: pin.Model) -> tuple[Indices, Matrix]:
    """Return kind and axis of each joint, the universe first."""
    kinds = np.full(len(model.joints), JointKind.OTHER, dtype=np.int64)
    axes = np.zeros((len(model.joints), 3))
    for j, joint in enumerate(list(model.joints)[1:], start=1):
        name = joint.shortname().removeprefix("JointModel")
        if name in _KINDS:
            kinds[j], axis = _KINDS[name]
            axes[j] = joint.extract().axis if axis is None else axis
    return kinds, axes


@compiled
def place_joints(robot: Indices) -> None:
    """Compute joint poses and Jacobians from q, unless they are current.

    A joint's pose is `T_parent T_mount T_joint(q)`. The column of a revolute joint with
    the axis a and the origin p is `(p x a, a)`, of a prismatic one `(a, 0)`.

    Args:
        robot: Table of `RobotField`; no joint's kind is `OTHER` but the universe's.
    """
    current = indices(robot, RobotField.CURRENT)
    if current[0]:
        return
    q = vector(robot, RobotField.Q)
    kinds, parents = indices(robot, RobotField.KIND), indices(robot, RobotField.PARENT)
    firsts, mounts = indices(robot, RobotField.Q_FIRST), matrix(robot, RobotField.MOUNT)
    axes, placements = (
        matrix(robot, RobotField.AXIS),
        matrix(robot, RobotField.PLACEMENT),
    )
    columns, v_firsts = (
        matrix(robot, RobotField.JACOBIAN),
        indices(robot, RobotField.V_FIRST),
    )
    for j in range(1, kinds.shape[0]):
        kind, T, column = kinds[j], placements[j], columns[v_firsts[j]]
        _mount(placements[parents[j]], mounts[j], T)
        if kind == JointKind.FREE:
            _float(T, q[firsts[j] :], columns[v_firsts[j] :])
        elif kind == JointKind.SHIFT:
            _shift(T, axes[j], float(q[firsts[j]]), column)
        elif kind == JointKind.TURN:
            _turn(T, axes[j], float(q[firsts[j]]), column)
        else:
            _turn_about(T, kind, float(q[firsts[j]]), column)
    current[0] = 1


@compiled
def weigh_joints(robot: Indices) -> None:
    """Compute the centre of mass and its Jacobian, unless they are current.

    The velocity of joint j moves what hangs on it, of mass m_j and centre c_j, and so
    the robot's centre by `m_j (v_j + w_j x c_j) / m`, with (v_j, w_j) its Jacobian's
    column.

    Args:
        robot: Table of `RobotField`, placements and Jacobians being current.
    """
    current = indices(robot, RobotField.CURRENT)
    if current[1]:
        return
    parents, counts = (
        indices(robot, RobotField.PARENT),
        indices(robot, RobotField.V_COUNT),
    )
    v_firsts, masses = (
        indices(robot, RobotField.V_FIRST),
        vector(robot, RobotField.MASS),
    )
    levers, placements = (
        matrix(robot, RobotField.LEVER),
        matrix(robot, RobotField.PLACEMENT),
    )
    columns, com = matrix(robot, RobotField.JACOBIAN), vector(robot, RobotField.COM)
    com_columns = matrix(robot, RobotField.COM_JACOBIAN)
    joints = parents.shape[0]
    hung = np.zeros((joints, 4))  # moment and mass of all that hangs on a joint
    for j in range(joints - 1, 0, -1):
        T, m, lever = placements[j], masses[j], levers[j]
        for i in range(3):
            along = T[i] * lever[0] + T[3 + i] * lever[1] + T[6 + i] * lever[2]
            hung[j, i] += m * (T[9 + i] + along)
        hung[j, 3] += m
        for i in range(4):
            hung[parents[j], i] += hung[j, i]
    total = 1.0 / hung[0, 3]
    for j in range(1, joints):
        x, y, z, m = hung[j]
        for k in range(v_firsts[j], v_firsts[j] + counts[j]):
            v, out = columns[k], com_columns[k]
            out[0] = total * (m * v[0] + v[4] * z - v[5] * y)
            out[1] = total * (m * v[1] + v[5] * x - v[3] * z)
            out[2] = total * (m * v[2] + v[3] * y - v[4] * x)
    for i in range(3):
        com[i] = total * hung[0, i]
    current[1] = 1


@compiled
def _mount(A: Vector, B: Vector, out: Vector) -> None:
    """Write the pose `A B`; rotations by columns, then positions."""
    for i in range(3):
        a, b, c = A[i], A[3 + i], A[6 + i]
        for j in range(3):
            out[3 * j + i] = a * B[3 * j] + b * B[3 * j + 1] + c * B[3 * j + 2]
        out[9 + i] = A[9 + i] + a * B[9] + b * B[10] + c * B[11]


@compiled
def _turn_about(T: Vector, k: int, angle: float, column: Vector) -> None:
    """Turn a pose about its own axis k, which mixes the two other columns."""
    s, c = np.sin(angle), np.cos(angle)
    a, b = 3 * ((k + 1) % 3), 3 * ((k + 2) % 3)
    for i in range(3):
        u, v = T[a + i], T[b + i]
        T[a + i], T[b + i] = c * u + s * v, c * v - s * u
    _spin(T, T[3 * k], T[3 * k + 1], T[3 * k + 2], column)


@compiled
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
    _spin(T, *_along(T, axis), column)


@compiled
def _shift(T: Vector, axis: Vector, distance: float, column: Vector) -> None:
    """Shift a pose along a unit axis of its own."""
    x, y, z = _along(T, axis)
    T[9] += distance * x
    T[10] += distance * y
    T[11] += distance * z
    column[0], column[1], column[2] = x, y, z
    for i in range(3, 6):
        column[i] = 0.0


@compiled
def _float(T: Vector, q: Vector, columns: Matrix) -> None:
    """Move a pose by position and unit quaternion x y z w."""
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
    _mount(parent, local, T)
    for k in range(3):
        for i in range(3):
            columns[k, i], columns[k, 3 + i] = T[3 * k + i], 0.0
        _spin(T, T[3 * k], T[3 * k + 1], T[3 * k + 2], columns[3 + k])


@compiled
def _along(T: Vector, axis: Vector) -> tuple[float, float, float]:
    """Return an axis of a pose in the world."""
    x, y, z = axis[0], axis[1], axis[2]
    return (
        T[0] * x + T[3] * y + T[6] * z,
        T[1] * x + T[4] * y + T[7] * z,
        T[2] * x + T[5] * y + T[8] * z,
    )


@compiled
def _spin(T: Vector, u: float, v: float, w: float, column: Vector) -> None:
    """Write `(p x a, a)` for the axis a through a pose's origin p."""
    x, y, z = T[9], T[10], T[11]
    column[0], column[1], column[2] = y * w - z * v, z * u - x * w, x * v - y * u
    column[3], column[4], column[5] = u, v, w
