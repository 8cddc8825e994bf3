"""Where to go next: straight to the goals, or joint by joint to a known posture."""

from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.control.composite.config import WholeBodyIKConfig
from wbc_suite.control.composite.frames import ControlledFrames, JointField
from wbc_suite.control.composite.pursuit import HORIZONS, pursue
from wbc_suite.control.composite.search import GoalSearch
from wbc_suite.control.composite.tasks import accelerations, joint_speeds
from wbc_suite.control.composite.travel import HELD_UP, Passed, Way
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.array_table import ArrayTable
from wbc_suite.qp import Limit
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Matrix, Vector

__all__ = ["Planner", "Waypoint"]

STANDING = 0.02  # rad/s or m/s
STUCK_AFTER = 0.1  # s of standing
WATCHED = 0.2  # s; over which progress is judged
CRAWL = 2.0  # s; what would need longer at the present rate gets no nearer
BRISK = 0.95  # of the acceleration limits on a way
CHASE = 0.98  # of them for catching up
LATE = 0.15  # s; so far behind the clock runs slowest, so that the robot catches up
SLOWEST = 0.2
TRAIL = 60  # configurations that are remembered
TRAIL_STEP = 5  # solves between them
STRAY = 0.2  # part of the tolerance; so far off, lower levels have half their speed
HURRIED = 2  # times as many iterations where the robot stands and waits
ARRIVED = 5e-3  # rad or m; from here on goals are approached straight


class Waypoint(NamedTuple):
    """What the IK is asked for in one solve, made anew each time: see `qp.solution`.

    Attributes:
        posture: Configuration to prefer; without targets, to go to at once.
        targets: Poses of the controlled frames, [R p] row by row, shape (n, 12), or
            None to move joint by joint. A buffer.
    """

    posture: Vector
    targets: Matrix | None = None


