"""Motions from a state to a configuration, around obstacles, and their timing."""

import itertools
from collections.abc import Generator, Iterator, Sequence

import numpy as np
import pinocchio as pin
import ruckig

from wbc_suite.errors import ConfigError
from wbc_suite.planning.collision_checker import Clearance
from wbc_suite.planning.rrt_connect import RRTConnect
from wbc_suite.planning.shortcutting import shorten_trajectory
from wbc_suite.planning.time_parameterisation import ProfileGenerator, retrace_scales
from wbc_suite.planning.trajectory import Motion, Segment, TimedState, Trajectory
from wbc_suite.typing import Vector

MAX_PATH_TIME = 90.0  # s at full speed; of all lines that RRT-Connect checks
CHECKED_SPEED = 0.1
"""rad/s or m/s, at least, by which lines are measured: the lift of PR2's trunk goes at
0.013 m/s, and alone would take all checks."""
SHORTCUTS = 600  # that are tried on a trajectory
MIN_CLEARANCE = 0.015  # m; closer links are slowed down, so a short path takes long
CATCH_UP_LIMIT = 0.03  # s; with more to catch up, a robot replans
FIXED_TIME = 0.03  # s; how far ahead of the robot a motion may still change
START_TOLERANCE = 3e-3  # m; links in collision at the start may come so much closer
REJOIN_TIMES = (0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0)  # s; where to rejoin a motion
MAX_LOSS = 0.5  # of the delay; rejoining must lose less
SKIP_STEP, SKIP_STEPS = 0.02, 60  # s, and number; where the nearest state is sought
RETRACE_SCALE = 8.0  # of the accelerations: recorded velocities have steps


