"""Where to go next: straight to the goals, or joint by joint to a known posture."""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from wbc_suite.control.composite.approach import approach_pose, approach_posture
from wbc_suite.control.composite.config import ControlledFrame, WholeBodyIKConfig
from wbc_suite.control.composite.search import GoalSearch, Way
from wbc_suite.control.composite.tasks import joint_accelerations, joint_speeds
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import Limit
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Vector

__all__ = ["Planner", "Waypoint"]

STANDING = 0.02  # rad/s or m/s
STUCK_AFTER = 0.1  # s of standing
PASSED = 0.2  # rad or m; this near to a configuration on the way the next one is it
ARRIVED = 5e-3  # rad or m; from here on goals are approached straight


@dataclass(frozen=True, kw_only=True, slots=True)
class Waypoint:
    """What the IK is asked for in one solve.

    Attributes:
        posture: Configuration to prefer; without targets, to go to at once.
        targets: Poses of the controlled frames, or None to move joint by joint.
    """

    posture: Vector
    targets: list[pin.SE3] | None = None


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
        accept: Tells whether a configuration found will do.
        apart: Keeps links apart.
        dt: Time between solves, s.
    """

    def __init__(
        self,
        robot: RobotDescription,
        config: WholeBodyIKConfig,
        configuration: Configuration,
        *,
        accept: Callable[[Vector], bool],
        apart: Limit,
        dt: float,
    ) -> None:
        self._config, self._dt = config, dt
        self._configuration = configuration
        self._first = [k for k, f in enumerate(config.frames) if f.level == 0]
        self._braking = config.posture.braking * _braking(robot, config, configuration)
        self._search = GoalSearch(robot, config, accept, apart, self._braking)
        self._speed = joint_speeds(robot, configuration)
        self.reset(configuration.q)

    def reset(self, posture: Vector) -> None:
        """Forget the past.

        Args:
            posture: Configuration to prefer, until a search has found another.
        """
        self._posture = self._rest = posture
        self._plan: Way = []
        self._search.stop()
        self._still, self._is_new, self._answered = 0.0, False, False

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
        if self._search.is_running:
            found = self._search.advance(self._config.search_iterations)
            self._plan = self._plan if found is None else found
        if self._plan:
            return self._joint_by_joint()
        return self._straight(goals)

    def _watch(self, goals: Sequence[pin.SE3], v: Vector) -> None:
        """Begin a search, or give a plan up, when it is time to."""
        standing = float(np.abs(v).max(initial=0.0)) < STANDING
        self._still = self._still + self._dt if standing else 0.0
        if self._is_new:
            self._is_new = self._answered = False
            self._still, self._plan = 0.0, []
            self._search.stop()
            if self._is_far(goals, self._config.far):
                self._rest = self._posture
                self._begin(goals)
        elif self._still > STUCK_AFTER and not self._search.is_running:
            if self._plan:
                self._plan = []
            elif not self._answered and self._is_far(goals, self._config.tolerance):
                self._begin(goals)

    def _begin(self, goals: Sequence[pin.SE3]) -> None:
        self._answered = True
        q = self._configuration.q
        self._search.start(goals, [q, self._posture], q)

    def _is_far(self, goals: Sequence[pin.SE3], far: tuple[float, float]) -> bool:
        for k in self._first:
            linear, angular = _distances(
                self._config.frames[k], self.frame_pose(k), goals[k]
            )
            if linear > far[0] or angular > far[1]:
                return True
        return False

    def _joint_by_joint(self) -> Waypoint:
        difference = self._configuration.difference(self._plan[0])
        while len(self._plan) > 1 and np.abs(difference).max() < PASSED:
            self._plan.pop(0)
            difference = self._configuration.difference(self._plan[0])
        if np.abs(difference).max() < ARRIVED:
            self._rest = self._plan.pop(0)
        speed = approach_posture(
            self._to_turning_point(difference),
            dt=self._dt,
            speed=self._speed,
            acceleration=self._braking,
        )
        moved = np.abs(difference) > 1e-9
        pace = float((speed[moved] / difference[moved]).min(initial=1.0 / self._dt))
        step = self._dt * pace * difference
        return Waypoint(posture=self._configuration.integrate(step))

    def _to_turning_point(self, difference: Vector) -> Vector:
        """Return how far each joint goes the same way as to the first configuration."""
        model, run, distance = (
            self._configuration.model,
            np.sign(difference),
            difference,
        )
        for a, b in itertools.pairwise(self._plan):
            step = pin.difference(model, a, b)
            run = run * (np.sign(step) == run)
            distance = distance + np.abs(run) * step
        return distance

    def _straight(self, goals: Sequence[pin.SE3]) -> Waypoint:
        targets = [
            approach_pose(
                self.frame_pose(k),
                goals[k],
                dt=self._dt,
                gain=frame.gain,
                speed=(frame.max_linear_speed, frame.max_angular_speed),
                acceleration=(frame.linear_braking, frame.angular_braking),
            )
            for k, frame in enumerate(self._config.frames)
        ]
        posture = self._config.posture
        speed = approach_posture(
            self._configuration.difference(self._rest),
            dt=self._dt / posture.gain,
            speed=posture.speed,
            acceleration=self._braking,
        )
        return Waypoint(
            targets=targets,
            posture=self._configuration.integrate(self._dt / posture.gain * speed),
        )

    def frame_pose(self, k: int) -> pin.SE3:
        """Return the pose of a controlled frame at the commanded configuration."""
        return _frame_pose(self._configuration, self._config.frames[k])


def _frame_pose(configuration: Configuration, frame: ControlledFrame) -> pin.SE3:
    if frame.frame is None:
        return pin.SE3(np.eye(3), configuration.com.copy())
    return configuration.frame_pose(frame.frame)


def _distances(
    frame: ControlledFrame, now: pin.SE3, goal: pin.SE3
) -> tuple[float, float]:
    """Return distances that count for the frame's kind, m and rad."""
    offset = goal.translation - now.translation
    turn = pin.log3(now.rotation.T @ goal.rotation)
    if frame.kind == "base":
        offset, turn = offset[:2], turn[2:]
    linear = 0.0 if frame.kind == "orientation" else float(np.linalg.norm(offset))
    still = frame.kind in ("position", "com")
    return linear, 0.0 if still else float(np.linalg.norm(turn))


def _braking(
    robot: RobotDescription, config: WholeBodyIKConfig, configuration: Configuration
) -> Vector:
    """Return the acceleration limit of each velocity."""
    limits = np.full(configuration.nv, config.limits.acceleration)
    limits[configuration.root_linear] = config.limits.base_acceleration[0]
    limits[configuration.root_angular] = config.limits.base_acceleration[1]
    for name, value in joint_accelerations(robot, config).items():
        limits[configuration.model.joints[configuration.joint_id(name)].idx_v] = value
    return limits
