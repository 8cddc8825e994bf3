"""One tick of whole-body inverse kinematics, compiled.

    goals -> obstacles -> targets nearby -> QP -> motors suffice? -> spline
    -> references of the laws

The control loop calls `run_tick` between two physics steps. It returns where Python has
to act: the planner; tasks and limits without a kernel; a QP whose active set is not
found; motors that saturate. The controller then finishes the tick, see
`WholeBodyIK.finish_tick`.
"""

from enum import IntEnum
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from wbc_suite.compiling import compiled, compiled_inline, struct
from wbc_suite.control.composite.finger_capsules import FingerArrays, place_fingers
from wbc_suite.control.composite.frame_goals import GoalArrays, place_goals
from wbc_suite.control.composite.frame_targets import (
    CENTRE_OF_MASS,
    FrameArrays,
    PostureArrays,
)
from wbc_suite.control.composite.progress import (
    Event,
    ProgressArrays,
    approach_goals,
    record_state,
    watch_progress,
)
from wbc_suite.control.composite.scene_obstacles import SceneArrays, measure_obstacles
from wbc_suite.control.composite.torque_limiter import TorqueArrays, motors_suffice
from wbc_suite.control.law.reference import set_reference
from wbc_suite.control.loop.records import CompiledRecords, Records
from wbc_suite.control.part.spline_reference import (
    SplineArrays,
    extend_spline,
    spline_end,
)
from wbc_suite.linear_algebra import copy_vector
from wbc_suite.qp.limit import JointBounds, braking_step
from wbc_suite.qp.tick import TickArrays, TickStatus, solve_tick
from wbc_suite.typing import Indices, Vector

_FIRST_LEVEL: int = np.int64(0)  # pyright: ignore[reportAssignmentType]
"""Typed, since a literal would be compiled once more."""


MAX_LEAD = 0.25
"""rad or m; a command waits for a joint that lags behind by more, so that a joint does
not jump when it comes free. It waits sooner where the motor saturates. Where a contact
drives the joint away, the command follows it at this distance: the QP would otherwise
keep a robot off the scene that is elsewhere."""
EXCESS = 1.2
"""Speed or lag of a joint, over its limit or `MAX_LEAD`, at which commands brake."""


class Stage(IntEnum):
    """Where a tick is."""

    DONE = 0
    PLAN = 1
    """The planner has to act."""
    SOLVE = 2
    """The QP is stated, and not solved."""
    LIMIT = 3
    """The QP is solved, and a motor saturates."""
    DONE_IN_PYTHON = 4


TICK = np.dtype(
    [
        ("stage", "i8"),  # `Stage`
        ("event", "i8"),  # `Event` of the planner
        ("status", "i8"),  # `TickStatus` of the QP
        ("level", "i8"),  # at which it ended
        ("countdown", "i8"),  # physics steps until the next tick
    ]
)
"""State of a tick."""


@struct
class WholeBodyArrays(NamedTuple):
    """What a tick reads and writes.

    Attributes:
        state: `TICK` record, shape (1,).
        qp: The stack of tasks; its robot is at the commanded configuration.
        task_level: Strict level of the task of each frame, shape (n,).
        task_row: Place of the task on its level, shape (n,).
        posture_level: Strict level of the posture.
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
    task_level: Indices
    task_row: Indices
    posture_level: int
    motors: TorqueArrays
    spline: SplineArrays
    v: Vector
    joint_law: int
    steps: int


Ticks: TypeAlias = Any
"""A tuple of `WholeBodyArrays`, one for each robot whose ticks the loop runs; None
without any, which leaves them out of the machine code."""


@compiled_inline
def run_tick(
    tick: WholeBodyArrays,
    qpos: Vector,
    qvel: Vector,
    laws: CompiledRecords,
    drives: CompiledRecords,
) -> bool:
    """Run a tick as far as it needs no Python; return whether it is done.

    See `Stage` where it is not. `qpos` and `qvel` are measured in the simulation, laws
    and drives are the records of the loop.
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
        state.stage = Stage.PLAN.value
        return False
    record_state(tick.progress, robot, tick.v)
    approach_goals(tick.progress, robot, tick.frames, tick.posture)
    _write_task_targets(tick)
    copy_vector(tick.v, qp.v)
    state.status, state.level = solve_tick(qp, tick.progress.dt, _FIRST_LEVEL)
    if state.status != TickStatus.SOLVED:
        state.stage = Stage.SOLVE.value
        return False
    if not motors_suffice(tick.motors, robot, tick.v, qp.v, tick.progress.dt):
        state.stage = Stage.LIMIT.value
        return False
    copy_vector(qp.v, tick.v)
    extend_spline(tick.spline, tick.v)
    set_reference(laws[law : law + 1], own, tick.spline.motion)
    state.stage, state.countdown = Stage.DONE.value, tick.steps
    return True


