"""One tick of a stack in one compiled call.

`solve_tick` computes forward kinematics, task rows, bounds and limit rows, and solves
all levels by the active set of the last tick. Where a level is not solved it returns:
the caller solves that level by other means, writes the result into the level's `qp`,
says so in `state.taken`, and calls `solve_tick` again for the levels below.
"""

from collections.abc import Callable
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from wbc_suite.compiling import by_address, compiled, inner, struct
from wbc_suite.kinematics.forward import RobotArrays, compute_joint_poses
from wbc_suite.linear_algebra import copy_vector
from wbc_suite.qp.active_set import QpArrays, solve_warm
from wbc_suite.qp.joint_window import merge_bounds
from wbc_suite.qp.problem import UNBOUNDED, worst_violation
from wbc_suite.qp.strict_level import restrict_level
from wbc_suite.qp.task_rows import LevelArrays, PartArrays, write_tasks
from wbc_suite.typing import CompiledRecords, Indices, Matrix, Vector

TOLERANCE = 1e-7  # m or rad; a step that violates a row or bound by more is not taken
RETURN_WEIGHT = 1e2  # of a soft row, against the stiffest joint's cost
_PRESSURE_MEMORY = 0.2  # s, in which the damping by rows falls to 1 / e
_PRESSURE_MAX = 1e6  # times what tasks pull with
_CHANGE = 5e-4  # rad/s or m/s; smaller changes of a speed are no overshoot
_GROWTH = 0.2  # of all damping, that one such tick adds
_FADING = 0.05  # s, in which the damping falls to 1 / e while targets move
_REST = 0.3  # of the time of rest, which is added to that
_MOST = 1e6  # times the stiffest joint's cost


class TickStatus(IntEnum):
    """How `solve_tick` ended."""

    SOLVED = 0
    UNSOLVED = 1  # a level is stated, and its active set was not found
    BAD_ROWS = 2  # rows of a level are not finite
    BAD_POSITION = 3  # the configuration is not finite
    NEEDS_PYTHON = 4  # tasks or limits without a kernel must be evaluated before


class Taken(IntEnum):
    """How a level was solved."""

    NOT = 0  # the step is that of the levels above
    RELAXED = 1  # by Python, without its rows, which do not damp the next tick
    BY_PYTHON = 2
    BY_KERNEL = 3


@struct
class TickArrays(NamedTuple):
    """What a tick reads and writes: p inequality rows, k equality rows.

    Kernels that a stack does not need do nothing.
    """

    place_joints: Callable[..., None]  # see `kinematics.forward`
    write_tasks: Callable[..., bool]  # see `task_rows`
    write_rows: Callable[..., bool]
    restrict: Callable[..., bool]  # see `strict_level`
    weigh: Callable[..., bool]  # `weigh_rows`
    solve: Callable[..., bool]  # see `active_set`
    keep: Callable[..., bool]  # `keep_rows`
    press: Callable[..., bool]  # `press_rows`
    robot: RobotArrays  # its q is where the tick begins
    parts: PartArrays
    bounds: CompiledRecords  # (nv,) `limit.BOUND`
    kinds: Indices  # (2 nv,), output: `LimitKind` of each lower, then each upper bound
    v: Vector  # (nv,), in and out: velocity of the last step
    x: Vector  # (nv,), output: the step
    before: Matrix  # (2, nv), velocity of the last tick, and how it had changed
    targets: Vector  # numbers of tasks and equalities at the last tick


def bind_kernels(
    robot: RobotArrays,
    parts: PartArrays,
    level: LevelArrays,
    qp: QpArrays,
    *,
    has_rows: bool,
    is_strict: bool,
) -> dict[str, Any]:
    """Return the kernels that a stack needs, by the fields of `TickArrays`.

    Args:
        robot: The robot, as kernels get it.
        parts: Tasks, limits and equalities, as kernels get them.
        level: The first level, as kernels get it.
        qp: Its problem, as kernels get it.
        has_rows: Whether there are limits or equalities with rows.
        is_strict: Whether there are several levels.
    """

    def step(kernel: Any, is_used: bool) -> Any:
        return by_address(kernel if is_used else do_nothing, parts, 1, 0.0)

    tasks = parts, level, 0.0, 0.0, 0.0
    return {
        "place_joints": by_address(compute_joint_poses, robot),
        "write_tasks": by_address(write_tasks, *tasks),
        "write_rows": step(write_rows, has_rows),
        "restrict": step(restrict_level, is_strict),
        "weigh": step(weigh_rows, has_rows),
        "solve": by_address(solve_warm, qp),
        "keep": step(keep_rows, has_rows or is_strict),
        "press": step(press_rows, has_rows),
    }


