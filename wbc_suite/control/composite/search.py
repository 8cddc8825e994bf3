"""Find a configuration that meets far targets, before moving towards them.

Differential inverse kinematics goes downhill from where the robot is, and far targets
have valleys in between. The search lets the same QP run ahead on a copy of the robot,
from several starts, a few iterations per solve of the controller.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pinocchio as pin

from wbc_suite.control.composite.config import WholeBodyIKConfig
from wbc_suite.control.composite.tasks import (
    HURRY,
    held_equality,
    joint_speeds,
    make_task,
    soles_of,
    travel_costs,
)
from wbc_suite.control.composite.travel import Passed, Router, Way
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

__all__ = ["GoalSearch"]

STEP = 0.1  # s; one iteration goes as far as joints can in this time
ITERATIONS = 40  # of one start
STARTS = 16
MORE_STARTS = 24  # once some configuration is known, for a nearer one
QUICK = 0.7  # s; a configuration this near is taken at once, others are compared
WAITING = 4e-4  # s; and one that is farther by what an iteration takes, later
PATIENCE = 5  # iterations without progress end a start
NEARBY = 0.05  # [cost] s; how dear it is to be a second away from the start
NEAR_TIME = 0.5  # s; every second random start lies within this time of the first
GAIN = 0.05  # s; a way must be so much shorter to be taken instead
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
        room: Tells how much farther apart links are than they must be, m.
        apart: Keeps links apart, where they are not at a configuration found.
        accelerations: What velocities can accelerate and brake, shape (nv,).

    Attributes:
        router: Plans the ways to what is found.
    """

    def __init__(
        self,
        robot: RobotDescription,
        config: WholeBodyIKConfig,
        room: Callable[[Vector], float],
        apart: Sequence[Limit],
        accelerations: Vector,
    ) -> None:
        self._room = room
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
        soles = soles_of(config)
        if soles:
            margin = config.limits.balance_margin + INSIDE
            limits.append(SupportLimit(soles, margin=margin))
        self._start = PostureTask(
            NEARBY, costs=travel_costs(robot, NEARBY), max_speed=HURRY, name="start"
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
            for tasks, rows in (((self._start,), ()), ((), ()), ((), apart))
        )
        self._speeds = joint_speeds(robot, self._configuration)
        self.router = Router(
            self._configuration.model, room, speed=self._speeds, rate=accelerations
        )
        self._run: Iterator[Way | None] | None = None
        self._best: Way | None = None
        self._stopping: Way | None = None
        self._blocked: Vector | None = None

    @property
    def is_running(self) -> bool:
        """Whether there are starts left to try."""
        return self._run is not None

    def stop(self) -> None:
        """Give up."""
        self._run = None

    def start(
        self,
        goals: Sequence[pin.SE3],
        starts: Sequence[Vector],
        held: Vector,
        trail: Sequence[Passed] = (),
    ) -> None:
        """Begin.

        Args:
            goals: Goals of all controlled frames in the world.
            starts: Configurations to start from, best first.
            held: Configuration that tells where held frames are.
            trail: Where the robot was, last first: a way back that is known.
        """
        self._trail = trail
        self._configuration.update(held)
        for equality in self._held:
            equality.set_target(self._configuration.frame_pose(equality.frame))
        for k, task in zip(self._frames, self._tasks, strict=True):
            _aim(task, goals[k])
        self._run = self._search([q.copy() for q in starts])

    def advance(self, iterations: int, now: Passed) -> Way | None:
        """Run some iterations; return a way once one is known, or a shorter one.

        It may still change ahead of the robot while the search is running.

        Args:
            iterations: How many.
            now: Where the robot is, and how fast.
        """
        self._now = now
        for _ in range(iterations):
            if self._run is None:
                return None
            try:
                found = next(self._run)
            except StopIteration:
                self._run = None
                return None
            if found is not None:
                return found
        return None

    def _search(self, starts: list[Vector]) -> Iterator[Way | None]:
        """Yield None after each iteration, and better and better ways."""
        rng = np.random.default_rng(0)
        self._best = self._stopping = self._blocked = None
        iterations, trial = 0, 0
        while trial < (MORE_STARTS if self._best or self._stopping else STARTS):
            q = starts[trial] if trial < len(starts) else self._random(starts[0], rng)
            trial += 1
            for found in self._descend(q):
                iterations += 1
                if found is None:
                    yield None
                else:
                    yield from self._judge(found)
                if self._left < QUICK + WAITING * iterations:
                    yield from self._improve()
                    return
        yield from self._improve()

    def again(self, way: Way) -> None:
        """Look for another way to the same end, for the robot was held up on this."""
        self._best = way
        self._run = self._replace(way.place(way.motion.end))

    def _replace(self, end: Vector) -> Iterator[Way | None]:
        best = self._best
        yield from self._judge(end)
        if self._best is not best:
            yield from self._improve()

    @property
    def _left(self) -> float:
        """How long the best way still takes, and what is to be made up on it, s."""
        best = self._best
        return (
            np.inf
            if best is None
            else best.left + self.router.recovery(best, self._now)
        )

    def _judge(self, found: Vector) -> Iterator[Way | None]:
        """Yield the way to a configuration that has been found, if it is the best."""
        yield None
        now = self._now
        if self.router.time(now, found) > self._left - GAIN:
            return
        way = self.router.direct(now, found)
        if way is None:
            if self._best is None:
                self._blocked = found
            way = yield from self.router.back(now, found, self._trail)
        if way is not None and way.left < self._left - GAIN:
            self._best = way
            yield way
        elif self._best is None and self._stopping is None:
            self._stopping = self.router.stop(now)
            yield self._stopping

    def _improve(self) -> Iterator[Way | None]:
        """Go round what is in the way, if nothing else is known; shorten the way."""
        if self._best is None and self._blocked is not None:
            assert self._stopping is not None
            yield from self.router.round(self._stopping, self._blocked)
            self._best = self._stopping
        if self._best is not None:
            yield from self.router.shorten(self._best)

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
                accepted = self._room(q) > 0.0
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
            errors = task.error(self._configuration).tolist()
            if isinstance(task, FrameTask):
                costs = task.packed[12:18].tolist()
                errors = [
                    e for e, cost in zip(errors, costs, strict=True) if cost > 0.0
                ]
            worst = max([worst, *map(abs, errors)])
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


def _aim(task: FrameTask | ComTask, goal: pin.SE3) -> None:
    if isinstance(task, FrameTask):
        task.set_target(goal)
    else:
        task.set_target(goal.translation)
