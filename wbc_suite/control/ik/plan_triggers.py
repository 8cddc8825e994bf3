"""Progress towards goals: when the planner of a whole-body controller has to act.

As long as it has not, targets are on straight lines to the goals, and a tick needs no
Python.
"""

from collections.abc import Sequence
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from wbc_suite.compiling import compiled, compiled_inline, inner, record_type, struct
from wbc_suite.control.ik.config import WholeBodyIKConfig
from wbc_suite.control.ik.frame_targets import (
    FrameArrays,
    PostureArrays,
    measure_frames,
    write_targets,
)
from wbc_suite.kinematics.forward import RobotArrays
from wbc_suite.planning import TimedState
from wbc_suite.typing import Matrix, Records, Vector

STANDSTILL = 0.02  # rad/s or m/s
STUCK_AFTER = 0.1  # s at a standstill
PROGRESS_WINDOW = 0.2  # s; over which progress is measured
PROGRESS_TIME = 2.0  # s; a robot that needs longer at its present rate is stuck
SLOW_SHARE = 1.0 - PROGRESS_WINDOW / PROGRESS_TIME
TRAIL = 60  # states that are recorded
TRAIL_STEP = 5  # solves between them
HALF_SPEED_ERROR = 0.2  # of the tolerance; at which lower levels have half their speed


class Event(IntEnum):
    """What the planner has to do."""

    NONE = 0
    NEW_GOALS = 1
    """Drop its plans: goals have changed."""
    FAR_GOALS = 2
    """Drop them, and plan a motion."""
    STUCK = 3
    """Plan a motion."""
    PLANNING = 4
    """Go on with a search or a motion."""


PROGRESS = record_type(
    ("goals_changed", "i8"),  # since the last solve
    ("is_planning", "i8"),  # whether the planner searches or leads a motion
    ("has_searched", "i8"),  # for these goals
    ("has_arrived", "i8"),  # level 0, at these goals
    ("standstill", "f8"),  # s
    ("solves", "i8"),
    ("recorded", "i8"),  # states of the trail, ever
    ("errors", "i8"),  # number of errors, at most those of the window
)
"""State of the progress."""


@struct
class ProgressArrays(NamedTuple):
    """Progress of the controlled frames, and where the robot has been.

    Attributes:
        state: `PROGRESS` record, shape (1,).
        error: Greatest error of level 0 at the last solves, as a multiple of the
            tolerance, newest last.
        trail_time: Times of recorded states, s; the newest is at
            `(recorded - 1) % TRAIL`.
        trail_q: Their configurations, shape (TRAIL, nq).
        trail_v: Their velocities, shape (TRAIL, nv).
        far: Distances of a goal from which on a motion is planned, m and rad.
        may_plan: Whether motions are planned at all.
        dt: Time between solves, s.
        settling: Time constant of the end of the posture's motion, s.
        half_speed_error: See `frame_targets.lower_level_rate`.
    """

    state: Records
    error: Vector
    trail_time: Vector
    trail_q: Matrix
    trail_v: Matrix
    far: Vector
    may_plan: bool
    dt: float
    settling: float
    half_speed_error: float


def progress_arrays(
    config: WholeBodyIKConfig, nq: int, nv: int, dt: float
) -> ProgressArrays:
    """Return the arrays of a controller that solves every dt seconds.

    Once frames of level 0 have arrived, motion below must not move them off again where
    joints cannot follow it. A robot on its feet balances by that motion, which is then
    not slowed.
    """
    return ProgressArrays(
        state=np.zeros(1, PROGRESS),
        error=np.zeros(round(PROGRESS_WINDOW / dt) + 1),
        trail_time=np.zeros(TRAIL),
        trail_q=np.zeros((TRAIL, nq)),
        trail_v=np.zeros((TRAIL, nv)),
        far=np.array(config.far, dtype=np.float64),
        may_plan=bool(config.planning),
        dt=float(dt),
        settling=float(dt / config.posture.gain),
        half_speed_error=0.0 if config.held else HALF_SPEED_ERROR,
    )


