"""Compiled errors, Jacobians and weighted rows of QP tasks.

`write_tasks` turns the errors and Jacobians of all tasks of a level into weighted rows.
Those of built-in kinds are computed here; those of others are in the buffers before.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from wbc_suite.compiling import compiled, inner, struct
from wbc_suite.kinematics.forward import (
    RobotArrays,
    compute_com,
    compute_joint_poses,
    multiply_poses,
)
from wbc_suite.linear_algebra import copy_rows
from wbc_suite.qp.kernel import Kernel
from wbc_suite.qp.lie import LARGEST_FINITE, inverse_left_jacobian, log3
from wbc_suite.typing import Indices, Matrix, Vector


@struct
class TaskArrays(NamedTuple):
    """The tasks of one level: n tasks with m rows in all, and k tasks on joints."""

    write_com: Callable[..., None]  # `com_error`, or `no_com` without such tasks
    kernel: Indices  # (n,), `Kernel` of each task with rows
    joint: Indices  # (n,), parent joint of the frame of each
    offset: Matrix  # (n, 12), pose of the frame in its joint, by columns
    target: Matrix  # (n, 12), target pose [R p] row by row, or position
    row_start: Indices  # (n + 1,), first row of each task, and m
    angular_start: Indices  # (n,), first row of each task that is an angle
    support_start: Indices  # (n + 1,), first entry of `support` of each task
    support: Indices  # velocity indices whose columns may differ from zero
    error: Vector  # (m,)
    jacobian: Matrix  # (m, nv), `d(error) = -J dq`
    cost: Vector  # (m,)
    gain: Vector  # (n,)
    max_speed: Matrix  # (n, 2), greatest speed and angular speed of each task
    distances: Matrix  # (n, 2), output: lengths of error and angle, NaN if not finite
    joint_kernel: Indices  # (k,), `Kernel` of each task on joints
    joint_target: Matrix  # (k, nq), posture of each
    joint_error: Matrix  # (k, nv)
    squared_cost: Matrix  # (k, nv)
    joint_gain: Vector  # (k,)
    joint_speed: Vector  # (k,), greatest speeds
    joint_finite: Indices  # (k,), output: whether the target of each is finite
    q_index: Indices  # (nv,), position index of each velocity, -1 where it has none
    bias: Matrix  # (2, nv), squared costs and weighted steps that are added
    W: Matrix  # (m, nv), output: weighted Jacobians
    e: Vector  # (m,), output: weighted steps
    diagonal: Matrix  # (2, nv), output: squared costs and weighted steps of joints
    mu: Vector  # (1,), output: damping of all joints
    all_finite: Vector  # (1,), output: set to 0 if a target is not finite


@inner
def write_tasks(
    robot: RobotArrays, tasks: TaskArrays, dt: float, damping: float, curvature: float
) -> bool:
    """Write the weighted rows of a level, and its damping mu.

    `mu = damping + curvature sum_rows |e| max|W|`. The second part bounds what the
    rows' linearisation leaves out: a second derivative is no larger than the longest
    lever arm, which is the row's largest entry. It vanishes with the error, and makes
    the step a descent where a target cannot be reached (Levenberg-Marquardt with a
    bound in place of a guess). Return whether all rows are finite.
    """
    compute_joint_poses(robot)
    mu, total, diagonal, kernel = damping, 0.0, tasks.diagonal, tasks.kernel
    targets, errors, jacobians = tasks.target, tasks.error, tasks.jacobian
    row_start, starts, supports = tasks.row_start, tasks.support_start, tasks.support
    for t in range(kernel.shape[0]):
        rows = slice(row_start[t], row_start[t + 1])
        support, target = supports[starts[t] : starts[t + 1]], targets[t]
        error, jacobian = errors[rows], jacobians[rows]
        if kernel[t] == Kernel.FRAME:
            joint, offset = tasks.joint[t], tasks.offset[t]
            frame_error(robot, joint, offset, target, support, error, jacobian)
        elif kernel[t] == Kernel.COM:
            tasks.write_com(robot, target, error, jacobian)
        bending, size = _weigh_rows(tasks, t, support, dt)
        mu += curvature * bending
        total += size
    _write_joint_tasks(robot, tasks, dt)
    for i in range(diagonal.shape[1]):
        total += abs(diagonal[0, i]) + abs(diagonal[1, i])
    tasks.mu[0] = mu
    return bool(np.isfinite(mu + total))


@compiled
def frame_error(
    robot: RobotArrays,
    joint: int,
    offset: Vector,
    target: Vector,
    support: Indices,
    error: Vector,
    jacobian: Matrix,
) -> None:
    """Write the error of a frame and its Jacobian; see `FrameTask` for the equations.

    Joint poses are current; joint, offset, target and support are as in `TaskArrays`.
    For a target that is not finite the error, shape (6,), is NaN, and the Jacobian,
    shape (6, nv), that of no rotation. Columns outside the support stay as they are.
    """
    T, E, A = np.empty(12), np.empty((3, 3)), np.empty((3, 3))
    multiply_poses(robot.pose[joint], offset, T)
    finite = relative_rotation(T, target, E)
    rotation = error[3:]
    angle = log3(E, rotation)
    inverse_left_jacobian(rotation, angle, E)
    for i in range(3):
        error[i] = target[4 * i + 3] - T[9 + i]
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
        error[:] = np.nan


@inner
def relative_rotation(T: Vector, target: Vector, out: Matrix) -> bool:
    """Write `R_wf^T R_wt`, or I for a target that is not finite; return if it is.

    T is packed by columns, the target row by row.
    """
    finite = True
    for i in range(12):
        finite &= abs(target[i]) < LARGEST_FINITE
    for i in range(3):
        for j in range(3):
            out[i, j] = 1.0 if i == j else 0.0
            if finite:
                out[i, j] = T[3 * i] * target[j]
                out[i, j] += T[3 * i + 1] * target[4 + j] + T[3 * i + 2] * target[8 + j]
    return finite


@inner
def no_com(robot: RobotArrays, target: Vector, error: Vector, jacobian: Matrix) -> None:
    """Do nothing: no task of the level has a centre of mass."""


@compiled
def com_error(
    robot: RobotArrays, target: Vector, error: Vector, jacobian: Matrix
) -> None:
    """Write the error of the centre of mass, (3,), and its Jacobian; see `ComTask`.

    Joint poses are current; the target may be longer than 3.
    """
    compute_com(robot)
    for i in range(3):
        for j in range(jacobian.shape[1]):
            jacobian[i, j] = robot.com_jacobian[j, i]
        error[i] = target[i] - robot.com[i]


@inner
def _weigh_rows(
    tasks: TaskArrays, t: int, support: Indices, dt: float
) -> tuple[float, float]:
    """Write the weighted rows of a task, `W = cost J` and `e = cost saturated step`.

    Return `sum |e| max|W|` over the rows, and the sum of all sizes.
    """
    row_start, errors, distances = tasks.row_start, tasks.error, tasks.distances
    first, last, max_speed = row_start[t], row_start[t + 1], tasks.max_speed
    middle, finite, gain = tasks.angular_start[t], True, tasks.gain[t]
    all_W, jacobian, costs, steps = tasks.W, tasks.jacobian, tasks.cost, tasks.e
    scale = np.empty(2)
    for part in range(2):
        square = 0.0
        for row in range(middle if part else first, last if part else middle):
            square += errors[row] ** 2
        length, limit = np.sqrt(square), max_speed[t, part] * dt
        distances[t, part] = length
        finite &= length < LARGEST_FINITE
        scale[part] = gain if gain * length <= limit else limit / length
    if not finite:
        distances[t, 0] = distances[t, 1] = np.nan
        tasks.all_finite[0] = 0.0
    bending, total = 0.0, 0.0
    for row in range(first, last):
        cost, longest = costs[row], 0.0
        W, J = all_W[row], jacobian[row]
        for k in range(support.shape[0]):
            weighted = cost * J[support[k]]
            W[support[k]] = weighted
            size = abs(weighted)
            total += size
            longest = max(longest, size)
        e = 0.0
        if finite:
            e = cost * scale[0 if row < middle else 1] * errors[row]
        steps[row] = e
        total += abs(e)
        bending += abs(e) * longest
    return bending, total


@inner
def _write_joint_tasks(robot: RobotArrays, tasks: TaskArrays, dt: float) -> None:
    """Write the diagonal: squared costs, and squared costs times saturated steps."""
    q, q_index, diagonal = robot.q, tasks.q_index, tasks.diagonal
    nv = q_index.shape[0]
    copy_rows(tasks.bias, diagonal)
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
