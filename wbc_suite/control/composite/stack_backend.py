"""Inverse kinematics by this package's own QP task stack."""

from collections.abc import Callable
from functools import partial

from wbc_suite.control.composite.backend import Explanation, IkStep
from wbc_suite.control.composite.config import WholeBodyIKConfig
from wbc_suite.control.composite.effort import EffortGuard
from wbc_suite.control.composite.tasks import (
    FOLLOW,
    HURRY,
    accelerations,
    held_equality,
    make_limits,
    make_task,
    travel_costs,
)
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    ComTask,
    Equality,
    FrameEquality,
    FrameTask,
    LimitKind,
    PostureTask,
    Solution,
    SupportLimit,
    TaskStack,
    TickRecord,
)
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Matrix, Vector

__all__ = ["StackBackend"]

_ROWS = (
    LimitKind.SELF_COLLISION,
    LimitKind.BALANCE,
    LimitKind.EFFORT,
    LimitKind.FLOOR,
)
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
        self._places = [_place_of_target(task) for task in self._tasks]
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
        self._guard = EffortGuard(
            robot,
            self.configuration,
            accelerations(robot, config, self.configuration),
        )
        self._joints = PostureTask(
            1.0,
            costs=travel_costs(robot, FOLLOW),
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

    def set_targets(self, targets: Matrix) -> None:
        """Set the targets of all controlled frames."""
        for (place, part), target in zip(self._places, targets, strict=True):
            place[:] = target[part]

    def set_posture(self, q: Vector) -> None:
        """Set the posture to prefer."""
        self._posture.set_target(q)

    def solve(self, q: Vector, dt: float) -> IkStep:
        """Solve one tick of the stack."""
        self.configuration.update(q)
        return self._step(self._stack, self._joint_stack, dt, record=self._record)

    def solve_posture(self, q: Vector, posture: Vector, dt: float) -> IkStep:
        """Solve one tick of the stack without frames."""
        self.configuration.update(q)
        self._joints.set_target(posture)
        return self._step(self._joint_stack, self._stack, dt)

    def _record(self) -> Explanation:
        return partial(_reasons, self._stack.record())

    def _step(
        self,
        stack: TaskStack,
        other: TaskStack,
        dt: float,
        record: Callable[[], Explanation] | None = None,
    ) -> IkStep:
        solution = stack.solve(dt)
        v = self._guard.able(other.v_previous, solution.v, dt)
        stack.v_previous[:] = other.v_previous[:] = v
        limits = partial(_words, solution)
        return IkStep(v=v, limits=limits, ok=solution.ok, record=record)


def _place_of_target(task: FrameTask | ComTask) -> tuple[Vector, slice]:
    """Return where a task keeps its target, and which part of a pose that is."""
    if isinstance(task, FrameTask):
        return task.packed[:12], slice(12)
    return task.packed[:3], slice(3, 12, 4)


def _reasons(tick: TickRecord) -> dict[str, tuple[str, ...]]:
    reports = tick.explain(position_tolerance=0.0, orientation_tolerance=0.0)
    return {name: report.reasons for name, report in reports.items()}


def _words(solution: Solution) -> tuple[tuple[str | None, str], ...]:
    found = [
        (None if limit.kind in _ROWS else limit.name, str(limit))
        for limit in solution.active
    ]
    found += [(None, f"conflict: {name}") for name in solution.conflicts]
    return tuple(found)
