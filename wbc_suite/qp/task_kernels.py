"""Compiled errors, Jacobians and weighted rows of QP tasks.

`write_tasks` turns the errors and Jacobians of all tasks of a level into weighted rows.
Those of the built-in kinds are computed here; those of other tasks stand in the buffers
before.
"""

from typing import NamedTuple

import numpy as np

from wbc_suite.compiling import compiled, struct
from wbc_suite.kinematics.forward import (
    RobotArrays,
    compute_com,
    compute_joint_poses,
    multiply_poses,
)
from wbc_suite.qp.kernel import Kernel
from wbc_suite.qp.lie import FAR, inverse_left_jacobian, log3
from wbc_suite.typing import Indices, Matrix, Vector


@struct
class TaskArrays(NamedTuple):
    """The tasks of one level; n tasks with m rows in all, and k tasks on joints.

    Attributes:
        kernel: `Kernel` of each task with rows, shape (n,).
        joint: Parent joint of the frame of each, shape (n,).
        offset: Pose of the frame in its joint, by columns, shape (n, 12).
        target: Target pose [R p] row by row, or position, shape (n, 12).
        row_start: First row of each task, and m, shape (n + 1,).
        angular_start: First row of each task that is an angle, shape (n,).
        support_start: First entry of `support` of each task, shape (n + 1,).
        support: Velocity indices whose columns may differ from zero.
        error: Errors, shape (m,).
        jacobian: Their derivatives, `d(error) = -J dq`, shape (m, nv).
        cost: Cost of each row, shape (m,).
        gain: Gain of each task, shape (n,).
        max_speed: Greatest speed and angular speed of each task, shape (n, 2).
        distance: Output, length of the error and its angle, shape (n, 2); NaN for a
            target that is not finite.
        joint_kernel: `Kernel` of each task on joints, shape (k,).
        joint_target: Posture of each, shape (k, nq).
        joint_error: Errors, shape (k, nv).
        squared_cost: Squared costs, shape (k, nv).
        joint_gain: Gains, shape (k,).
        joint_speed: Greatest speeds, shape (k,).
        joint_finite: Output, whether the target of each is finite, shape (k,).
        q_index: Position index of each velocity, -1 where it has none, shape (nv,).
        bias: Squared costs and weighted steps that are added, shape (2, nv).
        W: Output, weighted Jacobians, shape (m, nv).
        e: Output, weighted steps, shape (m,).
        diagonal: Output, squared costs and weighted steps of joints, shape (2, nv).
        mu: Output, damping of all joints, shape (1,).
        all_finite: Output, set to 0 if a target is not finite, shape (1,).
    """

    kernel: Indices
    joint: Indices
    offset: Matrix
    target: Matrix
    row_start: Indices
    angular_start: Indices
    support_start: Indices
    support: Indices
    error: Vector
    jacobian: Matrix
    cost: Vector
    gain: Vector
    max_speed: Matrix
    distance: Matrix
    joint_kernel: Indices
    joint_target: Matrix
    joint_error: Matrix
    squared_cost: Matrix
    joint_gain: Vector
    joint_speed: Vector
    joint_finite: Indices
    q_index: Indices
    bias: Matrix
    W: Matrix
    e: Vector
    diagonal: Matrix
    mu: Vector
    all_finite: Vector


@compiled
def write_tasks(
    robot: RobotArrays, tasks: TaskArrays, dt: float, damping: float, curvature: float
) -> bool:
    """Write the weighted rows of a level, and its damping mu.

    `mu = damping + curvature sum_rows |e| max|W|`. The second part bounds what the
    rows' linearisation leaves out: a second derivative is no larger than the longest
    lever arm, which is the row's largest entry. It vanishes with the error, and makes
    the step a descent where a target cannot be reached (Levenberg-Marquardt with a
    bound in place of a guess).

    Args:
        robot: The robot.
        tasks: The tasks.
        dt: Step, s.
        damping: Constant part of mu, [cost]^2/rad^2.
        curvature: Factor of the part that follows the error; 1 bounds, 0 is without.

    Returns:
        Whether all rows are finite.
    """
    compute_joint_poses(robot)
    mu, total = damping, 0.0
    for t in range(tasks.kernel.shape[0]):
        rows = slice(tasks.row_start[t], tasks.row_start[t + 1])
        support = tasks.support[tasks.support_start[t] : tasks.support_start[t + 1]]
        error, jacobian = tasks.error[rows], tasks.jacobian[rows]
        if tasks.kernel[t] == Kernel.FRAME:
            joint, offset, target = tasks.joint[t], tasks.offset[t], tasks.target[t]
            frame_error(robot, joint, offset, target, support, error, jacobian)
        elif tasks.kernel[t] == Kernel.COM:
            com_error(robot, tasks.target[t], error, jacobian)
        bending, size = _weigh_rows(tasks, t, support, dt)
        mu += curvature * bending
        total += size
    _write_joint_tasks(robot, tasks, dt)
    diagonal = tasks.diagonal
    for i in range(diagonal.shape[1]):
        total += abs(diagonal[0, i]) + abs(diagonal[1, i])
    tasks.mu[0] = mu
    return bool(np.isfinite(mu + total))