@compiled
def watch_progress(
    progress: ProgressArrays, robot: RobotArrays, frames: FrameArrays, v: Vector
) -> int:
    """Return the `Event` at the begin of a solve; goals of the frames are set.

    The velocity v, shape (nv,), is that of the last solve.
    """
    if not progress.may_plan:
        return Event.NONE.value
    state, fastest = progress.state[0], 0.0
    for i in range(v.shape[0]):
        fastest = max(fastest, abs(v[i]))
    state.solves += 1
    state.standstill = state.standstill + progress.dt if fastest < STANDSTILL else 0.0
    if state.goals_changed:
        state.goals_changed = state.has_searched = state.has_arrived = 0
        state.standstill, state.errors = 0.0, 0
        measure_frames(robot, frames)
        if _is_far(frames, progress.far):
            return Event.FAR_GOALS.value
        return Event.NEW_GOALS.value if state.is_planning else Event.NONE.value
    if state.is_planning:
        return Event.PLANNING.value
    if not state.has_searched and _is_stuck(progress, robot, frames):
        return Event.STUCK.value
    return Event.NONE.value


@inner
def _is_far(frames: FrameArrays, far: Vector) -> bool:
    """Return whether a frame of level 0 is farther from its goal, m or rad."""
    for k in range(frames.level.shape[0]):
        for part in range(2):
            if frames.level[k] == 0 and frames.distance[k, part] > far[part]:
                return True
    return False


@compiled_inline
def _is_stuck(
    progress: ProgressArrays, robot: RobotArrays, frames: FrameArrays
) -> bool:
    """Return whether the robot stands short of its goals or hardly comes nearer.

    Near a singularity it creeps, faster than a standstill.
    """
    error, state = progress.error, progress.state[0]
    last = error.shape[0] - 1
    slow = state.errors > last and error[last] > SLOW_SHARE * error[0]
    if not slow and state.standstill <= STUCK_AFTER:
        return False
    measure_frames(robot, frames)
    return _is_far(frames, frames.tolerance)


@compiled
def record_state(progress: ProgressArrays, robot: RobotArrays, v: Vector) -> None:
    """Record the state of every `TRAIL_STEP`-th solve."""
    state = progress.state[0]
    if not progress.may_plan or state.solves % TRAIL_STEP != 0:
        return
    row = state.recorded % TRAIL
    progress.trail_time[row] = state.solves * progress.dt
    for i in range(robot.q.shape[0]):
        progress.trail_q[row, i] = robot.q[i]
    for i in range(v.shape[0]):
        progress.trail_v[row, i] = v[i]
    state.recorded += 1


@compiled
def approach_goals(
    progress: ProgressArrays,
    robot: RobotArrays,
    frames: FrameArrays,
    posture: PostureArrays,
) -> None:
    """Write targets on straight lines to the goals, and note the error of level 0."""
    state, errors = progress.state[0], progress.error
    error = write_targets(
        robot,
        frames,
        posture,
        progress.dt,
        progress.settling,
        progress.half_speed_error,
        bool(state.has_arrived != 0),
    )
    last = errors.shape[0] - 1
    for i in range(last):
        errors[i] = errors[i + 1]
    errors[last] = error
    state.errors = min(state.errors + 1, last + 1)
    if error < 1.0:
        state.has_arrived = 1


class Trail(Sequence[TimedState]):
    """Recorded states, the latest first; follows what is recorded later."""

    def __init__(self, progress: ProgressArrays) -> None:
        self._progress = progress

    def __len__(self) -> int:
        """Return how many states are kept."""
        return min(int(self._progress.state["recorded"][0]), TRAIL)

    def __getitem__(self, k: Any) -> Any:
        """Return the state k states before the latest."""
        if not 0 <= k < len(self):
            raise IndexError(k)
        kept = self._progress
        row = (int(kept.state["recorded"][0]) - 1 - k) % TRAIL
        q, v = kept.trail_q[row].copy(), kept.trail_v[row].copy()
        return TimedState(float(kept.trail_time[row]), q, v)
