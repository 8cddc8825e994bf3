"""Inverse kinematics by this package's own QP task stack."""

from functools import partial
from typing import Any

import mujoco
import numpy as np

from wbc_suite.control.ik.backend import IkBackend, IkStep, StackArrays
from wbc_suite.control.ik.command_lead import limit_steps
from wbc_suite.control.ik.config import WholeBodyIKConfig
from wbc_suite.control.ik.frame_kinds import NO_SPEED_LIMIT, set_target
from wbc_suite.control.ik.qp_of_config import (
    TRACKING_COST,
    accelerations,
    held_equality,
    make_limits,
    travel_costs,
)
from wbc_suite.control.ik.torque_limiter import TorqueLimiter
from wbc_suite.control.law.joint_laws import JointLaw
from wbc_suite.control.law.spline_reference import SplineReference
from wbc_suite.control.memory import Parts
from wbc_suite.control.reasons import Reason
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    Conflict,
    Equality,
    FrameEquality,
    ObstacleLimit,
    PostureTask,
    SelfCollisionLimit,
    Solution,
    SupportLimit,
    TaskStack,
    TickRecord,
)
from wbc_suite.qp.registry import LIMITS, TASKS, made_of
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Matrix, Vector


class StackBackend(IkBackend):
    """`IkBackend` over a `TaskStack`.

    Attributes:
        stack: The stack of frames and posture.
        torque_limiter: Limits what it solves for.
    """

    def __init__(
        self,
        robot: RobotDescription,
        config: WholeBodyIKConfig,
        commanded: Configuration,
        obstacles: ObstacleLimit,
    ) -> None:
        self._config, self._commanded = config, commanded
        self._posture = PostureTask(
            config.posture.cost,
            costs=config.posture.costs,
            gain=config.posture.gain,
            level=config.posture.level,
        )
        self._tasks = [frame.behaviour.task(frame) for frame in config.frames]
        self._held = [held_equality(held) for held in config.held]
        equalities: list[Equality] = list(self._held)
        if robot.root.kind == "planar" and robot.root.drive == "differential":
            base = robot.links[0].name
            sideways = FrameEquality(base, directions=("y",), hold_pose=False)
            equalities.append(sideways)
        limits = make_limits(robot, config)
        limits += [made_of(LIMITS, table) for table in config.more_limits]
        if obstacles.pairs:
            limits.append(obstacles)
        self.self_collision = next(
            (x for x in limits if isinstance(x, SelfCollisionLimit)), None
        )
        self._support = [x for x in limits if isinstance(x, SupportLimit)]
        make_stack = partial(
            TaskStack,
            commanded,
            limits=limits,
            joint_limits=False,
            equalities=equalities,
            escape=False,
        )
        others = [made_of(TASKS, table) for table in config.tasks]
        self.stack = make_stack([*self._tasks, self._posture, *others])
        self.v: Vector = np.zeros(commanded.nv)
        self._last: tuple[TaskStack, Solution] | None = None
        max_acceleration = accelerations(robot, config, commanded)
        self.torque_limiter = TorqueLimiter(robot, commanded, max_acceleration)
        self._joints = PostureTask(
            1.0,
            costs=travel_costs(robot, TRACKING_COST),
            max_speed=NO_SPEED_LIMIT,
            name="configuration",
        )
        self._joint_stack = make_stack([self._joints])

    def reset(self) -> None:
        """Discard the state of earlier ticks; hold feet and centre of mass."""
        for held in self._held:
            held.set_target(self._commanded.frame_pose(held.frame))
        for limit in self._support:
            limit.reset()
        self.stack.reset()
        self._joint_stack.reset()
        self.v[:], self._last = 0.0, None

    @property
    def memory(self) -> Parts:
        """What outlives a tick; views."""
        held = [held.target_row.values for held in self._held]
        return self.v, *self.stack.memory, *held

    def resume(self) -> None:
        """Take what held frames hold, which was written into `memory`."""
        for held in self._held:
            held.target_row.set(held.target_row.values)

    def set_targets(self, targets: Matrix) -> None:
        """Set the targets of all controlled frames."""
        for task, row in zip(self._tasks, targets, strict=True):
            set_target(task, row)

    def set_posture(self, q: Vector) -> None:
        """Set the posture to prefer."""
        self._posture.set_target(q)

    def solve(self, dt: float, left: tuple[int, int] | None = None) -> None:
        """Solve one tick of the stack."""
        if left is None:
            self.stack.v_previous[:] = self.v
            self._take(self.stack, self.stack.solve(dt), dt)
        else:
            self._take(self.stack, self.stack.complete(dt, *left), dt)

    def solve_posture(self, posture: Vector, dt: float) -> None:
        """Solve one tick of the stack without frames."""
        self._joints.set_target(posture)
        self._joint_stack.v_previous[:] = self.v
        self._joint_stack.bounds.step_max[:] = self.stack.bounds.step_max
        self._take(self._joint_stack, self._joint_stack.solve(dt), dt)

    def limit_steps(
        self, reference: SplineReference, law: JointLaw, data: mujoco.MjData
    ) -> None:
        """Limit the next step as `command_lead.limit_steps` does."""
        bounds, spline = np.asarray(self.stack.bounds), reference.argument
        drives: Any = law.drives
        limit_steps(bounds, spline, self.v, drives, data.qpos, data.qvel)

    def loop_arrays(self) -> StackArrays:
        """Return what ticks in the control loop need."""
        tasks = [*self._tasks, self._posture]
        places = [self.stack.target_of(task) for task in tasks]
        return StackArrays(
            self.stack.arrays,
            np.array(places, dtype=np.int64),
            self.torque_limiter.argument,
        )

    def _take(self, stack: TaskStack, solution: Solution, dt: float) -> None:
        self.v[:] = self.torque_limiter.apply(self.v, solution.v, dt)
        self._last = stack, solution

    def last_step(self, *, in_loop: bool) -> IkStep:
        """Return the answer of the last tick."""
        if in_loop:
            stack, solution = self.stack, self.stack.solution()
        elif self._last is not None:
            stack, solution = self._last
        else:
            return IkStep(v=self.v.copy())
        return IkStep(
            v=self.v.copy(),
            limits=partial(_limits, solution),
            ok=solution.ok,
            explain=partial(_reasons, solution.record) if stack is self.stack else None,
        )


def _reasons(tick: TickRecord) -> dict[str, tuple[Reason, ...]]:
    reports = tick.explain(position_tolerance=0.0, orientation_tolerance=0.0)
    return {name: report.reasons for name, report in reports.items()}


def _limits(solution: Solution) -> tuple[Reason, ...]:
    return (*solution.active, *(Conflict(name) for name in solution.conflicts))
