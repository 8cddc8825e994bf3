"""Kinematic look-ahead: how well hands get along a chain of poses."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from wbc_suite.control import RobotState
from wbc_suite.kinematics import Configuration
from wbc_suite.linear_algebra import inverse_trace, lq_factor
from wbc_suite.qp import FrameTask, PositionLimit, PostureTask, TaskStack, VelocityLimit
from wbc_suite.typing import Matrix, Vector

STEP = 0.1  # s, time of one iteration
ITERATIONS = 60  # for each pose at most
STUCK = 2e-3  # rad or m, of joints in an iteration
CLOSE = 1e-3  # m and rad
SPAN = 3  # iterations, over which progress is measured
SWEEP = 0.4  # of the greatest velocity of joints, on a sweep
SINGULAR = 0.05  # dexterity below which controllers lag


@dataclass(frozen=True, kw_only=True, slots=True)
class Prediction:
    """What hands would meet along a chain of poses.

    Attributes:
        error: Largest error at a pose, m, with 0.1 m for each rad.
        margin: Least distance of a joint from its limits at a pose, rad or m.
        dexterity: Least `_dexterity` on the way.
        times: Time of each joint at its greatest velocity, s.
        q: Configurations at the poses.
    """

    error: float
    margin: float
    dexterity: float
    times: Vector
    q: tuple[Vector, ...]

    @property
    def duration(self) -> float:
        """Time of the slowest joint, s."""
        return float(self.times.max(initial=0.0))

    @property
    def cost(self) -> float:
        """Duration, and penalties of what is out of reach, near limits or singular."""
        near = max(0.0, 0.2 - self.margin)
        singular = 20.0 * max(0.0, SINGULAR - self.dexterity)
        far = 100.0 * max(0.0, self.error - CLOSE)
        return self.duration + far + 10.0 * near + singular


class LookAhead:
    """Follows chains of poses with differential IK, on a copy of the robot.

    Args:
        state: The robot.
        joints: The joints that move the hands; others stay where they are.
        frames: The frame of each hand.
    """

    def __init__(self, state: RobotState, joints: Sequence[str], *frames: str) -> None:
        self._state, self._frames = state, frames
        model = state.robot.to_pinocchio()
        moving = {*joints}
        locked = [i for i, n in enumerate(model.names) if i and n not in moving]
        self._start = state.q
        reduced = pin.buildReducedModel(model, locked, self._start)
        self._index = np.concatenate(
            [
                np.arange(j.idx_q, j.idx_q + j.nq)
                for j in (model.joints[model.getJointId(n)] for n in reduced.names[1:])
            ]
        )
        self._configuration = Configuration(reduced, self._start[self._index])
        self._tasks = [FrameTask(frame) for frame in frames]
        self._posture = PostureTask(3e-3)
        self._stack = TaskStack(
            self._configuration,
            [*self._tasks, self._posture],
            limits=[PositionLimit(), VelocityLimit()],
            joint_limits=False,
            escape=False,
        )
        low, high = reduced.lowerPositionLimit, reduced.upperPositionLimit
        self._limited = np.flatnonzero((high - low < 6.5) & (low < high))
        self._low, self._high = low[self._limited], high[self._limited]
        speed = reduced.velocityLimit
        self._speed = np.where((speed > 0.0) & (speed < 1e3), speed, 3.0)

    def own(self, q: Vector) -> Vector:
        """Return the joints that move the hand, of the whole robot's."""
        return q[self._index]

    def full(self, q: Vector) -> Vector:
        """Return the whole robot's configuration, the other joints as measured."""
        whole = self._state.q
        whole[self._index] = q
        return whole

    def sweep(self, q: Vector, period: float) -> Iterator[pin.SE3]:
        """Yield poses of the first frame while joints move on a straight line to q.

        One for each period, s; the slowest joint has 0.4 of its greatest velocity.
        """
        configuration, start = self._configuration, self.own(self._state.q)
        configuration.update(start)
        way = configuration.difference(q)
        count = math.ceil(float((np.abs(way) / self._speed).max()) / SWEEP / period)
        for k in range(max(count, 1)):
            configuration.update(start)
            configuration.update(configuration.integrate((k + 1) / max(count, 1) * way))
            yield configuration.frame_pose(self._frames[0])

    def along(
        self,
        poses: Iterable[Sequence[pin.SE3]],
        after: Prediction | None = None,
        *,
        most: float = math.inf,
    ) -> Prediction:
        """Follow a chain of poses in the world, each one pose for each frame.

        It begins where the hands are, or goes on `after` another prediction. It ends on
        the way once its cost is above `most`, as costs only grow; the error is
        what would be left if hands came nearer as fast as now.
        """
        configuration = self._configuration
        if after is None:
            after = Prediction(
                error=0.0,
                margin=np.inf,
                dexterity=np.inf,
                times=np.zeros(configuration.nv),
                q=(self.own(self._state.q),),
            )
            begun: tuple[Vector, ...] = ()
        else:
            begun = after.q
        configuration.update(after.q[-1])
        met, found = replace(after, q=()), [*begun]
        for targets in poses:
            for task, target in zip(self._tasks, targets, strict=True):
                task.set_target(target)
            met = self._descend(met, most)
            found.append(configuration.q.copy())
            if met.cost > most:
                break
        return replace(met, q=tuple(found))

    def _descend(self, before: Prediction, most: float) -> Prediction:
        """Move to the targets of the tasks; return what was met up to there."""
        configuration, left, earlier = self._configuration, np.inf, np.inf
        travel, least = np.zeros(configuration.nv), before.dexterity
        self._stack.reset()
        for k in range(1, ITERATIONS + 1):
            step = self._stack.solve(STEP).dq
            configuration.update(configuration.integrate(step))
            travel += np.abs(step)
            for frame in self._frames:
                least = min(least, _dexterity(configuration.frame_jacobian(frame)))
            left = self._error()
            if left < CLOSE or np.abs(step).max() < STUCK:
                break
            if most < np.inf and k % SPAN == 0:
                to_come = (ITERATIONS - k) * (earlier - left) / SPAN
                hopeful = self._met(before, travel, least, max(left - to_come, 0.0))
                if hopeful.cost > most:
                    break
                earlier = left
        met = self._met(before, travel, least, left)
        q = configuration.q[self._limited]
        gaps = np.minimum(q - self._low, self._high - q)
        return replace(met, margin=min(before.margin, float(gaps.min(initial=np.inf))))

    def _met(
        self, before: Prediction, travel: Vector, least: float, error: float
    ) -> Prediction:
        """Return a prediction with how far joints went since, and what they met."""
        return replace(
            before,
            error=max(before.error, error),
            dexterity=least,
            times=before.times + travel / self._speed,
        )

    def _error(self) -> float:
        errors = [task.error(self._configuration).tolist() for task in self._tasks]
        return max(math.hypot(*e[:3]) + 0.1 * math.hypot(*e[3:]) for e in errors)


def _dexterity(J: Matrix) -> float:
    """Return a lower bound of the least singular value of a Jacobian, shape (6, n)."""
    Q, L = np.ascontiguousarray(J), np.zeros((6, 6))
    lq_factor(Q, Q.shape[1], L)
    return float(inverse_trace(L, np.zeros(6))) ** 0.5