@compiled
def frame_error(  # noqa: C901, one frame
    robot: RobotArrays,
    joint: int,
    offset: Vector,
    target: Vector,
    support: Indices,
    error: Vector,
    jacobian: Matrix,
) -> None:
    """Write the error of a frame and its Jacobian; see `FrameTask` for the equations.

    Args:
        robot: The robot; joint poses are current.
        joint: Parent joint of the frame.
        offset: Pose of the frame in its joint, by columns, shape (12,).
        target: Target pose [R p] row by row, shape (12,).
        support: Velocity indices that move the frame; other columns stay as they are.
        error: Output, shape (6,); NaN for a target that is not finite.
        jacobian: Output, shape (6, nv); for such a target, that of no rotation.
    """
    T, E, A = np.empty(12), np.empty((3, 3)), np.empty((3, 3))
    multiply_poses(robot.pose[joint], offset, T)
    finite = True
    for i in range(12):
        finite &= abs(target[i]) < FAR
    rotation = error[3:]
    for i in range(3):
        error[i] = target[4 * i + 3] - T[9 + i]
        for j in range(3):
            E[i, j] = 1.0 if i == j else 0.0
            if finite:
                E[i, j] = T[3 * i] * target[j]
                E[i, j] += T[3 * i + 1] * target[4 + j] + T[3 * i + 2] * target[8 + j]
    angle = log3(E, rotation)
    inverse_left_jacobian(rotation, angle, E)
    for i in range(3):
        for j in range(3):  # A = Jl^-1 R^T maps world rates
            A[i, j] = E[i, 0] * T[j] + E[i, 1] * T[3 + j] + E[i, 2] * T[6 + j]
    columns = robot.jacobian
    for k in range(support.shape[0]):
        col = support[k]
        J = columns[col]
        x, y, z = J[3], J[4], J[5]
        jacobian[0, col] = J[0] + y * T[11] - z * T[10]
        jacobian[1, col] = J[1] + z * T[9] - x * T[11]
        jacobian[2, col] = J[2] + x * T[10] - y * T[9]
        for i in range(3):
            jacobian[3 + i, col] = A[i, 0] * x + A[i, 1] * y + A[i, 2] * z
    if not finite:
        for i in range(6):
            error[i] = np.nan


@compiled
def com_error(
    robot: RobotArrays, target: Vector, error: Vector, jacobian: Matrix
) -> None:
    """Write the error of the centre of mass and its Jacobian; see `ComTask`.

    Args:
        robot: The robot; joint poses are current.
        target: Target position, shape (3,) or longer.
        error: Output, shape (3,).
        jacobian: Output, shape (3, nv).
    """
    compute_com(robot)
    columns = robot.com_jacobian
    for i in range(3):
        error[i] = target[i] - robot.com[i]
        for col in range(jacobian.shape[1]):
            jacobian[i, col] = columns[col, i]


@compiled
def _weigh_rows(
    tasks: TaskArrays, t: int, support: Indices, dt: float
) -> tuple[float, float]:
    """Write the weighted rows of a task, `W = cost J` and `e = cost saturated step`.

    Returns:
        `sum |e| max|W|` over the rows, and the sum of all sizes.
    """
    first, middle, last = (
        tasks.row_start[t],
        tasks.angular_start[t],
        tasks.row_start[t + 1],
    )
    finite, gain = True, tasks.gain[t]
    scale = np.empty(2)
    for part in range(2):
        square = 0.0
        for row in range(middle if part else first, last if part else middle):
            square += tasks.error[row] ** 2
        length, limit = np.sqrt(square), tasks.max_speed[t, part] * dt
        tasks.distance[t, part] = length
        finite &= length < FAR
        scale[part] = gain if gain * length <= limit else limit / length
    if not finite:
        tasks.distance[t, 0] = tasks.distance[t, 1] = np.nan
        tasks.all_finite[0] = 0.0
    bending, total = 0.0, 0.0
    all_W, jacobian = tasks.W, tasks.jacobian
    for row in range(first, last):
        cost, longest = tasks.cost[row], 0.0
        W, J = all_W[row], jacobian[row]
        for k in range(support.shape[0]):
            weighted = cost * J[support[k]]
            W[support[k]] = weighted
            size = abs(weighted)
            total += size
            longest = max(longest, size)
        e = 0.0
        if finite:
            e = cost * scale[0 if row < middle else 1] * tasks.error[row]
        tasks.e[row] = e
        total += abs(e)
        bending += abs(e) * longest
    return bending, total


@compiled
def _write_joint_tasks(robot: RobotArrays, tasks: TaskArrays, dt: float) -> None:
    """Write the diagonal: squared costs, and squared costs times saturated steps."""
    nv, diagonal, bias = tasks.q_index.shape[0], tasks.diagonal, tasks.bias
    q, q_index = robot.q, tasks.q_index
    for i in range(nv):
        diagonal[0, i], diagonal[1, i] = bias[0, i], bias[1, i]
    for t in range(tasks.joint_kernel.shape[0]):
        error, weight, total = tasks.joint_error[t], tasks.squared_cost[t], 0.0
        target, is_posture = tasks.joint_target[t], tasks.joint_kernel[t]
        gain = tasks.joint_gain[t]
        for i in range(nv):
            if weight[i] > 0.0:
                if is_posture == Kernel.POSTURE:
                    error[i] = target[q_index[i]] - q[q_index[i]]
                total += error[i]
        finite, limit = bool(np.isfinite(total)), tasks.joint_speed[t] * dt
        tasks.joint_finite[t] = finite
        if not finite:
            tasks.all_finite[0] = 0.0
        for i in range(nv):
            diagonal[0, i] += weight[i]
            if finite and weight[i] > 0.0:
                step = gain * error[i]
                diagonal[1, i] += weight[i] * min(max(step, -limit), limit)
