"""Kinematic look-ahead: how well hands get along a chain of poses."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from wbc_suite.control import RobotState
from wbc_suite.experts.descent import cost_of, descend
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.forward import JointKind, robot_arrays
from wbc_suite.qp import FrameTask, PositionLimit, PostureTask, TaskStack, VelocityLimit
from wbc_suite.typing import Vector

SWEEP = 0.4  # of the greatest velocity of joints, on a sweep


@dataclass(frozen=True, kw_only=True, slots=True)
class Prediction:
    """What hands would meet along a chain of poses.

    Attributes:
        error: Largest error at a pose, m, with 0.1 m for each rad.
        margin: Least distance of a joint from its limits at a pose, rad or m.
        dexterity: Least singular value of the hands' Jacobians on the way, from below.
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
        return cost_of(self.duration, self.error, self.margin, self.dexterity)


class LookAhead:
    """Follows chains of poses with differential IK, on a copy of the robot.

    Args:
        state: The robot.
        joints: The joints that move the hands; others stay where they are, and those
            that only Pinocchio computes, such as balls in sockets.
        frames: The frame of each hand.
    """

    def __init__(self, state: RobotState, joints: Sequence[str], *frames: str) -> None:
        self._state, self._frames = state, frames
        model = state.robot.to_pinocchio()
        kinds = zip(
            model.names, robot_arrays(model).joints["kind"].tolist(), strict=True
        )
        moving = {name for name, kind in kinds if kind != JointKind.OTHER} & {*joints}
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
        times, met = before.times.copy(), (before.error, before.margin)
        self._stack.reset()
        error, dexterity = descend(
            self._stack.arrays, self._speed, times, *met, before.dexterity, most
        )
        q = self._configuration.q[self._limited]
        gaps = np.minimum(q - self._low, self._high - q)
        return replace(
            before,
            error=max(before.error, error),
            margin=min(before.margin, float(gaps.min(initial=np.inf))),
            dexterity=dexterity,
            times=times,
        )
