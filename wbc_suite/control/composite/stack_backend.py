"""Inverse kinematics by this package's own QP task stack."""

import numpy as np
import pinocchio as pin

from wbc_suite.control.composite.backend import IkStep
from wbc_suite.control.composite.config import (
    ControlledFrame,
    HeldFrame,
    WholeBodyIKConfig,
)
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    AccelerationLimit,
    ComTask,
    Equality,
    FrameEquality,
    FrameTask,
    Limit,
    LimitKind,
    PositionLimit,
    PostureTask,
    Solution,
    TaskStack,
    VelocityLimit,
)
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Vector

__all__ = ["StackBackend"]


class StackBackend:
    """`IkBackend` over a `TaskStack`.

    Args:
        robot: The reduced robot.
        config: Tasks, limits and contacts.
    """

    def __init__(self, robot: RobotDescription, config: WholeBodyIKConfig) -> None:
        self._config = config
        self.configuration = Configuration(robot.to_pinocchio())
        self._posture = PostureTask(
            config.posture.cost,
            costs=config.posture.costs,
            gain=config.posture.gain,
            level=config.posture.level,
        )
        self._tasks = [_task_of(frame) for frame in config.frames]
        self._held = [_held(held) for held in config.held]
        equalities: list[Equality] = list(self._held)
        if robot.root.kind == "planar" and robot.root.drive == "differential":
            base = robot.links[0].name
            sideways = FrameEquality(base, directions=("y",), hold_pose=False)
            equalities.append(sideways)
        self._stack = TaskStack(
            self.configuration,
            [*self._tasks, self._posture],
            limits=_limits(robot, config),
            equalities=equalities,
        )

    def reset(self, q: Vector) -> None:
        """Forget the past; hold feet and centre of mass where q puts them."""
        self.configuration.update(q)
        for held in self._held:
            held.set_target(self.configuration.frame_pose(held.frame))
        self._stack.reset()

    def set_target(self, index: int, target: pin.SE3) -> None:
        """Set a controlled frame's target."""
        task = self._tasks[index]
        if isinstance(task, FrameTask):
            task.set_target(target)
        else:
            task.set_target(target.translation)

    def set_posture(self, q: Vector) -> None:
        """Set the posture to prefer."""
        self._posture.set_target(q)

    def solve(self, q: Vector, dt: float) -> IkStep:
        """Solve one tick of the stack."""
        self.configuration.update(q)
        solution = self._stack.solve(dt)
        return IkStep(v=solution.v, limits=_words(solution), ok=solution.ok)


def _task_of(frame: ControlledFrame) -> FrameTask | ComTask:
    if frame.kind == "com":
        return ComTask(
            frame.position_cost,
            gain=frame.gain,
            level=frame.level,
            max_speed=frame.max_linear_speed,
            name=frame.name,
        )
    linear, angular = frame.position_cost, frame.orientation_cost
    position, orientation = np.full(3, linear), np.full(3, angular)
    if frame.kind == "orientation":
        position[:] = 0.0
    if frame.kind == "position":
        orientation[:] = 0.0
    if frame.kind == "base":
        position[2] = orientation[0] = orientation[1] = 0.0
    return FrameTask(
        str(frame.frame),
        position_cost=position,
        orientation_cost=orientation,
        gain=frame.gain,
        level=frame.level,
        max_linear_speed=frame.max_linear_speed,
        max_angular_speed=frame.max_angular_speed,
        name=frame.name,
    )


def _held(held: HeldFrame) -> FrameEquality:
    if held.contact == "surface":
        return FrameEquality(held.frame)
    return FrameEquality(held.frame, directions=("x", "y", "z"))


def _limits(robot: RobotDescription, config: WholeBodyIKConfig) -> list[Limit]:
    limits = config.limits
    linear, angular = robot.root.velocity
    base_linear, base_angular = limits.base_acceleration
    own = {
        j.name: min(j.acceleration, limits.acceleration)
        for j in robot.joints
        if j.acceleration is not None
    }
    return [
        PositionLimit(margin=limits.position_margin),
        VelocityLimit(
            base_linear=linear, base_angular=angular, scale=limits.velocity_scale
        ),
        AccelerationLimit(
            limits.acceleration,
            joints=own,
            base_linear=base_linear,
            base_angular=base_angular,
        ),
    ]


def _words(solution: Solution) -> tuple[tuple[str | None, str], ...]:
    found = [
        (None if limit.kind is LimitKind.SELF_COLLISION else limit.name, str(limit))
        for limit in solution.active
    ]
    found += [(None, f"conflict: {name}") for name in solution.conflicts]
    return tuple(found)
