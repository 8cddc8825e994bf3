"""Inverse kinematics by this package's own QP task stack."""

from dataclasses import replace

import pinocchio as pin

from wbc_suite.control.composite.backend import IkStep
from wbc_suite.control.composite.config import WholeBodyIKConfig
from wbc_suite.control.composite.tasks import (
    HURRY,
    held_equality,
    make_limits,
    make_task,
    planar_joints,
)
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    Equality,
    FrameEquality,
    FrameTask,
    LimitKind,
    PostureTask,
    Solution,
    SupportLimit,
    TaskStack,
)
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Vector

__all__ = ["StackBackend"]

_ROWS = (LimitKind.SELF_COLLISION, LimitKind.BALANCE, LimitKind.EFFORT)
"""Limits of no single joint."""


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
        self._tasks = [make_task(frame) for frame in config.frames]
        self._held = [held_equality(held) for held in config.held]
        equalities: list[Equality] = list(self._held)
        if robot.root.kind == "planar" and robot.root.drive == "differential":
            base = robot.links[0].name
            sideways = FrameEquality(base, directions=("y",), hold_pose=False)
            equalities.append(sideways)
        limits = make_limits(robot, config)
        self._support = [x for x in limits if isinstance(x, SupportLimit)]
        self._stack = TaskStack(
            self.configuration,
            [*self._tasks, self._posture],
            limits=limits,
            equalities=equalities,
            escape=False,
        )
        self._joints = PostureTask(
            1.0,
            costs=dict.fromkeys(planar_joints(robot), 1.0),
            max_speed=HURRY,
            name="configuration",
        )
        self._joint_stack = TaskStack(
            self.configuration,
            [self._joints],
            limits=limits,
            equalities=equalities,
            escape=False,
        )

    def reset(self, q: Vector) -> None:
        """Forget the past; hold feet and centre of mass where q puts them."""
        self.configuration.update(q)
        for held in self._held:
            held.set_target(self.configuration.frame_pose(held.frame))
        for limit in self._support:
            limit.reset()
        self._stack.reset()
        self._joint_stack.reset()

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
        answer = self._step(self._stack, self._joint_stack, dt)
        return replace(answer, explain=self._explain)

    def solve_posture(self, q: Vector, posture: Vector, dt: float) -> IkStep:
        """Solve one tick of the stack without frames."""
        self.configuration.update(q)
        self._joints.set_target(posture)
        return self._step(self._joint_stack, self._stack, dt)

    def _explain(self) -> dict[str, tuple[str, ...]]:
        reports = self._stack.explain(position_tolerance=0.0, orientation_tolerance=0.0)
        return {name: report.reasons for name, report in reports.items()}

    @staticmethod
    def _step(stack: TaskStack, other: TaskStack, dt: float) -> IkStep:
        solution = stack.solve(dt)
        other.v_previous[:] = solution.v
        return IkStep(v=solution.v, limits=_words(solution), ok=solution.ok)


def _words(solution: Solution) -> tuple[tuple[str | None, str], ...]:
    found = [
        (None if limit.kind in _ROWS else limit.name, str(limit))
        for limit in solution.active
    ]
    found += [(None, f"conflict: {name}") for name in solution.conflicts]
    return tuple(found)
