"""One tick of a stack in one compiled call.

`solve_tick` computes forward kinematics, task rows, bounds and limit rows, and solves
all levels by the active set of the last tick. Where a level is not solved it returns:
the caller solves that level by other means, writes the result into the level's `qp`,
calls `finish_level`, and calls `solve_tick` again for the levels below.
"""

from collections.abc import Callable
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from wbc_suite.compiling import (
    as_argument,
    by_address,
    compiled,
    compiled_inline,
    inner,
    struct,
)
from wbc_suite.kinematics.forward import RobotArrays, compute_joint_poses
from wbc_suite.linear_algebra import copy_vector
from wbc_suite.qp.active_set import QpArrays, solve_warm
from wbc_suite.qp.constraints import Constraints
from wbc_suite.qp.equality import HeldFrames, hold_frames
from wbc_suite.qp.floor_limit import SphereArrays, floor_rows
from wbc_suite.qp.limit import JointBounds, merge_bounds
from wbc_suite.qp.obstacle_limit import ObstacleArrays, obstacle_rows
from wbc_suite.qp.overshoot import OvershootArrays, damp_overshoot
from wbc_suite.qp.problem import UNBOUNDED, worst_violation
from wbc_suite.qp.self_collision_rows import CapsuleArrays, self_collision_rows
from wbc_suite.qp.strict_level import LevelArrays, restrict_level
from wbc_suite.qp.task_kernels import TaskArrays, write_tasks
from wbc_suite.typing import Indices, Matrix, Vector

TOLERANCE = 1e-7  # m or rad; a step that violates a row or bound by more is not taken
RETURN_WEIGHT = 1e2  # of a soft row, against the stiffest joint's cost
_PRESSURE_MEMORY = 0.2  # s, in which the damping by rows falls to 1 / e
_PRESSURE_MAX = 1e6  # times what tasks pull with


class TickStatus(IntEnum):
    """How `solve_tick` ended."""

    SOLVED = 0
    UNSOLVED = 1  # a level is stated, and its active set was not found
    BAD_ROWS = 2  # rows of a level are not finite
    BAD_POSITION = 3  # the configuration is not finite
    NEEDS_PYTHON = 4  # tasks or limits without a kernel must be evaluated before


@struct
class TickKernels(NamedTuple):
    """Kernels of a tick by their addresses; what a stack does not use does nothing.

    Attributes:
        write_tasks: See `task_kernels`.
        solve: See `active_set`.
        restrict: See `strict_level`.
        collision: See `self_collision_rows`.
        floor: See `floor_limit`.
        obstacles: See `obstacle_limit`.
        hold: See `equality`.
    """

    write_tasks: Callable[..., bool]
    solve: Callable[..., bool]
    restrict: Callable[..., None]
    collision: Callable[..., None]
    floor: Callable[..., None]
    obstacles: Callable[..., None]
    hold: Callable[..., None]


@struct
class TickArrays(NamedTuple):
    """What a tick reads and writes: p inequality rows, k equality rows.

    `levels` holds the strict levels, the first first; the last is repeated up to
    `MAX_LEVELS`, so that machine code does not depend on their number. `prepared` is 1
    where Python has evaluated what has no kernel, or nothing has none; a tick sets it
    back to the second entry.
    """

    kernels: TickKernels
    robot: RobotArrays  # its q is where the tick begins
    levels: tuple[LevelArrays, ...]
    level_count: int
    bounds: JointBounds
    kinds: Indices  # (2 nv,), output: `LimitKind` of each lower, then each upper bound
    v: Vector  # (nv,), in and out: velocity of the last step
    x: Vector  # (nv,), output: the step
    residual: Vector  # (1,), output: greatest violation of the first level's rows
    all_finite: Vector  # (1,), output: whether the targets of all tasks are finite
    solved: Indices  # (1,), output: number of solved levels
    relax_speed: Vector  # (p,), `RowLimit.relax_speed` of each inequality row
    pressure_damping: Vector  # (1,), damping by the rows that tasks press against
    overshoot: OvershootArrays
    held: HeldFrames  # frames of equality rows
    rate: Vector  # (k,), right-hand side of constant equality rows per second, else NaN
    capsules: CapsuleArrays  # of the self-collision limit
    collision_rows: Indices  # (2,), its first inequality row and the end
    spheres: SphereArrays  # of the floor limit
    floor_rows: Indices  # (2,), its first inequality row and the end
    obstacles: ObstacleArrays  # of the obstacle limit
    obstacle_rows: Indices  # (2,), its first inequality row and the end
    prepared: Indices  # (2,)
    damping: float  # Tikhonov term, [cost]^2/rad^2
    curvature: float  # see `write_tasks`
    warm: bool  # whether the active set of the last tick is tried


