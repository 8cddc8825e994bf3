"""Damping that grows while a stack at rest overshoots.

A step that is too long for what its rows leave out passes the optimum, and the next
one comes back: speeds that change to and fro from tick to tick. Curvature of tasks is
bounded beforehand, see `task_kernels.write_tasks`; that of strict levels in each
other's null spaces, of singular postures and of active sets that alternate is not. So
while targets rest, each such tick doubles the damping of all levels, and it fades
afterwards: the robot settles, or creeps at the pace at which it does not overshoot.
"""

from typing import NamedTuple

import numpy as np

from wbc_suite.compiling import inner, struct
from wbc_suite.qp.equality import HeldFrames
from wbc_suite.qp.strict_level import LevelArrays
from wbc_suite.typing import Matrix, Vector

_CHANGE = 5e-4  # rad/s or m/s; smaller changes of a speed are no overshoot
_GROWTH = 0.2  # of all damping, that one such tick adds
_FADING = 0.05  # s, in which the damping falls to 1 / e while targets move
_REST = 0.3  # of the time of rest, which is added to that
_MOST = 1e6  # times the stiffest joint's cost


@struct
class OvershootArrays(NamedTuple):
    """What a tick remembers of the last ones."""

    damping: Vector  # (1,), [cost]^2/rad^2, added to that of all levels
    before: Matrix  # (2, nv), velocity of the last tick, and how it had changed
    targets: Vector  # of all tasks with a kernel, and of held frames
    at_rest: Vector  # (1,), s since one of them moved


@inner
def damp_overshoot(
    past: OvershootArrays,
    levels: tuple[LevelArrays, ...],
    count: int,
    held: HeldFrames,
    v: Vector,
    dt: float,
) -> float:
    """Return the damping of the next step, after the step of velocity v."""
    place, moved = 0, False
    for k in range(count):
        tasks = levels[k].tasks
        place, moved = _keep(past.targets, place, tasks.target, moved)
        place, moved = _keep(past.targets, place, tasks.joint_target, moved)
    place, moved = _keep(past.targets, place, held.target, moved)
    past.at_rest[0] = 0.0 if moved else past.at_rest[0] + dt
    overshoots, before = False, past.before
    for i in range(v.shape[0]):
        overshoots |= turned(v[i], before[0, i], before[1, i])
        before[0, i], before[1, i] = v[i], v[i] - before[0, i]
    damping = past.damping[0] * np.exp(-dt / (_FADING + _REST * past.at_rest[0]))
    if overshoots and not moved:
        damping = min(damping + _GROWTH * levels[0].tasks.mu[0], _MOST)
    past.damping[0] = damping
    return damping


@inner
def turned(v: float, before: float, change: float) -> bool:
    """Return whether a joint of velocity v turns back, after it had just done so.

    `before` is its velocity at the last tick, `change` how that had changed.
    """
    now = v - before
    to_and_fro = now * change < 0.0 and v * before < 0.0
    return to_and_fro and min(abs(now), abs(change)) > _CHANGE


@inner
def _keep(kept: Vector, place: int, now: Matrix, moved: bool) -> tuple[int, bool]:
    """Copy targets to their place; return the next one, and if any has moved."""
    for i in range(now.shape[0]):
        for j in range(now.shape[1]):
            old, value = kept[place], now[i, j]
            moved |= old != value and (old == old or value == value)  # NaN rests
            kept[place] = value
            place += 1
    return place, moved
