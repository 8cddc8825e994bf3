"""One tick of the inverse kinematics of a part, in the control loop.

Goal, target nearby, QP, spline, references of the law.
"""

from typing import NamedTuple

import numpy as np

from wbc_suite.compiling import Record, inner, struct
from wbc_suite.control.ground.physics import Physics
from wbc_suite.control.ground.records import Drives, Laws
from wbc_suite.control.law.approach import approach_pose
from wbc_suite.control.law.law import set_reference
from wbc_suite.control.law.spline_reference import SplineArrays, extend_spline
from wbc_suite.control.poses import (
    multiply,
    write_frame_pose,
    write_relative,
    write_row,
    write_turn,
)
from wbc_suite.kinematics.forward import compute_joint_poses
from wbc_suite.qp.lie import log3
from wbc_suite.qp.tick import TickArrays, TickStatus, solve_tick
from wbc_suite.typing import Records, Vector

_FIRST_LEVEL: int = np.int64(0)  # pyright: ignore[reportAssignmentType]
"""Typed, since a literal would be compiled once more."""


class HandState(Record):
    """State of a tick."""

    status: int
    """`TickStatus` of the QP; Python finishes a tick that is not `SOLVED`."""
    level: int
    """At which it ended."""
    countdown: int
    """Physics steps until the next tick."""


@struct
class HandIk(NamedTuple):
    """What the tick of a part reads and writes; poses are rows, see `control.poses`.

    Attributes:
        state: `HandState`, shape (1,).
        goal: Pose to go to: rotation row by row, then position, shape (12,).
        base: Body in whose axes the goal is.
        carrier: Body that carries the part.
        carrier_pose: Its pose in the model of the part alone, shape (12,).
        joint: Joint of that model that carries the hand.
        offset: Pose of the hand in it, shape (12,).
        gain: Part of the error that one tick removes.
        speed: Greatest speeds, m/s and rad/s, shape (2,).
        braking: Decelerations, m/s^2 and rad/s^2, shape (2,).
        qp: The stack of hand and posture.
        target: Place of the hand's target among its numbers, [R p], (12,).
        spline: References until the next tick.
        law: Index of the part's law in the loop's table.
        steps: Physics steps between two ticks.
    """

    state: Records
    goal: Vector
    base: int
    carrier: int
    carrier_pose: Vector
    joint: int
    offset: Vector
    gain: float
    speed: Vector
    braking: Vector
    qp: TickArrays
    target: int
    spline: SplineArrays
    law: int
    steps: int


@inner
def run_hand(hand: HandIk, physics: Physics, laws: Laws, drives: Drives) -> bool:
    """Run a tick; return whether it is done, or its QP left to Python."""
    state, qp, law = hand.state[0], hand.qp, hand.law
    _write_target(hand, physics)
    state.status, state.level = solve_tick(qp, hand.spline.period, _FIRST_LEVEL)
    if state.status != TickStatus.SOLVED:
        return False
    extend_spline(hand.spline, qp.v)
    own = drives[laws[law].first : laws[law].last]
    set_reference(laws[law : law + 1], own, hand.spline.motion)
    state.countdown = hand.steps
    return True


@inner
def _write_target(hand: HandIk, physics: Physics) -> None:
    """Write a target on the way to the goal, in the model of the part alone.

    All other joints enter by the measured pose of the link that carries the part.
    """
    robot, base, carrier = hand.qp.robot, hand.base, hand.carrier
    goal, pose, other = np.empty(12), np.empty(12), np.empty(12)
    error, turn = np.empty(6), np.empty((3, 3))
    write_row(hand.goal[:9], hand.goal[9:], goal)
    write_row(physics.xmat[base], physics.xpos[base], pose)
    multiply(pose, goal, other)
    write_row(physics.xmat[carrier], physics.xpos[carrier], pose)
    write_relative(pose, other, goal)
    multiply(hand.carrier_pose, goal, other)
    compute_joint_poses(robot)
    write_frame_pose(robot.pose[hand.joint], hand.offset, pose)
    write_turn(pose, other, turn)
    log3(turn, error[3:])
    for i in range(3):
        error[i] = other[4 * i + 3] - pose[4 * i + 3]
    target = hand.qp.parts.own[0][hand.target :]
    speed, braking, dt = hand.speed, hand.braking, hand.spline.period
    approach_pose(pose, error, dt, hand.gain, 1.0, speed, braking, target)