def bind_kernels(
    robot: RobotArrays,
    first: LevelArrays,
    levels: tuple[LevelArrays, ...],
    rows: Constraints,
    *,
    strict: bool,
) -> TickKernels:
    """Return the kernels that a stack needs, as its argument.

    Args:
        robot: The robot, as kernels get it.
        first: The first level.
        levels: All levels, as kernels get them.
        rows: Limits and equalities.
        strict: Whether there are several levels.
    """
    tasks, qp, n = first.tasks, first.qp, 1
    matrix, vector = np.zeros((n, n)), np.zeros(n)

    def rows_of(kernel: Any, arrays: Any, is_used: bool | np.bool) -> Any:
        used = kernel if is_used else no_rows
        return by_address(used, robot, arrays, 0.0, matrix, vector)

    collision, floor = rows.collision_rows.any(), rows.floor_rows.any()
    found = TickKernels(
        write_tasks=by_address(write_tasks, robot, tasks, 0.0, 0.0, 0.0),
        solve=by_address(solve_warm, qp),
        restrict=by_address(restrict_level if strict else no_level, levels, n, vector),
        collision=rows_of(self_collision_rows, rows.collision.argument, collision),
        floor=rows_of(floor_rows, rows.floor.argument, floor),
        obstacles=rows_of(
            obstacle_rows, rows.obstacles.argument, rows.obstacle_rows.any()
        ),
        hold=rows_of(hold_frames, rows.held, len(rows.held_arrays.target) > 0),
    )
    return as_argument(found)


@inner
def no_level(levels: tuple[LevelArrays, ...], k: int, x: Vector) -> None:
    """Do nothing: there is one level."""


@inner
def no_rows(robot: RobotArrays, arrays: Any, dt: float, G: Matrix, h: Vector) -> None:
    """Do nothing: there are no such rows."""


@compiled
def solve_tick(tick: TickArrays, dt: float, start: int) -> tuple[int, int]:
    """Solve the levels from `start` on; 0 begins a tick, of dt seconds.

    Return a `TickStatus`, and the level at which it ended. The step is then in `tick.x`
    and `tick.v`.
    """
    if start == 0 and not tick.prepared[0]:
        return TickStatus.NEEDS_PYTHON.value, 0
    tick.prepared[0] = tick.prepared[1]
    levels, kernels, count, x, v = (
        tick.levels,
        tick.kernels,
        tick.level_count,
        tick.x,
        tick.v,
    )
    robot, curvature = tick.robot, tick.curvature
    for k in range(start, count):
        level, damping = levels[k], tick.damping
        if k == 0:
            if not _begin_tick(tick, dt):
                return TickStatus.BAD_POSITION.value, 0
            past, held = tick.overshoot, tick.held
            damping += tick.pressure_damping[0]
            damping += damp_overshoot(past, levels, count, held, v, dt)
        else:
            kernels.restrict(levels, k, x)
            damping = levels[k - 1].tasks.mu[0]
        tasks, qp = level.tasks, level.qp
        if not kernels.write_tasks(robot, tasks, dt, damping, curvature):
            return TickStatus.BAD_ROWS.value, k
        if k == 0 and qp.counts[0] > 0:  # the cost of soft rows
            qp.weight[0] = RETURN_WEIGHT * stiffness(tasks)
        if not tick.warm or not kernels.solve(qp) or not _is_feasible(tick, k):
            return TickStatus.UNSOLVED.value, k
        finish_level(tick, k, dt, True)
    for i in range(x.shape[0]):
        v[i] = x[i] / dt
    if start > 0:
        tick.residual[0] = _violation(x, levels[0].qp)
    return TickStatus.SOLVED.value, count


@compiled
def finish_level(tick: TickArrays, k: int, dt: float, kept: bool) -> None:
    """Take the solution of level k, in `qp.x` and `qp.multipliers`, as the step.

    `kept` is whether its rows were; those that are relaxed do not damp the next tick.
    """
    qp, damping = tick.levels[k].qp, tick.pressure_damping
    tick.solved[0] = k + 1
    copy_vector(qp.x, tick.x)
    if k == 0 and qp.rows.shape[0] > 0:
        damping[0] *= np.exp(-dt / _PRESSURE_MEMORY)
        if kept:
            damping[0] = max(damping[0], tick.curvature * _row_pressure(qp))


