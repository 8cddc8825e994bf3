"""Targets of joints, and steps of their goals, compiled: 1 us in place of 10."""

from enum import IntEnum

import numpy as np

from wbc_suite.compiling import compiled
from wbc_suite.control.loop.table import CompiledRecords
from wbc_suite.kinematics.array_table import vector
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["StepField", "follow", "grip", "rest_at", "step_joints", "write_motion"]

NOTHING = 1e-12
"""rad or m; rounding of a step that is none."""


class StepField(IntEnum):
    """Places of arrays in the table of `step_joints`."""

    GOAL = 0
    GAIN = 1
    OFFSET = 2
    LOW = 3
    HIGH = 4
    QPOS = 5


@compiled
def step_joints(
    values: Vector, table: Indices, drives: CompiledRecords, achieved: bool
) -> None:
    """Move the goals of joints by an action's steps, in place.

    A step is `offset + gain value`. It counts from where the joint is or from its goal,
    and ends within the joint's limits. One of nothing leaves the goal where it is.

    Args:
        values: Of the action, shape (n,).
        table: An `ArrayTable` of `StepField`; all of MuJoCo's qpos in it.
        drives: `DRIVE` records, shape (n,).
        achieved: Whether steps count from where the joints are.
    """
    goal, gain, offset = vector(table, 0), vector(table, 1), vector(table, 2)
    low, high, qpos = vector(table, 3), vector(table, 4), vector(table, 5)
    for j in range(goal.shape[0]):
        step = offset[j] + gain[j] * values[j]
        if abs(step) >= NOTHING:
            start = qpos[drives[j].qpos] if achieved else goal[j]
            goal[j] = min(max(start + step, low[j]), high[j])


@compiled
def rest_at(record: CompiledRecords, drives: CompiledRecords, position: Vector) -> None:
    """Let the targets of a law stand still at a position; see `Law.aim`."""
    for j in range(drives.shape[0]):
        drive = drives[j]
        drive.position, drive.velocity = position[j], 0.0
        drive.acceleration, drive.jerk = 0.0, 0.0
    law = record[0]
    law.since, law.duration = 0.0, np.inf


@compiled
def grip(
    record: CompiledRecords,
    drives: CompiledRecords,
    command: Vector,
    synergy: Indices,
    opened: Vector,
    span: Vector,
) -> None:
    """Let the targets of a gripper's law be at `open + (command + 1) / 2 span`.

    Args:
        record: The law's, shape (1,).
        drives: Its drives, shape (n,).
        command: Of each synergy, -1 to 1.
        synergy: That of each drive, shape (n,).
        opened: Positions when open, shape (n,).
        span: From there to closed, shape (n,).
    """
    for j in range(drives.shape[0]):
        closed = 0.5 * (command[synergy[j]] + 1.0)
        drive = drives[j]
        drive.position = opened[j] + closed * span[j]
        drive.velocity, drive.acceleration, drive.jerk = 0.0, 0.0, 0.0
    law = record[0]
    law.since, law.duration = 0.0, np.inf


@compiled
def follow(record: CompiledRecords, drives: CompiledRecords, motion: Matrix) -> None:
    """Let the targets of a law move on from now on; see `Law.aim`.

    Args:
        record: The law's, shape (1,).
        drives: Its drives, shape (n,).
        motion: Positions, velocities, accelerations and jerks, shape (4, n).
    """
    for j in range(drives.shape[0]):
        drive = drives[j]
        drive.position, drive.velocity = motion[0, j], motion[1, j]
        drive.acceleration, drive.jerk = motion[2, j], motion[3, j]
    law = record[0]
    law.since, law.duration = 0.0, np.inf


@compiled
def write_motion(
    q: Vector,
    rates: Matrix,
    q_index: Indices,
    v_index: Indices,
    period: float,
    motion: Matrix,
) -> None:
    """Write what `Reference.polynomial` returns, as rows.

    Args:
        q: The point before the last two steps, shape (nq,).
        rates: Velocities of the last three steps, newest last, shape (3, nv).
        q_index: Places of the n driven joints in q.
        v_index: Their places in v.
        period: Time between solves, s.
        motion: Output in its first n columns, shape (4, n or more).
    """
    for j in range(q_index.shape[0]):
        i = v_index[j]
        first, second, third = rates[0, i], rates[1, i], rates[2, i]
        motion[0, j] = q[q_index[j]] + period / 6.0 * (second - first)
        motion[1, j] = 0.5 * (first + second)
        motion[2, j] = (second - first) / period
        motion[3, j] = (third - 2.0 * second + first) / period**2
