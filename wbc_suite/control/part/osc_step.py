"""Steps of a hand's goal, compiled: what `osc_goal` says, in 3 us for 120.

Poses are rotation (row by row) and position, shape (12,), as in a law's record.
"""

from enum import IntEnum

import numpy as np

from wbc_suite.compiling import compiled, compiled_inner
from wbc_suite.control.loop.motion import rotate
from wbc_suite.control.loop.table import CompiledRecords
from wbc_suite.kinematics.array_table import indices, matrix, vector
from wbc_suite.qp.lie import exp3, log3
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["GoalField", "bound_goal", "jump", "move_goal", "relative_pose", "take_step"]

NOTHING = 1e-12
"""m or rad; rounding of a step that is none."""


class GoalField(IntEnum):
    """Places of arrays in the table of `move_goal`."""

    GOAL = 0
    START = 1
    GAIN = 2
    OFFSET = 3
    R_BODY = 4
    P_BODY = 5
    R_SITE = 6
    P_SITE = 7
    POSITION = 8
    TURN = 9
    RULES = 10


@compiled
def move_goal(values: Vector, table: Indices, record: CompiledRecords) -> None:
    """Move a goal by an action's step, and let its law jump there.

    The step is `offset + gain values`; one of nothing leaves the goal where it is.

    Args:
        values: Of the action, shape (6,) or (3,).
        table: An `ArrayTable` of `GoalField`; see `take_step` and `relative_pose`.
        record: The law's, shape (1,).
    """
    goal, start, rules = vector(table, 0), vector(table, 1), indices(table, 10)
    gain, offset, step = vector(table, 2), vector(table, 3), np.zeros(6)
    moves = False
    for i in range(values.shape[0]):
        step[i] = offset[i] + gain[i] * values[i]
        moves = moves or step[i] != 0.0
    if moves:
        R_body, p_body = vector(table, 4), vector(table, 5)
        R_site, p_site = vector(table, 6), vector(table, 7)
        position, turn = matrix(table, 8), matrix(table, 9)
        now, in_hand, from_hand = np.empty(12), rules[0] > 0, rules[1] > 0
        relative_pose(R_body, p_body, R_site, p_site, now)
        take_step(goal, step, now, (in_hand, from_hand), start, position, turn)
    jump(record, goal)


@compiled
def jump(record: CompiledRecords, goal: Vector) -> None:
    """Let a law's target be at a goal, shape (12,), at once."""
    law = record[0]
    for i in range(12):
        law.start[i] = goal[i]
    for i in range(3):
        law.shift[i] = law.turn[i] = 0.0
    law.since = law.duration = 0.0


@compiled
def take_step(
    goal: Vector,
    step: Vector,
    now: Vector,
    rules: tuple[bool, bool],
    start: Vector,
    position: Matrix,
    turn: Matrix,
) -> None:
    """Move a goal by a step and into its limits, in place.

    Args:
        goal: Pose, shape (12,).
        step: Linear, then a rotation vector, shape (6,).
        now: Where the hand is, shape (12,).
        rules: Whether the step's axes are the goal's own, or the reference's; whether
            it counts from the hand where it moves, or from the goal.
        start: Orientation that turns are limited from, shape (9,).
        position: Limits of the position, shape (2, 3).
        turn: Limits of the rotation vector from the start, shape (2, 3).
    """
    in_hand, from_hand = rules
    axes = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            axes[i, j] = 1.0 if i == j else 0.0
            if in_hand:
                axes[i, j] = goal[3 * i + j]
    if from_hand:
        step_origin(goal, now, step, axes)
    step_goal(goal, step, axes)
    bound_goal(goal, start, position, turn)


@compiled_inner
def step_goal(goal: Vector, step: Vector, axes: Matrix) -> None:
    """Move a goal by a step along axes, in place; see `osc_goal.stepped`."""
    linear, angular = np.empty(3), np.empty(3)
    rotate(axes, step[:3], linear)
    rotate(axes, step[3:], angular)
    _turn(goal, angular)
    for i in range(3):
        goal[9 + i] += linear[i]


@compiled_inner
def step_origin(goal: Vector, now: Vector, step: Vector, axes: Matrix) -> None:
    """Take the hand's pose where a step moves it, in place; see `osc_goal`."""
    away, offset, origin = np.empty((3, 3)), np.empty(6), np.zeros(6)
    _turn_between(goal, now, away)
    log3(away, offset[3:])
    for i in range(3):
        offset[i] = now[9 + i] - goal[9 + i]
    for i in range(6):
        if abs(step[i]) > NOTHING:
            k = i - i % 3
            for j in range(3):
                origin[i] += axes[j, i - k] * offset[k + j]
    step_goal(goal, origin, axes)


@compiled
def bound_goal(goal: Vector, start: Vector, position: Matrix, turn: Matrix) -> None:
    """Move a goal into its limits, in place; see `osc_goal.GoalLimits.nearest`.

    Args:
        goal: Pose, shape (12,).
        start: Orientation that turns are limited from, shape (9,).
        position: Limits of the position, shape (2, 3).
        turn: Limits of the rotation vector from the start, shape (2, 3).
    """
    bounded_turn = False
    for i in range(3):
        goal[9 + i] = min(max(goal[9 + i], position[0, i]), position[1, i])
        bounded_turn = bounded_turn or turn[0, i] > -np.inf or turn[1, i] < np.inf
    if not bounded_turn:
        return
    away, wanted = np.empty((3, 3)), np.empty(3)
    _turn_between(start, goal, away)
    log3(away, wanted)
    outside = False
    for i in range(3):
        bounded = min(max(wanted[i], turn[0, i]), turn[1, i])
        outside = outside or bounded != wanted[i]
        wanted[i] = bounded
    if outside:
        for i in range(9):
            goal[i] = start[i]
        _turn(goal, wanted)


@compiled
def relative_pose(
    R_body: Vector, p_body: Vector, R: Vector, p: Vector, out: Vector
) -> None:
    """Write a pose in a body's axes, from both in the world, (9,) and (3,) each."""
    for i in range(3):
        out[9 + i] = 0.0
        for k in range(3):
            out[9 + i] += R_body[3 * k + i] * (p[k] - p_body[k])
        for j in range(3):
            out[3 * i + j] = 0.0
            for k in range(3):
                out[3 * i + j] += R_body[3 * k + i] * R[3 * k + j]


@compiled_inner
def _turn(goal: Vector, turn: Vector) -> None:
    """Turn a pose's rotation by a rotation vector, in place."""
    by, before = np.empty((3, 3)), np.empty(9)
    exp3(turn[0], turn[1], turn[2], by)
    for i in range(9):
        before[i] = goal[i]
    for i in range(3):
        for j in range(3):
            goal[3 * i + j] = 0.0
            for k in range(3):
                goal[3 * i + j] += by[i, k] * before[3 * k + j]


@compiled_inner
def _turn_between(start: Vector, end: Vector, out: Matrix) -> None:
    """Write the rotation that leads from one to another, in the world's axes."""
    for i in range(3):
        for j in range(3):
            out[i, j] = 0.0
            for k in range(3):
                out[i, j] += end[3 * i + k] * start[3 * j + k]
