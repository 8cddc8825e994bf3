"""Inverse kinematics by this package's own QP task stack."""

from collections.abc import Callable
from functools import partial

import numpy as np

from wbc_suite.compiling import compiled
from wbc_suite.compiling_ahead import compile_ahead
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
from wbc_suite.kinematics.array_table import vector_at
from wbc_suite.qp import (
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
from wbc_suite.qp.lower_levels import lower_tick
from wbc_suite.qp.tick import tick
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["StackBackend"]

_ROWS = (
    LimitKind.SELF_COLLISION,
    LimitKind.BALANCE,
    LimitKind.EFFORT,
    LimitKind.FLOOR,
)
"""Limits of no single joint."""

POSE, POSITION = 12, 3
"""How many numbers a task keeps of its target, which come first in what it packs."""


class StackBackend:
    """`IkBackend` over a `TaskStack`.

    Args:
        robot: The reduced robot.
        config: Tasks, limits and contacts.
        commanded: The commanded configuration; read, and moved by the owner.
    """

    def __init__(
        self,
        robot: RobotDescription,
        config: WholeBodyIKConfig,
        commanded: Configuration,
    ) -> None:
        compile_ahead(tick, lower_tick)  # half of the first compiling, needed last
        self._config, self._commanded = config, commanded
        self._posture = PostureTask(
            config.posture.cost,
            costs=config.posture.costs,
            gain=config.posture.gain,
            level=config.posture.level,
        )
        self._tasks = [make_task(frame) for frame in config.frames]
        places = [task.packed.ctypes.data for task in self._tasks]
        sizes = [POSE if isinstance(t, FrameTask) else POSITION for t in self._tasks]
        self._places: Indices = np.array(places, dtype=np.int64)
        self._sizes: Indices = np.array(sizes, dtype=np.int64)
        self._held = [held_equality(held) for held in config.held]
        equalities: list[Equality] = list(self._held)
        if robot.root.kind == "planar" and robot.root.drive == "differential":
            base = robot.links[0].name
            sideways = FrameEquality(base, directions=("y",), hold_pose=False)
            equalities.append(sideways)
        limits = make_limits(robot, config)
        self._support = [x for x in limits if isinstance(x, SupportLimit)]
        self._stack = TaskStack(
            commanded,
            [*self._tasks, self._posture],
            limits=limits,
            equalities=equalities,
            escape=False,
        )
        able = accelerations(robot, config, commanded)
        self._guard = EffortGuard(robot, commanded, able)
        self._joints = PostureTask(
            1.0,
            costs=travel_costs(robot, FOLLOW),
            max_speed=HURRY,
            name="configuration",
        )
        self._joint_stack = TaskStack(
            commanded,
            [self._joints],
            limits=limits,
            equalities=equalities,
            escape=False,
        )

    def reset(self) -> None:
        """Forget the past; hold feet and centre of mass where they are."""
        for held in self._held:
            held.set_target(self._commanded.frame_pose(held.frame))
        for limit in self._support:
            limit.reset()
        self._stack.reset()
        self._joint_stack.reset()

    def set_targets(self, targets: Matrix) -> None:
        """Set the targets of all controlled frames."""
        _hand_on(self._places, self._sizes, targets)

    def set_posture(self, q: Vector) -> None:
        """Set the posture to prefer."""
        self._posture.target[:] = q

    def solve(self, dt: float) -> IkStep:
        """Solve one tick of the stack."""
        return self._step(self._stack, self._joint_stack, dt, record=self._record)

    def solve_posture(self, posture: Vector, dt: float) -> IkStep:
        """Solve one tick of the stack without frames."""
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


@compiled
def _hand_on(places: Indices, sizes: Indices, targets: Matrix) -> None:
    """Write targets where tasks keep them.

    Args:
        places: Address of each task's target.
        sizes: Length of it: `POSE`, or `POSITION`.
        targets: Poses, [R p] row by row, shape (n, 12).
    """
    for k in range(places.shape[0]):
        target = vector_at(places[k], sizes[k])
        for i in range(sizes[k]):
            target[i] = targets[k, i if sizes[k] == POSE else 4 * i + 3]


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
