"""One tick of whole-body inverse kinematics, compiled.

    goals -> obstacles -> targets nearby -> QP -> motors suffice? -> spline
    -> references of the laws

The control loop calls `run_tick` between two physics steps. It returns where Python has
to act: the planner; tasks and limits without a kernel; a QP whose active set is not
found; motors that saturate. The controller then finishes the tick, see
`WholeBodyIK.finish_tick`.
"""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from wbc_suite.compiling import Record, inner, struct
from wbc_suite.control.ground.records import Drives, Laws
from wbc_suite.control.ik.command_lead import limit_steps
from wbc_suite.control.ik.finger_capsules import FingerArrays, place_fingers
from wbc_suite.control.ik.frame_goals import GoalArrays, place_goals
from wbc_suite.control.ik.frame_targets import (
    CENTRE_OF_MASS,
    FrameArrays,
    PostureArrays,
)
from wbc_suite.control.ik.plan_triggers import (
    Event,
    ProgressArrays,
    approach_goals,
    record_state,
    watch_progress,
)
from wbc_suite.control.ik.scene_obstacles import SceneArrays, measure_obstacles
from wbc_suite.control.ik.torque_limiter import TorqueArrays, motors_suffice
from wbc_suite.control.law.law import set_reference
from wbc_suite.control.law.spline_reference import SplineArrays, extend_spline
from wbc_suite.linear_algebra import copy_vector
from wbc_suite.qp.tick import TickArrays, TickStatus, solve_tick
from wbc_suite.typing import Indices, Records, Vector

_FIRST_LEVEL: int = np.int64(0)  # pyright: ignore[reportAssignmentType]
"""Typed, since a literal would be compiled once more."""


class TickStage(IntEnum):
    """Where a tick is."""

    DONE = 0
    PLAN = 1
    """The planner has to act."""
    SOLVE = 2
    """The QP is stated, and not solved."""
    LIMIT = 3
    """The QP is solved, and a motor saturates."""
    DONE_IN_PYTHON = 4


class TickState(Record):
    """State of a tick."""

    stage: int
    """`TickStage`."""
    event: int
    """`Event` of the planner."""
    status: int
    """`TickStatus` of the QP."""
    level: int
    """At which it ended."""
    countdown: int
    """Physics steps until the next tick."""


@struct
class WholeBodyArrays(NamedTuple):
    """What a tick reads and writes.

    Attributes:
        state: `TickState`, shape (1,).
        qp: The stack of tasks; its robot is at the commanded configuration.
        target: First number of the target of each frame's task among those of the
            stack, shape (n + 1,); the last is that of the posture.
        spline: References until the next tick.
        v: Velocity of the last tick, shape (nv,).
        joint_law: Index of the law of joints in the loop's table.
        steps: Physics steps between two ticks.
    """

    state: Records
    goals: GoalArrays
    frames: FrameArrays
    scene: SceneArrays
    fingers: FingerArrays
    posture: PostureArrays
    progress: ProgressArrays
    qp: TickArrays
    target: Indices
    motors: TorqueArrays
    spline: SplineArrays
    v: Vector
    joint_law: int
    steps: int


@inner
def run_tick(
    tick: WholeBodyArrays,
    qpos: Vector,
    qvel: Vector,
    laws: Laws,
    drives: Drives,
) -> bool:
    """Run a tick as far as it needs no Python; return whether it is done.

    See `TickStage` where it is not. `qpos` and `qvel` are measured in the simulation,
    laws and drives are the records of the loop.
    """
    state, qp, robot = tick.state[0], tick.qp, tick.qp.robot
    law = tick.joint_law
    own = drives[laws[law].first : laws[law].last]
    limit_steps(qp.bounds, tick.spline, tick.v, own, qpos, qvel)
    place_goals(tick.goals, robot, tick.frames, qpos)
    measure_obstacles(tick.scene)
    place_fingers(tick.fingers)
    state.event = watch_progress(tick.progress, robot, tick.frames, tick.v)
    if state.event != Event.NONE:
        state.stage = TickStage.PLAN.value
        return False
    record_state(tick.progress, robot, tick.v)
    approach_goals(tick.progress, robot, tick.frames, tick.posture)
    _write_task_targets(tick)
    copy_vector(tick.v, qp.v)
    state.status, state.level = solve_tick(qp, tick.progress.dt, _FIRST_LEVEL)
    if state.status != TickStatus.SOLVED:
        state.stage = TickStage.SOLVE.value
        return False
    if not motors_suffice(tick.motors, robot, tick.v, qp.v, tick.progress.dt):
        state.stage = TickStage.LIMIT.value
        return False
    copy_vector(qp.v, tick.v)
    extend_spline(tick.spline, tick.v)
    set_reference(laws[law : law + 1], own, tick.spline.motion)
    state.stage, state.countdown = TickStage.DONE.value, tick.steps
    return True


@inner
def _write_task_targets(tick: WholeBodyArrays) -> None:
    """Write the targets of frames and posture into the tasks of the stack."""
    frames, numbers, first = tick.frames, tick.qp.parts.own[0], tick.target
    count, posture = frames.joint.shape[0], tick.posture.target
    for k in range(count):
        found, target = frames.target[k], numbers[first[k] :]
        if frames.joint[k] == CENTRE_OF_MASS:
            for i in range(3):
                target[i] = found[4 * i + 3]
        else:
            copy_vector(found, target)
    nq = tick.qp.robot.q.shape[0]
    copy_vector(posture[:nq], numbers[first[count] :])