@compiled
def limit_steps(
    bounds: JointBounds,
    spline: SplineArrays,
    v: Vector,
    drives: CompiledRecords,
    qpos: Vector,
    qvel: Vector,
) -> None:
    """Write the greatest steps of commands that wait for their joints."""
    excess = _limit_lead(bounds, spline, v, drives, qpos, qvel)
    if excess > EXCESS:
        _brake(bounds, spline, v, min(excess / EXCESS - 1.0, 1.0))


@compiled
def _limit_lead(
    bounds: JointBounds,
    spline: SplineArrays,
    v: Vector,
    drives: CompiledRecords,
    qpos: Vector,
    qvel: Vector,
) -> float:
    """Write the greatest steps with which commands do not lead their joints by more.

    The lead is e + (kd / kp) e', as feedback measures it. It grows by the velocity that
    the joint lacks: a step that is shorter than the last, of velocity v, by so much
    keeps it. A step may be longer by what can be braked within the lead that is left.
    It is negative, and leads back, where the lead is greater than `MAX_LEAD`.

    Returns the greatest speed or lag of a joint, relative to its limit or `MAX_LEAD`.
    """
    dt, excess = spline.period, 0.0
    for j in range(spline.q_index.shape[0]):
        drive, i = drives[j], spline.v_index[j]
        position, velocity = spline_end(spline, j)
        most, growth = drive.windup_max, velocity - qvel[drive.dof]
        lag, v_max = float(position - qpos[drive.qpos]), float(bounds.v_max[i])
        excess = max(excess, abs(float(qvel[drive.dof])) / v_max, abs(lag) / MAX_LEAD)
        lead = lag + drive.kd / drive.kp * growth
        kept, a_max = dt * (v[i] - growth), float(bounds.a_max[i])
        for side, sign in enumerate((-1.0, 1.0)):
            left = max(most - sign * lead, 0.0)
            longer = braking_step(float(left), 1.0, a_max, dt)
            slower = min(sign * v[i] * dt - a_max * dt**2, 0.0)
            least = slower if sign * lead > MAX_LEAD else 0.0
            bounds.step_max[side, i] = max(sign * kept + longer, least)
    return excess


@compiled
def _brake(bounds: JointBounds, spline: SplineArrays, v: Vector, share: float) -> None:
    """Brake all commands by a share of their greatest accelerations.

    A contact drives a joint: an arm presses its wrist down, or a base drives on with
    an arm that is jammed. Commands that have to lead back do so.
    """
    dt = spline.period
    for i in spline.v_index:
        for side, sign in enumerate((-1.0, 1.0)):
            slower = sign * v[i] * dt - share * bounds.a_max[i] * dt**2
            longest = max(slower, -bounds.step_max[1 - side, i], 0.0)
            bounds.step_max[side, i] = min(bounds.step_max[side, i], longest)


@compiled
def _write_task_targets(tick: WholeBodyArrays) -> None:
    """Write the targets of frames and posture into the tasks of the stack."""
    frames, levels = tick.frames, tick.qp.levels
    for k in range(frames.joint.shape[0]):
        found = frames.target[k]
        target = levels[tick.task_level[k]].tasks.target[tick.task_row[k]]
        if frames.joint[k] == CENTRE_OF_MASS:
            for i in range(3):
                target[i] = found[4 * i + 3]
        else:
            copy_vector(found, target)
    posture = levels[tick.posture_level].tasks.joint_target[0]
    copy_vector(tick.posture.target[: posture.shape[0]], posture)
