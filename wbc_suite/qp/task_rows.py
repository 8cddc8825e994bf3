"""Weighted rows of the tasks of one level, compiled."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from wbc_suite.compiling import inner, record_type, struct
from wbc_suite.kinematics.forward import RobotArrays
from wbc_suite.linear_algebra import copy_rows
from wbc_suite.qp.active_set import QpArrays
from wbc_suite.qp.lie import LARGEST_FINITE
from wbc_suite.typing import CompiledRecords, Indices, Matrix, Vector

TASK = record_type(
    ("kernel", "i8"),  # place in `PartArrays.kernels`; 0 does nothing
    ("first", "i8"),  # its numbers are own[0][first:last] of `PartArrays`
    ("last", "i8"),
    ("row", "i8"),  # its rows of errors and Jacobians; none of tasks on joints
    ("angle", "i8"),  # first row that is an angle
    ("end", "i8"),
    ("gain", "f8"),
    ("speed", "f8", (2,)),  # greatest speed, and of angles
    ("is_finite", "i8"),  # output: whether its error is
)
"""A task of a level."""


@struct
class LevelArrays(NamedTuple):
    """One strict level: n tasks with m rows in all, k tasks on joints, and their QP.

    Below level 0, equality rows of the problem are an orthonormal basis of what the
    levels above decide.
    """

    tasks: CompiledRecords  # (n,) `TASK`
    joint_tasks: CompiledRecords  # (k,) `TASK`
    error: Vector  # (m,)
    jacobian: Matrix  # (m, nv), `d(error) = -J dq`
    cost: Vector  # (m,)
    distances: Matrix  # (n, 2), output: lengths of error and angle, NaN if not finite
    joint_error: Matrix  # (k, nv)
    squared_cost: Matrix  # (k, nv)
    bias: Matrix  # (2, nv), squared costs and weighted steps that are added
    qp: QpArrays  # output: W, e, diagonal and mu
    above: Matrix  # (m, nv), scratch: rows of all levels above and of the equalities
    kept: Matrix  # (nv, nv), basis of what they decided at the last tick
    kept_counts: Indices  # (2,), its size, and the greatest rank so far


@struct
class PartArrays(NamedTuple):
    """A stack's parts with their kernels, and its levels."""

    robot: RobotArrays
    kernels: tuple[Callable[..., None], ...]
    own: tuple[Vector, ...]  # of tasks and equalities, then of each limit
    rows: CompiledRecords  # `PART` of each limit and equality
    state: CompiledRecords  # (1,) `STATE`
    x: Vector  # (nv,), output: the step
    levels: tuple[LevelArrays, ...]  # the last is repeated up to `MAX_LEVELS`


@inner
def write_tasks(
    parts: PartArrays,
    level: LevelArrays,
    dt: float,
    damping: float,
    curvature: float,
) -> bool:
    """Write the weighted rows of a level, and its damping mu.

    `mu = damping + curvature sum_rows |e| max|W|`. The second part bounds what the
    rows' linearisation leaves out: a second derivative is no larger than the longest
    lever arm, which is the row's largest entry. It vanishes with the error, and makes
    the step a descent where a target cannot be reached (Levenberg-Marquardt with a
    bound in place of a guess). Return whether all rows are finite. Joint poses are
    current.
    """
    mu, total, diagonal, tasks = damping, 0.0, level.qp.diagonal, level.tasks
    state, robot = parts.state[0], parts.robot
    errors, jacobians, own, kernels = (
        level.error,
        level.jacobian,
        parts.own[0],
        parts.kernels,
    )
    for t in range(tasks.shape[0]):
        task = tasks[t]
        rows, numbers = slice(task.row, task.end), own[task.first : task.last]
        kernels[task.kernel](robot, numbers, dt, jacobians[rows], errors[rows])
        bending, size = _weigh_rows(level, t, task, state, dt)
        mu += curvature * bending
        total += size
    copy_rows(level.bias, diagonal)
    joint_tasks, joint_errors = level.joint_tasks, level.joint_error
    for t in range(joint_tasks.shape[0]):
        task, error = joint_tasks[t], joint_errors[t]
        numbers = own[task.first : task.last]
        kernels[task.kernel](robot, numbers, dt, jacobians[:0], error)
        _add_joint_task(task, error, level.squared_cost[t], diagonal, dt)
        if not task.is_finite:
            state.all_finite = 0.0
    for i in range(diagonal.shape[1]):
        total += abs(diagonal[0, i]) + abs(diagonal[1, i])
    level.qp.mu[0] = mu
    return bool(np.isfinite(mu + total))


@inner
def _weigh_rows(
    level: LevelArrays, t: int, task: CompiledRecords, state: CompiledRecords, dt: float
) -> tuple[float, float]:
    """Write the weighted rows of a task, `W = cost J` and `e = cost saturated step`.

    Return `sum |e| max|W|` over the rows, and the sum of all sizes.
    """
    errors, jacobian, costs, qp = level.error, level.jacobian, level.cost, level.qp
    all_W, steps, middle, finite = qp.W, qp.e, task.angle, True
    scale = np.empty(2)
    for part in range(2):
        square = 0.0
        first = middle if part == 1 else task.row
        for row in range(first, task.end if part == 1 else middle):
            square += errors[row] ** 2
        length, limit = np.sqrt(square), task.speed[part] * dt
        level.distances[t, part] = length
        finite &= length < LARGEST_FINITE
        scale[part] = task.gain if task.gain * length <= limit else limit / length
    task.is_finite = finite
    if not finite:
        level.distances[t, 0] = level.distances[t, 1] = np.nan
        state.all_finite = 0.0
    bending, total = 0.0, 0.0
    for row in range(task.row, task.end):
        cost, longest, e = costs[row], 0.0, 0.0
        W, J = all_W[row], jacobian[row]
        for i in range(W.shape[0]):
            weighted = cost * J[i]
            W[i] = weighted
            total += abs(weighted)
            longest = max(longest, abs(weighted))
        if finite:
            e = cost * scale[0 if row < middle else 1] * errors[row]
        steps[row] = e
        total += abs(e)
        bending += abs(e) * longest
    return bending, total


@inner
def _add_joint_task(
    task: CompiledRecords, error: Vector, weight: Vector, diagonal: Matrix, dt: float
) -> None:
    """Add squared costs to the diagonal, and squared costs times saturated steps."""
    total, limit, gain = 0.0, task.speed[0] * dt, task.gain
    for i in range(error.shape[0]):
        if weight[i] > 0.0:
            total += error[i]
    task.is_finite = bool(np.isfinite(total))
    for i in range(error.shape[0]):
        if weight[i] > 0.0:
            diagonal[0, i] += weight[i]
            if task.is_finite:
                step = min(max(gain * error[i], -limit), limit)
                diagonal[1, i] += weight[i] * step
