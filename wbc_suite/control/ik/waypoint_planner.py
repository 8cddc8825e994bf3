"""Next targets of a whole-body controller: straight, or along a planned motion."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wbc_suite.compiling import as_argument
from wbc_suite.control.ik.config import WholeBodyIKConfig
from wbc_suite.control.ik.frame_kinds import (
    NO_SPEED_LIMIT,
    GoalTask,
    set_target,
)
from wbc_suite.control.ik.frame_targets import ControlledFrames
from wbc_suite.control.ik.plan_triggers import (
    STUCK_AFTER,
    Event,
    Trail,
    approach_goals,
    progress_arrays,
    record_state,
    watch_progress,
)
from wbc_suite.control.ik.qp_of_config import (
    accelerations,
    held_equality,
    joint_speeds,
    travel_costs,
    weight_limits,
)
from wbc_suite.control.memory import Parts
from wbc_suite.control.part.stance_controller import soles_of
from wbc_suite.kinematics import Configuration
from wbc_suite.planning import (
    Clearance,
    GoalProblem,
    GoalSearch,
    Motion,
    MotionPlanner,
    TimedState,
)
from wbc_suite.planning.motion_planner import CATCH_UP_LIMIT
from wbc_suite.planning.waypoint_tracking import HORIZONS, track_waypoints
from wbc_suite.qp import (
    Limit,
    PositionLimit,
    PostureTask,
    SupportLimit,
    VelocityLimit,
)
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Matrix, Vector

PLAN_SHARE = 0.95  # of the acceleration limits, in a planned motion
TRACKING_SHARE = 0.98  # of them, for removing a tracking error
MAX_DELAY = 0.15  # s; at which the clock of a motion is slowest
MIN_CLOCK_RATE = 0.2
STANDSTILL_FACTOR = 2  # on the search iterations, while the robot stands
ARRIVED = 5e-3  # rad or m; from here on goals are approached straight

WHOLE_ERROR = {"position_cost": 1.0, "orientation_cost": 1.0, "gain": 1.0}
START_COST = 0.05  # [cost]/s of distance from the start
BALANCE_MARGIN = 2e-3  # m; how much farther from the soles' edges than the controller


class Waypoint(NamedTuple):
    """What one solve of the inverse kinematics is asked for.

    Attributes:
        posture: Configuration to prefer; without targets, to go to at once.
        targets: Poses of the controlled frames, [R p] row by row, shape (n, 12), or
            None to move joint by joint. A buffer.
    """

    posture: Vector
    targets: Matrix | None = None


class WaypointPlanner:
    """Turns goals into targets nearby that the robot can brake for.

    Near goals are approached on a straight line. For distant ones, and where the
    straight line ends in a local minimum, a configuration that meets all of level 0 is
    searched, and a joint-space motion to it is planned and tracked. A goal that no
    configuration meets is approached straight, as near as possible. With
    `planning = false` all goals are.

    Args:
        robot: The reduced robot.
        configuration: The commanded configuration; read, and moved by the owner.
        clearance: Clearance of a configuration, m.
        distance_limits: Limits that keep links apart.
        dt: Time between solves, s.

    Attributes:
        argument: The argument of kernels that stands for the progress.
    """

    def __init__(
        self,
        robot: RobotDescription,
        config: WholeBodyIKConfig,
        configuration: Configuration,
        frames: ControlledFrames,
        *,
        clearance: Clearance,
        distance_limits: Sequence[Limit],
        dt: float,
    ) -> None:
        self._config, self._dt = config, dt
        self._configuration, self._frames = configuration, frames
        limits = accelerations(robot, config, configuration)
        self._accelerations = limits
        self._goal_tasks = {
            k: frame.behaviour.task(frame.model_copy(update=WHOLE_ERROR))
            for k, frame in enumerate(config.frames)
            if frame.level == 0
        }
        tasks = list(self._goal_tasks.values())
        problem = _goal_problem(robot, config, tasks, distance_limits)
        self._planner = MotionPlanner(
            configuration.model,
            clearance,
            speed=problem.speed,
            acceleration=PLAN_SHARE * limits,
        )
        self._search = GoalSearch(problem, clearance, self._planner)
        progress = progress_arrays(config, configuration.nq, configuration.nv, dt)
        self._progress, self._state = progress, progress.state
        self._trail = Trail(progress)
        self.argument = as_argument(progress)
        self._posture = configuration.q.copy()
        self.reset(configuration.q)

    def reset(self, posture: Vector) -> None:
        """Drop all plans; prefer a posture, until a search has found another."""
        self._posture[:] = posture
        self._frames.posture.goal[:] = posture
        self._motion: Motion | None = None
        self._search.stop()
        for name in self._state.dtype.names or ():
            self._state[name] = 0

    @property
    def memory(self) -> Parts:
        """Progress towards the goals, and preferred postures; views."""
        names = set(self._state.dtype.names or ()) - {"recorded"}
        state = [self._state[name] for name in sorted(names)]
        return *state, self._progress.error, self._posture, self._frames.posture.goal

    def resume(self) -> None:
        """Plan anew where a motion was on its way."""
        if self._state["is_planning"][0]:
            self._state["is_planning"] = 0
            self.renew()

    def renew(self) -> None:
        """Note that goals have changed."""
        self._state["goals_changed"] = 1

    def next(self, v: Vector) -> Waypoint:
        """Return what to ask for now, where the last solve had the velocity v."""
        robot, frames = self._configuration.robot, self._frames.argument
        return self.respond(watch_progress(self.argument, robot, frames, v), v)

    def respond(self, event: int, v: Vector) -> Waypoint:
        """Return what to ask for after the `Event` of this solve; see `next`."""
        standstill = float(self._state["standstill"][0])
        if event in (Event.NEW_GOALS, Event.FAR_GOALS):
            self._motion = None
            self._search.stop()
        elif not self._search.is_running and standstill > STUCK_AFTER:
            self._motion = None
        if event == Event.FAR_GOALS:
            self._frames.posture.goal[:] = self._posture
        if event in (Event.FAR_GOALS, Event.STUCK):
            self._begin()
        clock = float(self._state["solves"][0]) * self._dt
        now = TimedState(clock, self._configuration.q.copy(), v.copy())
        if self._search.is_running:
            factor = STANDSTILL_FACTOR if standstill > 0.0 else 1
            iterations = factor * self._config.search_iterations
            self._motion = self._search.advance(iterations, now) or self._motion
        record_state(self.argument, self._configuration.robot, v)
        if self._motion is not None:
            waypoint = self._along(self._motion, now, standstill)
        else:
            waypoint = self._straight()
        is_planning = self._motion is not None or self._search.is_running
        self._state["is_planning"] = is_planning
        return waypoint

    def _begin(self) -> None:
        """Begin a search for the present goals."""
        self._state["has_searched"] = 1
        q = self._configuration.q
        for k, task in self._goal_tasks.items():
            set_target(task, self._frames.arrays.goal[k])
        self._search.start([q, self._posture], q, self._trail)

    def _along(self, motion: Motion, now: TimedState, standstill: float) -> Waypoint:
        """Return the next configuration on a motion; its clock waits for the robot."""
        planner = self._planner
        if planner.catch_up_time(motion, now) > CATCH_UP_LIMIT:
            planner.rejoin(motion, now)
            if standstill <= STUCK_AFTER and not self._search.is_running:
                self._search.replan(motion)
        delay = planner.delay(motion, now)
        rate = max(MIN_CLOCK_RATE, 1.0 - delay / MAX_DELAY)
        wanted = self._track(motion, rate, now.v)
        motion.clock += self._dt * rate
        after = motion.configuration()
        left = self._configuration.difference(after)
        is_final = not motion.remaining and not self._search.is_running
        if is_final and np.abs(left).max() < ARRIVED:
            self._frames.posture.goal[:] = after
            self._motion = None
        return Waypoint(posture=self._configuration.integrate(self._dt * wanted))

    def _track(self, motion: Motion, rate: float, v: Vector) -> Vector:
        """Return velocities that lead onto a motion whose clock runs at a rate."""
        times = np.array([self._dt, *HORIZONS])
        states = [motion.trajectory.state(motion.clock + rate * t) for t in times]
        difference = self._configuration.difference
        ahead = np.array([difference(motion.configuration_of(x)) for x, _ in states])
        velocities = rate * np.array([velocity for _, velocity in states])
        found = np.empty_like(v)
        most = TRACKING_SHARE * self._accelerations
        track_waypoints(v, ahead, velocities, times, most, found)
        return found

    def _straight(self) -> Waypoint:
        """Return targets on straight lines to the goals, and a step to the posture."""
        frames = self._frames
        approach_goals(
            self.argument,
            self._configuration.robot,
            frames.argument,
            frames.posture_argument,
        )
        return Waypoint(targets=frames.arrays.target, posture=frames.posture.target)


def _goal_problem(
    robot: RobotDescription,
    config: WholeBodyIKConfig,
    tasks: Sequence[GoalTask],
    distance_limits: Sequence[Limit],
) -> GoalProblem:
    """Return the problem of meeting all frames of level 0, which have these tasks.

    Joint limits, balance and held frames are kept.
    """
    configuration = Configuration(robot.to_pinocchio())
    frames = [frame for frame in config.frames if frame.level == 0]
    linear, angular = robot.root.velocity
    limits: list[Limit] = [
        PositionLimit(
            margin=2.0 * config.limits.position_margin, joints=config.limits.positions
        ),
        VelocityLimit(base_linear=linear, base_angular=angular),
        *weight_limits(robot, config),
    ]
    soles = soles_of(config.held)
    if soles:
        margin = config.limits.balance_margin + BALANCE_MARGIN
        limits.append(SupportLimit(soles, margin=margin))
    counted = [np.array(frame.behaviour.counted, float) for frame in frames]

    def error() -> float:
        worst = 0.0
        for task, mask in zip(tasks, counted, strict=True):
            errors = np.abs(task.error(configuration))
            worst = max(worst, float((errors * mask[: len(errors)]).max()))
        return worst

    return GoalProblem(
        configuration=configuration,
        tasks=tasks,
        error=error,
        equalities=[held_equality(held) for held in config.held],
        limits=limits,
        distance_limits=distance_limits,
        start=PostureTask(
            START_COST,
            costs=travel_costs(robot, START_COST),
            max_speed=NO_SPEED_LIMIT,
            name="start",
        ),
        speed=joint_speeds(robot, configuration),
    )