class Planner:
    """Turns goals into targets nearby that one can brake for.

    Near goals are approached on a straight line. For far ones, and where the straight
    line ends in a trap, a configuration that meets all of level 0 is searched; joints
    then go there together, on a straight line of their own.
    A goal that no configuration meets is approached straight, as near as one gets.

    Args:
        robot: The reduced robot.
        config: Controlled frames.
        configuration: The commanded configuration; read, and moved by the owner.
        frames: Its controlled frames.
        room: Tells how much farther apart links are than they must be, m.
        apart: Keeps links apart.
        dt: Time between solves, s.
    """

    def __init__(
        self,
        robot: RobotDescription,
        config: WholeBodyIKConfig,
        configuration: Configuration,
        frames: ControlledFrames,
        *,
        room: Callable[[Vector], float],
        apart: Sequence[Limit],
        dt: float,
    ) -> None:
        self._config, self._dt = config, dt
        self._configuration, self._frames = configuration, frames
        self._first = np.flatnonzero([f.level == 0 for f in config.frames])
        able = accelerations(robot, config, configuration)
        self._able = able
        self._search = GoalSearch(robot, config, room, apart, BRISK * able)
        self._speed = joint_speeds(robot, configuration)
        nv, f = configuration.nv, JointField
        self._joints = ArrayTable(
            JointField,
            {
                f.DIFFERENCE: np.zeros(nv),
                f.SPEED: np.full(nv, config.posture.speed),
                f.BRAKING: config.posture.braking * able,
                f.STEP: np.zeros(nv),
            },
        )
        self.reset(configuration.q)

    def reset(self, posture: Vector) -> None:
        """Forget the past.

        Args:
            posture: Configuration to prefer, until a search has found another.
        """
        self._posture = self._rest = posture
        self._way: Way | None = None
        self._trail: deque[Passed] = deque(maxlen=TRAIL)
        self._solves = 0
        self._search.stop()
        self._still, self._is_new, self._answered = 0.0, False, False
        self._has_arrived = False
        self._offs: deque[float] = deque(maxlen=round(WATCHED / self._dt) + 1)

    def renew(self) -> None:
        """Say that goals have changed."""
        self._is_new = True

    def next(self, goals: Sequence[pin.SE3], v: Vector) -> Waypoint:
        """Return what to ask for now.

        Args:
            goals: Goals in the world of the commanded robot.
            v: Velocity of the last solve, shape (nv,).
        """
        self._watch(goals, v)
        self._solves += 1
        is_kept = self._solves % TRAIL_STEP == 0
        if self._way is None and not self._search.is_running and not is_kept:
            return self._straight(goals)
        now = Passed(self._solves * self._dt, self._configuration.q.copy(), v)
        if self._search.is_running:
            hurry = HURRIED if self._still > 0.0 else 1
            found = self._search.advance(hurry * self._config.search_iterations, now)
            self._way = found or self._way
        if is_kept:
            self._trail.appendleft(now)
        if self._way is not None:
            return self._along(self._way, now)
        return self._straight(goals)

    def _watch(self, goals: Sequence[pin.SE3], v: Vector) -> None:
        """Begin a search, or give a plan up, when it is time to."""
        slow = v.dot(v) < len(v) * STANDING**2  # known soon where the robot moves
        standing = slow and float(np.abs(v).max(initial=0.0)) < STANDING
        self._still = self._still + self._dt if standing else 0.0
        if self._is_new:
            self._is_new = self._answered = self._has_arrived = False
            self._still, self._way = 0.0, None
            self._offs.clear()
            self._search.stop()
            if self._is_far(goals, self._config.far):
                self._rest = self._posture
                self._begin(goals)
        elif self._search.is_running:
            return
        elif self._way is not None:
            self._way = self._way if self._still <= STUCK_AFTER else None
        elif not self._answered and self._is_stuck(goals):
            self._begin(goals)

    def _is_stuck(self, goals: Sequence[pin.SE3]) -> bool:
        """Tell whether the robot stands short of its goals, or gets hardly nearer.

        Near a singularity it creeps, faster than what counts as standing.
        """
        offs = self._offs
        slow = len(offs) == offs.maxlen and offs[-1] > offs[0] * (1 - WATCHED / CRAWL)
        waits = slow or self._still > STUCK_AFTER
        return waits and self._is_far(goals, self._config.tolerance)

    def _begin(self, goals: Sequence[pin.SE3]) -> None:
        self._answered = True
        q = self._configuration.q
        self._search.start(goals, [q, self._posture], q, self._trail)

    def _is_far(self, goals: Sequence[pin.SE3], far: tuple[float, float]) -> bool:
        return bool((self._frames.measure(goals)[self._first] > far).any())

    def _along(self, way: Way, now: Passed) -> Waypoint:
        """Return the next configuration on the way; the clock waits for the robot."""
        router = self._search.router
        if router.recovery(way, now) > HELD_UP:
            router.rejoin(way, now)
            if self._still <= STUCK_AFTER and not self._search.is_running:
                self._search.again(way)
        pace = max(SLOWEST, 1.0 - router.late(way, now) / LATE)
        wanted = self._pursuit(way, pace, now.v)
        way.clock += self._dt * pace
        after = way.configuration()
        left = self._configuration.difference(after)
        is_known = not way.left and not self._search.is_running
        if is_known and np.abs(left).max() < ARRIVED:
            self._rest, self._way = after, None
        return Waypoint(posture=self._configuration.integrate(self._dt * wanted))

    def _pursuit(self, way: Way, pace: float, v: Vector) -> Vector:
        """Return velocities that lead onto the way, whose clock runs at a pace."""
        times = np.array([self._dt, *HORIZONS])
        states = [way.motion.state(way.clock + pace * time) for time in times]
        ahead = [self._configuration.difference(way.place(x)) for x, _ in states]
        motion = pace * np.array([velocity for _, velocity in states])
        return pursue(v, np.array(ahead), motion, times, rate=CHASE * self._able)

    def _straight(self, goals: Sequence[pin.SE3]) -> Waypoint:
        """Return targets on the way to the goals, and joints on that to the posture.

        Once frames of level 0 have arrived, motion below must not take them off again
        where joints cannot follow it. What stands on its feet balances by that motion
        and must not stop it.
        """
        joints, here = self._joints, self._configuration
        joints[JointField.DIFFERENCE][:] = here.difference(self._rest)
        settling = self._dt / self._config.posture.gain
        targets = self._frames.lead(
            goals,
            joints.table,
            self._dt,
            settling=settling,
            stray=0.0 if self._config.held else STRAY,
            arrived=self._has_arrived,
        )
        self._offs.append(self._frames.off)
        self._has_arrived = self._has_arrived or self._frames.off < 1.0
        posture = here.integrate(joints[JointField.STEP])
        return Waypoint(targets=targets, posture=posture)