@inner
def do_nothing(parts: PartArrays, k: int, dt: float) -> bool:
    """Return True: the stack does not need this."""
    return True


@compiled
def solve_tick(tick: TickArrays, dt: float, start: int) -> tuple[int, int]:
    """Solve the levels from `start` on; 0 begins a tick, of dt seconds.

    Return a `TickStatus`, and the level at which it ended. The step is then in `tick.x`
    and `tick.v`.
    """
    parts, x, v = tick.parts, tick.x, tick.v
    levels, state = parts.levels, parts.state[0]
    if start == 0:
        if not state.prepared:
            return TickStatus.NEEDS_PYTHON.value, 0
        state.prepared = state.alone
        if not _begin_tick(tick, state, levels[0].qp, dt):
            return TickStatus.BAD_POSITION.value, 0
        tick.place_joints(tick.robot)
        tick.write_rows(parts, 0, dt)
        _damp_overshoot(tick, state, levels[0].qp.mu[0], dt)
    elif state.taken != Taken.NOT:
        _take(tick, state.solved, dt)
    for k in range(start, state.levels):
        damping = state.damping + state.pressure_damping + state.overshoot_damping
        if k > 0:
            tick.restrict(parts, k, dt)
            damping = levels[k - 1].qp.mu[0]
        if not tick.write_tasks(parts, levels[k], dt, damping, state.curvature):
            return TickStatus.BAD_ROWS.value, k
        tick.weigh(parts, k, dt)
        is_solved = state.warm and tick.solve(levels[k].qp)
        if not is_solved or not tick.keep(parts, k, dt):
            return TickStatus.UNSOLVED.value, k
        state.taken = Taken.BY_KERNEL.value
        _take(tick, k, dt)
    for i in range(x.shape[0]):
        v[i] = x[i] / dt
    return TickStatus.SOLVED.value, state.levels


@inner
def _begin_tick(
    tick: TickArrays, state: CompiledRecords, qp: QpArrays, dt: float
) -> bool:
    """Write the bounds; return whether the configuration is finite."""
    q, v, kinds, total = tick.robot.q, tick.v, tick.kinds, 0.0
    state.solved, state.all_finite, state.residual = 0, 1.0, 0.0
    for i in range(q.shape[0]):
        total += q[i]
    if not np.isfinite(total):
        return False
    nv = v.shape[0]
    merge_bounds(tick.bounds, q, v, dt, qp.lower[:nv], qp.upper[:nv], kinds)
    return True


@inner
def _take(tick: TickArrays, k: int, dt: float) -> None:
    """Take the solution of level k as the step."""
    parts = tick.parts
    parts.state[0].solved = k + 1
    copy_vector(parts.levels[k].qp.x, parts.x)
    tick.press(parts, k, dt)


@inner
def _damp_overshoot(
    tick: TickArrays, state: CompiledRecords, mu: float, dt: float
) -> None:
    """Let damping grow while a stack at rest overshoots, and fade.

    A step that is too long for what its rows leave out passes the optimum, and the next
    one comes back: speeds that change to and fro from tick to tick. Curvature of tasks
    is bounded beforehand, see `task_rows.write_tasks`; that of strict levels in each
    other's null spaces, of singular postures and of active sets that alternate is not.
    So while targets rest, each such tick doubles the damping of all levels, and it
    fades afterwards: the robot settles, or creeps at the pace at which it does not
    overshoot.
    """
    v, before, kept, now = tick.v, tick.before, tick.targets, tick.parts.own[0]
    moved = overshoots = False
    for i in range(kept.shape[0]):
        old, new = kept[i], now[i]
        moved |= old != new and (old == old or new == new)  # NaN rests
        kept[i] = new
    for i in range(v.shape[0]):
        overshoots |= turned(v[i], before[0, i], before[1, i])
        before[0, i], before[1, i] = v[i], v[i] - before[0, i]
    state.at_rest = 0.0 if moved else state.at_rest + dt
    fading = np.exp(-dt / (_FADING + _REST * state.at_rest))
    damping = state.overshoot_damping * fading
    if overshoots and not moved:
        damping = min(damping + _GROWTH * mu, _MOST)
    state.overshoot_damping = damping


@inner
def turned(v: float, before: float, change: float) -> bool:
    """Return whether a joint of velocity v turns back, after it had just done so.

    `before` is its velocity at the last tick, `change` how that had changed.
    """
    now = v - before
    to_and_fro = now * change < 0.0 and v * before < 0.0
    return to_and_fro and min(abs(now), abs(change)) > _CHANGE