class MotionPlanner:
    """Plans motions under velocity and acceleration limits, shape (nv,) each.

    Configurations and goals have the shape (nq,).

    Args:
        model: The robot.
        clearance: Clearance of a configuration, m; free where it is positive.
        speed: Velocity limits.
        acceleration: Acceleration limits.
        spacing: Time between two collision checks along a motion, s.
        path_spacing: The same on the path of RRT-Connect, s at full speed.
    """

    def __init__(
        self,
        model: pin.Model,
        clearance: Clearance,
        *,
        speed: Vector,
        acceleration: Vector,
        spacing: float = 0.02,
        path_spacing: float = 0.06,
    ) -> None:
        self._model, self._clearance = model, clearance
        self._speed, self._acceleration = speed, acceleration
        self._generator = ProfileGenerator(speed=speed, acceleration=acceleration)
        self._spacing = spacing
        self._max_checks = round(MAX_PATH_TIME / path_spacing)
        self._rrt = RRTConnect(
            model,
            speed=np.maximum(speed, CHECKED_SPEED),
            clearance=clearance,
            spacing=path_spacing,
        )
        self._is_euclidean = model.nq == model.nv

    def duration_to(self, now: TimedState, goal: Vector) -> float:
        """Return the least time in which to rest at a configuration, s."""
        profile = self._profile(now, goal)
        return np.inf if profile is None else profile.duration

    def direct(self, now: TimedState, goal: Vector) -> Motion | None:
        """Return the fastest motion, or None where it collides."""
        profile = self._profile(now, goal)
        if profile is None:
            return None
        motion = self._motion(now, profile)
        return motion if self._is_free(motion, profile) else None

    def stop(self, now: TimedState) -> Motion:
        """Return the motion that stops each joint as soon as it can."""
        return self._motion(now, self._generator.stop((np.zeros_like(now.v), now.v)))

    def around(
        self, motion: Motion, goals: Sequence[Vector]
    ) -> Generator[None, None, bool]:
        """Extend a motion that stops by a path of RRT-Connect around obstacles.

        It leads to the first of the goals to which there is one. Return whether there
        is.
        """
        for goal in goals if self._is_euclidean else ():
            ends = motion.goal, goal
            for found in self._rrt.search(*ends, max_checks=self._max_checks):
                if found:
                    motion.trajectory.extend(self._lines(motion, found))
                    return True
                yield None
        return False

    def straight(self, motion: Motion, goal: Vector) -> None:
        """Extend a motion by the straight line to a goal."""
        motion.trajectory.extend(self._lines(motion, [motion.goal, goal]))

    def plan(self, now: TimedState, goal: Vector) -> Motion | None:
        """Return a shortened motion around obstacles; None if no path was found."""
        motion = self.stop(now)
        search = self._rrt.search(motion.goal, goal, max_checks=self._max_checks)
        paths = [path for path in search if path is not None]
        if not paths:
            return None
        motion.trajectory.extend(self._lines(motion, paths[-1]))
        for _ in self.shorten(motion):
            pass
        return motion

    def retrace(
        self, now: TimedState, goal: Vector, trail: Sequence[TimedState]
    ) -> Generator[None, None, Motion | None]:
        """Return a motion that stops and goes back until it can turn to the goal.

        Where the robot was is free, so this needs no search. The trail has its earlier
        states, the latest first.
        """
        if not self._is_euclidean:
            return None
        motion = self.stop(now)
        end, still = motion.position_of(goal), np.zeros_like(motion.origin)
        first = motion.trajectory.segments[0].reversed
        back = [first, *self._retraced(motion, [now, *trail])]
        exits = [segment.state(segment.duration) for segment in back]
        times = np.cumsum([segment.duration for segment in back])
        times += [float((np.abs(x - end) / self._speed).max()) for x, _ in exits]
        for k in times.argsort().tolist():
            yield None
            last = self._generator.between(exits[k], (end, still))
            if last is not None and self._is_free(motion, last):
                motion.trajectory.extend([*back[: k + 1], Segment.whole(last)])
                return motion
        return None

    def shorten(self, motion: Motion) -> Iterator[None]:
        """Shorten a motion, also while it is followed; yield now and then."""
        return shorten_trajectory(
            motion.trajectory,
            self._generator,
            attempts=SHORTCUTS,
            spacing=self._spacing,
            clearance=lambda x: self._clearance(motion.configuration_of(x)),
            min_clearance=MIN_CLEARANCE,
            begin=lambda: motion.clock + FIXED_TIME,
            rng=np.random.default_rng(0),
        )

    def rejoin(self, motion: Motion, now: TimedState) -> None:
        """Lead a robot that was delayed directly to a later part of its motion."""
        self._skip(motion, now)
        delay = self.catch_up_time(motion, now)
        if delay < CATCH_UP_LIMIT:
            return
        start = motion.position_of(now.q), now.v
        best, least = None, MAX_LOSS * delay
        for ahead in REJOIN_TIMES:
            time = min(motion.clock + ahead, motion.trajectory.duration)
            profile = self._generator.between(start, motion.trajectory.state(time))
            if profile is None:
                continue
            lost = profile.duration - (time - motion.clock)
            if lost < least and self._is_free(motion, profile):
                best, least = (profile, time), lost
        if best is not None:
            motion.trajectory.replace(0.0, Segment.whole(best[0]), best[1])
            motion.clock = 0.0

    def delay(self, motion: Motion, now: TimedState) -> float:
        """Return the tracking error of a motion, in seconds at full speed."""
        return float((self._error(motion, now) / self._speed).max())

    def catch_up_time(self, motion: Motion, now: TimedState) -> float:
        """Return how long the robot needs to remove the tracking error, s.

        A fast joint of small acceleration has a small delay for a long time.
        """
        error = self._error(motion, now)
        times = np.maximum(error / self._speed, np.sqrt(error / self._acceleration))
        return float(times.max())

    def _skip(self, motion: Motion, now: TimedState) -> None:
        """Advance the clock to a later state that the robot is nearer to.

        A robot that was stopped before it could turn round need not go out first.
        """
        x = motion.position_of(now.q)
        clocks = motion.clock + SKIP_STEP * np.arange(SKIP_STEPS)
        states = [motion.trajectory.state(clock)[0] for clock in clocks.tolist()]
        times = (np.abs(np.array(states) - x) / self._speed).max(axis=1)
        nearest = int(times.argmin())
        if times[nearest] < MAX_LOSS * times[0]:
            motion.clock = min(float(clocks[nearest]), motion.trajectory.duration)

    def _retraced(
        self, motion: Motion, trail: Sequence[TimedState]
    ) -> Iterator[Segment]:
        """Yield segments along a trail, as fast as the robot came or faster."""
        x = [motion.position_of(state.q) for state in trail]
        steps = -np.diff([state.time for state in trail])
        v = -np.array([state.v for state in trail])
        limits = {"speed": self._speed, "acceleration": self._acceleration}
        scales = retrace_scales(v, steps, **limits)
        states = list(zip(x, scales[:, None] * v, strict=True))
        durations = 2.0 * steps / (scales[1:] + scales[:-1])
        for (a, b), time in zip(itertools.pairwise(states), durations, strict=True):
            profile = self._generator.between(
                a, b, min_duration=float(time), acceleration_scale=RETRACE_SCALE
            )
            if profile is None:
                return
            yield Segment.whole(profile)

    def _lines(self, motion: Motion, path: Sequence[Vector]) -> Iterator[Segment]:
        positions = [motion.position_of(q) for q in path]
        for a, b in itertools.pairwise(positions):
            yield Segment.whole(self._generator.line(a, b))

    def _profile(self, now: TimedState, goal: Vector) -> ruckig.Trajectory | None:
        still = np.zeros_like(now.v)
        end = pin.difference(self._model, now.q, goal)
        return self._generator.between((still, now.v), (end, still))

    def _motion(self, now: TimedState, profile: ruckig.Trajectory) -> Motion:
        return Motion(self._model, now.q, Trajectory([Segment.whole(profile)]))

    def _is_free(self, motion: Motion, profile: ruckig.Trajectory) -> bool:
        """Whether a profile is free, apart from links that collide at its start."""

        def clearance(x: Vector) -> float:
            return self._clearance(motion.configuration_of(x))

        segment, begin = Segment.whole(profile), 0.0
        start = clearance(segment.state(0.0)[0])
        if start < START_TOLERANCE:
            least = min(0.0, start) - START_TOLERANCE
            for begin in segment.check_times(self._spacing):
                found = clearance(segment.state(begin)[0])
                if found < least:
                    return False
                if found > 0.0:
                    break
        checked = segment.check_positions(self._spacing, begin=begin)
        return all(clearance(x) > 0.0 for x in checked)

    def _error(self, motion: Motion, now: TimedState) -> Vector:
        return np.abs(pin.difference(self._model, now.q, motion.configuration()))


