"""Search for a configuration that meets distant targets, and plan a motion to it.

Differential inverse kinematics descends from where the robot is, and distant targets
have local minima in between. The search runs the same QP on a copy of the robot, from
several initial configurations, a few iterations at a time.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.configuration import UNLIMITED
from wbc_suite.planning.collision_checker import Clearance
from wbc_suite.planning.motion_planner import MotionPlanner
from wbc_suite.planning.trajectory import Motion, TimedState
from wbc_suite.qp import (
    FrameEquality,
    JointTask,
    Limit,
    PostureTask,
    RowTask,
    Task,
    TaskStack,
)
from wbc_suite.typing import Vector

STEP = 0.1  # s; one iteration goes as far as joints can in this time,
STRIDE = 0.2  # rad or m; or in the time in which the fastest joint goes this far
MAX_ITERATIONS = 40  # from one initial configuration
STARTS = 150  # two arms need dozens: of 10 goals of Nextage's 16 starts met 3
MORE_STARTS = 24  # once some configuration is known, for a nearer one
DETOURS = 6  # configurations to which a path around obstacles is searched
QUICK = 0.7  # s; a configuration this near is taken at once, others are compared
ITERATION_COST = 4e-4  # s; a later one may be farther by this for each iteration
PATIENCE = 5  # iterations without progress end a start
NEAR_TIME = 0.5  # s; every second random start lies within this time of the first
MIN_GAIN = 0.05  # s; a motion must be so much shorter to replace the best
CLOSE = 0.02
"""m and rad. Nearer than this only the targets count; and one that is so near is taken
if no configuration meets them."""
MET = 1e-7  # m and rad


@dataclass(frozen=True, kw_only=True)
class GoalProblem:
    """What a goal configuration must meet.

    Attributes:
        configuration: The robot; moved by the search.
        tasks: Tasks to meet, which ask for the whole error in one step. Their owner
            sets their targets.
        error: Returns the largest error of the tasks at the configuration, m or rad.
        equalities: Frames that stay where they are.
        limits: Limits to keep.
        distance_limits: Limits that a solution without them may violate.
        start: Pull to the initial configuration.
        speed: Velocity limits, shape (nv,).
    """

    configuration: Configuration
    tasks: Sequence[Task]
    error: Callable[[], float]
    equalities: Sequence[FrameEquality]
    limits: Sequence[Limit]
    distance_limits: Sequence[Limit]
    start: PostureTask
    speed: Vector

    def stack(self, *tasks: Task, limits: Sequence[Limit] = ()) -> TaskStack:
        """Return a stack of the problem with further tasks and limits."""
        return TaskStack(
            self.configuration,
            [*self.tasks, *tasks],
            limits=[*self.limits, *limits],
            joint_limits=False,
            equalities=self.equalities,
            damping=1e-6,
            curvature_damping=0.02,
            escape=False,
        )


class GoalSearch:
    """Searches for a configuration that meets a problem, and the motion to it.

    Starts from the configurations given, then from random ones, the same in each call.
    If none of them leads to a configuration that meets the problem, the nearest that
    was found is taken, if it is nearer than `CLOSE`.
    """

    def __init__(
        self, problem: GoalProblem, clearance: Clearance, planner: MotionPlanner
    ) -> None:
        self._problem, self._clearance, self._planner = problem, clearance, planner
        self._configuration = problem.configuration
        self._step = max(STEP, STRIDE / float(problem.speed.max(initial=1e-9)))
        self._near = problem.stack(problem.start)
        self._exact = problem.stack()
        self._apart = problem.stack(limits=problem.distance_limits)
        self._run: Iterator[Motion | None] | None = None
        self._best: Motion | None = None
        self._stopping: Motion | None = None
        self._blocked: list[Vector] = []
        self._tried = 0  # of the blocked ones
        self._nearest, self._least = problem.configuration.q.copy(), CLOSE
        configuration = self._configuration
        supports = [configuration.support(e.frame) for e in problem.equalities]
        if any(isinstance(task, JointTask) for task in problem.tasks):
            supports.append(np.arange(configuration.nv))
        rows = [task for task in problem.tasks if isinstance(task, RowTask)]
        supports += [task.support(configuration) for task in rows]
        self._moving = {int(v) for support in supports for v in support}

    @property
    def is_running(self) -> bool:
        """Whether there is something left to try."""
        return self._run is not None

    def stop(self) -> None:
        """Give up."""
        self._run = None

    def start(
        self, starts: Sequence[Vector], held: Vector, trail: Sequence[TimedState] = ()
    ) -> None:
        """Begin at initial configurations (nq,), best first; tasks have their targets.

        Frames of equalities are held as they are at `held`. The trail has earlier
        states of the robot, the latest first.
        """
        self._trail = trail
        self._configuration.update(held)
        for equality in self._problem.equalities:
            equality.set_target(self._configuration.frame_pose(equality.frame))
        self._run = self._search([q.copy() for q in starts])

    def replan(self, motion: Motion) -> None:
        """Begin to look for another motion to the same goal."""
        self._best = motion
        self._run = self._replace(motion.goal)

    def advance(self, iterations: int, now: TimedState) -> Motion | None:
        """Run some iterations; return a motion once one is known, or a shorter one.

        It may still change ahead of the robot, which is at `now`, while the search is
        running.
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

    def _search(self, starts: list[Vector]) -> Iterator[Motion | None]:
        """Yield None after each iteration, and better and better motions."""
        rng = np.random.default_rng(0)
        self._best = self._stopping = None
        self._blocked.clear()
        self._tried = 0
        self._least = CLOSE
        iterations, trial = 0, 0
        while trial < (MORE_STARTS if self._best else STARTS):
            if trial == MORE_STARTS:
                yield from self._detour()
            q = starts[trial] if trial < len(starts) else self._random(starts[0], rng)
            trial += 1
            for found in self._descend(q):
                iterations += 1
                if found is None:
                    yield None
                else:
                    yield from self._compare(found)
                if self._remaining < QUICK + ITERATION_COST * iterations:
                    yield from self._improve()
                    return
        if self._least < CLOSE and not (self._best or self._stopping):
            yield from self._compare(self._nearest)
        yield from self._improve()

    def _replace(self, goal: Vector) -> Iterator[Motion | None]:
        best = self._best
        yield from self._compare(goal)
        if self._best is not best:
            yield from self._improve()

    @property
    def _remaining(self) -> float:
        """Time left on the best motion, with what is to be caught up, s."""
        best = self._best
        if best is None:
            return np.inf
        return best.remaining + self._planner.catch_up_time(best, self._now)

    def _compare(self, found: Vector) -> Iterator[Motion | None]:
        """Yield the motion to a configuration that has been found, if it is best."""
        yield None
        now, planner = self._now, self._planner
        if planner.duration_to(now, found) > self._remaining - MIN_GAIN:
            return
        motion = planner.direct(now, found)
        if motion is None:
            self._blocked.append(found)
            motion = yield from planner.retrace(now, found, self._trail)
        if motion is not None and motion.remaining < self._remaining - MIN_GAIN:
            self._best = motion
            yield motion
        elif self._best is None and self._stopping is None:
            self._stopping = planner.stop(now)
            yield self._stopping

    def _improve(self) -> Iterator[Motion | None]:
        """Plan around obstacles, or else straight; shorten the motion."""
        yield from self._detour()
        if self._best is None and self._blocked:
            assert self._stopping is not None
            self._planner.straight(self._stopping, self._blocked[0])
            self._best = self._stopping
        if self._best is not None:
            yield from self._planner.shorten(self._best)

    def _detour(self) -> Iterator[None]:
        """Plan around obstacles to configurations that were found since, if need be."""
        goals = self._blocked[self._tried :][:DETOURS]
        if self._best is None and goals:
            assert self._stopping is not None
            self._tried = len(self._blocked)
            if (yield from self._planner.around(self._stopping, goals)):
                self._best = self._stopping

    def _descend(self, q: Vector) -> Iterator[Vector | None]:
        """Yield None after each iteration, and configurations that meet the targets."""
        for stack in (self._near, self._exact, self._apart):
            stack.reset()
        self._problem.start.set_target(q)
        stack, best, waited = self._near, np.inf, 0
        for _ in range(MAX_ITERATIONS):
            self._configuration.update(q)
            error = self._problem.error()
            if error < MET:
                accepted = self._clearance(q) > 0.0
                if accepted:
                    yield q
                if accepted or stack is self._apart:
                    return
                stack, best, waited = self._apart, np.inf, -PATIENCE
            if error < self._least and self._clearance(q) > 0.0:
                self._nearest, self._least = q, error
            waited = 0 if error < 0.95 * best else waited + 1
            best = min(best, error)
            if waited > PATIENCE and stack is not self._near:
                return
            if stack is self._near and (error < CLOSE or waited > 2):
                stack = self._exact
            q = self._configuration.integrate(stack.solve(self._step).dq)
            yield None

    def _random(self, q: Vector, rng: np.random.Generator) -> Vector:
        """Return random joints, within their limits or near q; the root stays.

        Endless joints are drawn up to half a turn from q. Those that move no task and
        no held frame stay: they could only collide.
        """
        model, drawn = self._configuration.model, q.copy()
        low, high = model.lowerPositionLimit, model.upperPositionLimit
        draw = rng.uniform(size=model.nq)
        near = rng.uniform() < 0.5
        root = {*self._configuration.root_linear, *self._configuration.root_angular}
        for joint in list(model.joints)[1:]:
            k = joint.idx_q
            if joint.idx_v not in self._moving or joint.idx_v in root:
                continue
            if joint.nq > 1 or not low[k] < high[k]:
                continue
            turn = np.pi if high[k] > UNLIMITED else np.inf
            far = min(
                turn, NEAR_TIME * self._problem.speed[joint.idx_v] if near else turn
            )
            least, most = max(low[k], q[k] - far), min(high[k], q[k] + far)
            drawn[k] = least + draw[k] * (most - least)
        return drawn