@compiled_inline
def _begin_tick(tick: TickArrays, dt: float) -> bool:
    """Write bounds and limit rows; return whether the configuration is finite."""
    robot, qp, total = tick.robot, tick.levels[0].qp, 0.0
    tick.solved[0], tick.all_finite[0] = 0, 1.0
    q, upper = robot.q, qp.upper
    for i in range(q.shape[0]):
        total += q[i]
    if not np.isfinite(total):
        return False
    nv = tick.x.shape[0]
    lower, upper = qp.lower[:nv], upper[:nv]
    merge_bounds(tick.bounds, q, tick.v, dt, lower, upper, tick.kinds)
    if qp.rows.shape[0] > 0:
        compute_joint_poses(robot)
        _write_rows(tick, qp, dt)
    return True


@compiled_inline
def _write_rows(tick: TickArrays, qp: QpArrays, dt: float) -> None:
    """Write the rows of limits and equalities that have a kernel; relax all limits.

    A row outside its limit, h < 0, does not bind to come back, or rows could demand
    more than joints can do: it wants to, softly, and binds to go no further out. So a
    robot that stands is never asked to move. Far outside it may be relaxed further,
    see `RowLimit.relax_speed`.
    """
    counts, nv, upper, lower = qp.counts, tick.x.shape[0], qp.upper, qp.lower
    p, k, relax_speed, rate = counts[0], counts[1], tick.relax_speed, tick.rate
    robot, h, soft = tick.robot, upper[nv : nv + p], qp.wanted
    kernels, G = tick.kernels, qp.rows
    place = tick.collision_rows
    first, last = place[0], place[1]
    kernels.collision(robot, tick.capsules, dt, G[first:last], h[first:last])
    place = tick.floor_rows
    first, last = place[0], place[1]
    kernels.floor(robot, tick.spheres, dt, G[first:last], h[first:last])
    place = tick.obstacle_rows
    first, last = place[0], place[1]
    kernels.obstacles(robot, tick.obstacles, dt, G[first:last], h[first:last])
    for row in range(p):
        wanted = h[row]
        h[row] = max(wanted, 0.0, -2.0 * (wanted + relax_speed[row] * dt))
        soft[row] = min(wanted, UNBOUNDED)
    b = upper[nv + p :]
    for row in range(k):
        if np.isfinite(rate[row]):
            b[row] = rate[row] * dt
    kernels.hold(robot, tick.held, dt, G[p:], b)
    for row in range(k):
        lower[nv + p + row] = b[row]


@compiled
def stiffness(tasks: TaskArrays) -> float:
    """Return the largest entry of H without damping, or 1."""
    stiffest, W, diagonal = 1.0, tasks.W, tasks.diagonal
    for i in range(diagonal.shape[1]):
        total = diagonal[0, i]
        for row in range(W.shape[0]):
            total += W[row, i] ** 2
        stiffest = max(stiffest, total)
    return stiffest


@inner
def _row_pressure(qp: QpArrays) -> float:
    """Return `sum |nu| max|A|` over the rows A that tasks press on with forces nu.

    Rows bend as tasks do: it bounds the curvature of `nu . A(q)`, and damps the next
    tick. Where rows nearly depend on each other, rounding alone presses in proportion
    to the damping, and both would grow for ever: a multiple of what the tasks pull
    with is the most.
    """
    n, greatest, total = qp.x.shape[0], 0.0, 0.0
    rows, W, e, counts, multipliers = qp.rows, qp.W, qp.e, qp.counts, qp.multipliers
    diagonal = qp.diagonal
    for row in range(counts[0] + counts[1]):
        if multipliers[n + row] != 0.0:
            longest = 0.0
            for i in range(n):
                longest = max(longest, abs(rows[row, i]))
            total += abs(multipliers[n + row]) * longest
    if total > 0.0:
        for i in range(n):
            pull = diagonal[1, i]
            for row in range(e.shape[0]):
                pull += W[row, i] * e[row]
            greatest += _PRESSURE_MAX * abs(pull)
    return min(total, greatest)


@inner
def _violation(x: Vector, qp: QpArrays) -> float:
    """Return by how much x violates the bounds and rows of a problem."""
    counts = qp.counts
    size = counts[0] + counts[1]
    if size == 0:  # bounds are kept by clipping
        return 0.0
    end = x.shape[0] + size
    return worst_violation(x, qp.rows[:size], qp.lower[:end], qp.upper[:end])


@inner
def _is_feasible(tick: TickArrays, k: int) -> bool:
    """Return whether a level's solution keeps its own rows and the first level's.

    Rows longer than 1 are more sensitive than their orthonormal basis.
    """
    levels, own = tick.levels, 0.0
    qp = levels[k].qp
    if k > 0:
        own = _violation(qp.x, qp)
    first = _violation(qp.x, levels[0].qp)
    tick.residual[0] = first
    return own <= TOLERANCE and first <= TOLERANCE
