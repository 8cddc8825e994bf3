"""Find a configuration that meets far targets, before moving towards them.

Differential inverse kinematics goes downhill from where the robot is, and far targets
have valleys in between. The search lets the same QP run ahead on a copy of the robot,
from several starts, a few iterations per solve of the controller.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import TypeAlias

import numpy as np
import pinocchio as pin

from wbc_suite.control.composite.approach import travel_time
from wbc_suite.control.composite.config import WholeBodyIKConfig
from wbc_suite.control.composite.tasks import (
    HURRY,
    held_equality,
    joint_speeds,
    make_task,
    planar_joints,
    soles_of,
)
from wbc_suite.control.composite.way import WayFinder
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    ComTask,
    FrameTask,
    Limit,
    PositionLimit,
    PostureTask,
    SupportLimit,
    TaskStack,
    VelocityLimit,
)
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Vector

__all__ = ["GoalSearch", "Way"]

Way: TypeAlias = list[Vector]
"""Configurations to pass through, with straight lines in between."""

STEP = 0.1  # s; one iteration goes as far as joints can in this time
ITERATIONS = 40  # of one start
STARTS = 16
MORE_STARTS = 24  # once some configuration is known, for a nearer one
QUICK = 0.7  # s; a configuration this near is taken at once, others are compared
WAITING = 4e-4  # s; and one that is farther by what an iteration takes, later
SPACING = 0.02  # s; between configurations on the way that must be acceptable too
PATIENCE = 5  # iterations without progress end a start
NEARBY = 0.05  # [cost] s; how dear it is to be a second away from the start
NEAR_TIME = 0.5  # s; every second random start lies within this time of the first
CHECKS = 1500  # configurations that the search for a way round may look at
DETOUR = 1.0  # s; what a way round takes longer than a straight line
CLOSE = 0.02  # m and rad; from here on only the targets count
MET = 1e-7  # m and rad
INSIDE = 2e-3  # m; how much further from the soles' edges than the controller


class GoalSearch:
    """Searches a configuration at which all frames of level 0 meet their targets.

    Starts from where the robot is, from its posture, and from random configurations,
    always the same ones. Joint limits and held frames are kept.

    Args:
        robot: The reduced robot.
        config: Controlled and held frames.
        accept: Tells whether a configuration will do, such as free of collision.
        apart: Keeps links apart, where they are not at a configuration found.
        accelerations: What velocities can accelerate and brake, shape (nv,).
    """

    def __init__(
        self,
        robot: RobotDescription,
        config: WholeBodyIKConfig,
        accept: Callable[[Vector], bool],
        apart: Limit,
        accelerations: Vector,
    ) -> None:
        self._accept, self._accelerations = accept, accelerations
        self._configuration = Configuration(robot.to_pinocchio())
        first = [(k, f) for k, f in enumerate(config.frames) if f.level == 0]
        self._frames = [k for k, _ in first]
        self._tasks = [make_task(frame, unhurried=False) for _, frame in first]
        self._held = [held_equality(held) for held in config.held]
        linear, angular = robot.root.velocity
        limits: list[Limit] = [
            PositionLimit(
                margin=2.0 * config.limits.position_margin,
                joints=config.limits.positions,
            ),
            VelocityLimit(base_linear=linear, base_angular=angular),
        ]
        self._speeds = joint_speeds(robot, self._configuration)
        soles = soles_of(config)
        if soles:
            margin = config.limits.balance_margin + INSIDE
            limits.append(SupportLimit(soles, margin=margin))
        self._start = PostureTask(
            NEARBY, costs=_costs(robot), max_speed=HURRY, name="start"
        )
        self._near, self._exact, self._apart = (
            TaskStack(
                self._configuration,
                [*self._tasks, *tasks],
                limits=[*limits, *rows],
                equalities=self._held,
                damping=1e-6,
                curvature_damping=0.02,
                escape=False,
            )
            for tasks, rows in (((self._start,), ()), ((), ()), ((), (apart,)))
        )
        self._finder = WayFinder(self._configuration.model, self._speeds, accept)
        self._run: Iterator[Way | None] | None = None

    @property
    def is_running(self) -> bool:
        """Whether there are starts left to try."""
        return self._run is not None

    @property
    def _is_plain(self) -> bool:
        """Whether all joints have one parameter, and nothing but joints moves."""
        return self._configuration.nq == self._configuration.nv

    def stop(self) -> None:
        """Give up."""
        self._run = None

    def start(
        self, goals: Sequence[pin.SE3], starts: Sequence[Vector], held: Vector
    ) -> None:
        """Begin.

        Args:
            goals: Goals of all controlled frames in the world.
            starts: Configurations to start from, best first.
            held: Configuration that tells where held frames are.
        """
        self._configuration.update(held)
        for equality in self._held:
            equality.set_target(self._configuration.frame_pose(equality.frame))
        for k, task in zip(self._frames, self._tasks, strict=True):
            _aim(task, goals[k])
        self._run = self._search([q.copy() for q in starts])

    def advance(self, iterations: int) -> Way | None:
        """Run some iterations; return configurations to pass through once found."""
        for _ in range(iterations):
            if self._run is None:
                return None
            found = next(self._run, ())
            if found is not None:
                self._run = None
                return found or None
        return None

    def _search(self, starts: list[Vector]) -> Iterator[Way | None]:
        """Yield None after each iteration, and the way to the best found at last."""
        rng = np.random.default_rng(0)
        best: Vector | None = None
        least, is_blocked, trial, iterations = np.inf, False, 0, 0
        while trial < (STARTS if best is None else MORE_STARTS):
            q = starts[trial] if trial < len(starts) else self._random(starts[0], rng)
            trial += 1
            for found in self._descend(q):
                time = np.inf if found is None else self._time(starts[0], found)
                if found is not None and time < least:
                    blocked = self._is_blocked(starts[0], found)
                    time += blocked * DETOUR
                    if time < least:
                        best, least, is_blocked = found, time, blocked
                iterations += 1
                is_quick = least < QUICK + WAITING * iterations
                yield [best] if best is not None and is_quick else None
        if best is None:
            return
        if is_blocked and self._is_plain:
            for way in self._finder.find(starts[0], best, CHECKS):
                yield way and way[1:]
        yield [best]

    def _time(self, start: Vector, end: Vector) -> float:
        """Return how long joints need from rest at one configuration to another, s."""
        step = pin.difference(self._configuration.model, start, end)
        times = travel_time(
            np.abs(step), speed=self._speeds, acceleration=self._accelerations
        )
        return float(times.max())

    def _is_blocked(self, start: Vector, end: Vector) -> bool:
        """Tell whether something is in the way, on a straight line.

        Something may be in the way at the start already: that does not count.
        """
        model = self._configuration.model
        count = max(2, int(np.ceil(self._time(start, end) / SPACING)))
        return not all(
            self._accept(pin.interpolate(model, start, end, k / count))
            for k in range(count - 1, count // 6, -1)
        )

    def _descend(self, q: Vector) -> Iterator[Vector | None]:
        """Yield None after each iteration, and configurations that meet the targets."""
        for stack in (self._near, self._exact, self._apart):
            stack.reset()
        self._start.set_target(q)
        stack, best, waited = self._near, np.inf, 0
        for _ in range(ITERATIONS):
            self._configuration.update(q)
            error = self._error()
            if error < MET:
                accepted = self._accept(q)
                if accepted:
                    yield q
                if accepted or stack is self._apart:
                    return
                stack, best, waited = self._apart, np.inf, -PATIENCE
            waited = 0 if error < 0.95 * best else waited + 1
            best = min(best, error)
            if waited > PATIENCE and stack is not self._near:
                return
            if stack is self._near and (error < CLOSE or waited > 2):
                stack = self._exact
            q = self._configuration.integrate(stack.solve(STEP).dq)
            yield None

    def _error(self) -> float:
        """Return the largest error of all frames, m or rad."""
        worst = 0.0
        for task in self._tasks:
            error = task.error(self._configuration)
            if isinstance(task, FrameTask):
                error = error * (task.packed[12:18] > 0.0)
            worst = max(worst, float(np.abs(error).max()))
        return worst

    def _random(self, q: Vector, rng: np.random.Generator) -> Vector:
        """Return random joints, within their limits or near q; the root stays."""
        model, drawn = self._configuration.model, q.copy()
        low, high = model.lowerPositionLimit, model.upperPositionLimit
        draw = rng.uniform(size=model.nq)
        near = rng.uniform() < 0.5
        root = {*self._configuration.root_linear, *self._configuration.root_angular}
        for joint in list(model.joints)[1:]:
            k = joint.idx_q
            if joint.nq > 1 or joint.idx_v in root or not low[k] < high[k] < 1e6:
                continue
            far = NEAR_TIME * self._speeds[joint.idx_v] if near else np.inf
            least, most = max(low[k], q[k] - far), min(high[k], q[k] + far)
            drawn[k] = least + draw[k] * (most - least)
        return drawn


def _costs(robot: RobotDescription) -> dict[str, float]:
    """Return costs that measure joint distances in seconds at full speed."""
    costs = {j.name: NEARBY / (j.velocity or 10.0) for j in robot.joints}
    linear, angular = robot.root.velocity
    speeds = (linear, linear, angular)
    for name, speed in zip(planar_joints(robot), speeds, strict=False):
        costs[name] = NEARBY / speed
    return costs


def _aim(task: FrameTask | ComTask, goal: pin.SE3) -> None:
    if isinstance(task, FrameTask):
        task.set_target(goal)
    else:
        task.set_target(goal.translation)