@inner
def write_rows(parts: PartArrays, k: int, dt: float) -> bool:
    """Write the rows of limits and equalities that have a kernel; relax all limits.

    A row outside its limit, h < 0, does not bind to come back, or rows could demand
    more than joints can do: it wants to, softly, and binds to go no further out. So a
    robot that stands is never asked to move. Far outside it may be relaxed further,
    see `RowLimit.relax_speed`. Return True.
    """
    qp, nv, own = parts.levels[0].qp, parts.x.shape[0], parts.own
    kernels = parts.kernels
    rows, upper, lower, soft = qp.rows, qp.upper[nv:], qp.lower[nv:], qp.wanted
    for t in range(parts.rows.shape[0]):
        part = parts.rows[t]
        row, end = part.row, part.end
        numbers = own[int(part.own)][part.first : part.last]
        kernels[part.kernel](parts.robot, numbers, dt, rows[row:end], upper[row:end])
        for i in range(row, end):
            wanted = upper[i]
            if np.isnan(part.relax_speed):  # an equality
                lower[i] = wanted
            else:
                furthest = -2.0 * (wanted + part.relax_speed * dt)
                upper[i] = max(wanted, 0.0, furthest)
                soft[i] = min(wanted, UNBOUNDED)
    return True


@inner
def weigh_rows(parts: PartArrays, k: int, dt: float) -> bool:
    """Write the cost of soft rows, which the first level has. Return True."""
    qp = parts.levels[k].qp
    qp.weight[0] = RETURN_WEIGHT * stiffness(qp)
    return True


@inner
def keep_rows(parts: PartArrays, k: int, dt: float) -> bool:
    """Return whether the solution of level k keeps all rows.

    Those are its own and the first level's: rows longer than 1 are more sensitive than
    their orthonormal basis.
    """
    levels, own, state = parts.levels, 0.0, parts.state[0]
    first, qp = levels[0].qp, levels[k].qp
    if k > 0:
        own = _violation(qp.x, qp)
    state.residual = _violation(qp.x, first)
    return bool(own <= TOLERANCE and state.residual <= TOLERANCE)


@inner
def stiffness(qp: QpArrays) -> float:
    """Return the largest entry of H without damping, or 1."""
    stiffest, W, diagonal = 1.0, qp.W, qp.diagonal
    for i in range(diagonal.shape[1]):
        total = diagonal[0, i]
        for row in range(W.shape[0]):
            total += W[row, i] ** 2
        stiffest = max(stiffest, total)
    return stiffest


@inner
def _violation(x: Vector, qp: QpArrays) -> float:
    """Return by how much x violates the bounds and rows of a problem."""
    size = qp.counts[0] + qp.counts[1]
    if size == 0:  # bounds are kept by clipping
        return 0.0
    end = x.shape[0] + size
    return worst_violation(x, qp.rows[:size], qp.lower[:end], qp.upper[:end])


@inner
def press_rows(parts: PartArrays, k: int, dt: float) -> bool:
    """Let rows that tasks press against damp the next tick.

    The damping is `sum |nu| max|A|` over the rows A that tasks press on with forces nu.
    Rows bend as tasks do: it bounds the curvature of `nu . A(q)`. Where rows nearly
    depend on each other, rounding alone presses in proportion to the damping, and both
    would grow for ever: a multiple of what the tasks pull with is the most. Return
    True.
    """
    qp, state = parts.levels[0].qp, parts.state[0]
    if state.taken != Taken.BY_KERNEL:
        state.residual = _violation(parts.x, qp)
    if k > 0:
        return True
    state.pressure_damping *= np.exp(-dt / _PRESSURE_MEMORY)
    if state.taken == Taken.RELAXED:
        return True
    n, greatest, total = parts.x.shape[0], 0.0, 0.0
    rows, W, e, diagonal = qp.rows, qp.W, qp.e, qp.diagonal
    forces = qp.multipliers[n:]
    for row in range(qp.counts[0] + qp.counts[1]):
        if forces[row] != 0.0:
            longest = 0.0
            for i in range(n):
                longest = max(longest, abs(rows[row, i]))
            total += abs(forces[row]) * longest
    if total > 0.0:
        for i in range(n):
            pull = diagonal[1, i]
            for row in range(e.shape[0]):
                pull += W[row, i] * e[row]
            greatest += _PRESSURE_MAX * abs(pull)
    pressure = state.curvature * min(total, greatest)
    state.pressure_damping = max(state.pressure_damping, pressure)
    return True