def plan_motion(
    model: pin.Model,
    start: Vector,
    goal: Vector,
    *,
    clearance: Clearance,
    acceleration: float | Vector,
    speed: float | Vector | None = None,
    spacing: float = 0.005,
) -> Motion | None:
    """Return a free motion from rest to rest, or None if no path was found.

    It is direct where that is free; else RRT-Connect finds a path, which is
    time-parameterised and shortened.

    Args:
        model: Any model whose joints have one parameter each.
        start: First configuration, shape (nq,); should be free.
        goal: Last configuration.
        clearance: Clearance of a configuration, m; free where it is positive.
        acceleration: Acceleration limits, one or shape (nv,).
        speed: Velocity limits, one or shape (nv,); the model's when absent.
        spacing: Time between two collision checks, s.

    Raises:
        ConfigError: If a joint has several parameters, or a limit is not positive.
    """
    if model.nq != model.nv:
        raise ConfigError(
            f"Model '{model.name}': motions are planned for joints of one parameter; "
            f"it has nq = {model.nq} and nv = {model.nv}. Lock the others."
        )
    speeds = np.full(model.nv, model.velocityLimit if speed is None else speed, float)
    rates = np.full(model.nv, acceleration, float)
    if not (speeds > 0.0).all() or not (rates > 0.0).all():
        raise ConfigError("Velocity and acceleration limits must be positive.")
    spacings = {"spacing": spacing, "path_spacing": spacing}
    planner = MotionPlanner(
        model, clearance, speed=speeds, acceleration=rates, **spacings
    )
    now = TimedState(0.0, np.array(start, float), np.zeros(model.nv))
    goal = np.array(goal, float)
    return planner.direct(now, goal) or planner.plan(now, goal)
