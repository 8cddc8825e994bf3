"""IK_POSE: actions are poses of the hand, inverse kinematics finds the joints."""

from typing import Annotated, Any, Literal

import numpy as np
import pinocchio as pin
from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from wbc_suite.control.action import ActionPart
from wbc_suite.control.part.config import (
    InputFrame,
    InputScaling,
    InputType,
    Numbers,
    PartSettings,
    Span,
    damping_of,
    limits_of,
    set_torque_rules,
)
from wbc_suite.control.part.joint import JointLaw
from wbc_suite.control.part.osc_goal import GoalLimits, step_origin, stepped
from wbc_suite.control.part.part_ik import IkMotion, PartIk
from wbc_suite.control.state import RobotState
from wbc_suite.typing import Vector

__all__ = ["IkPoseConfig", "IkPoseController"]

REACH = 10.0
"""Bound of absolute positions, m: a typing error, not a place to reach for."""

NOTHING = 1e-12
"""m and rad; rounding of a step that is none."""


class IkPoseConfig(PartSettings):
    """Joints follow what inverse kinematics finds for poses of the hand.

    Attributes:
        input_type: `delta` steps, see `goal_update_mode`, or `absolute` poses.
        input_ref_frame: Axes of the input.
        output_min: Step at `input_min`, m.
        output_max: Step at `input_max`, m.
        turn_limit: Greatest turn of a step, rad.
        position_limits: Least and greatest coordinates of goals in the reference, m.
        orientation_limits: Least and greatest components of the rotation vector from
            the orientation at the start to a goal's, axes of the reference, rad.
        solve_hz: Solves per second.
        motion: How the hand goes to its goal.
        kp: Stiffness of the joints, 1/s^2.
        damping_ratio: 1 is critically damped.
        tolerance: Errors below which the goal counts as reached, m and rad.
    """

    type: Literal["IK_POSE"] = "IK_POSE"
    input_type: InputType = "delta"
    input_ref_frame: InputFrame = "base"
    output_min: Numbers = -0.05
    output_max: Numbers = 0.05
    turn_limit: PositiveFloat = 0.5
    position_limits: Span | None = None
    orientation_limits: Span | None = None
    solve_hz: Annotated[float, Field(ge=10.0, le=1000.0)] = 100.0
    motion: IkMotion = IkMotion()
    kp: PositiveFloat = 900.0
    damping_ratio: NonNegativeFloat = 1.0
    tolerance: tuple[PositiveFloat, PositiveFloat] = (1e-3, 3.5e-3)

    @model_validator(mode="after")
    def _consistent(self) -> "IkPoseConfig":
        if self.input_type == "absolute" and self.input_ref_frame == "eef":
            raise ValueError(
                "input_ref_frame 'eef' needs input_type 'delta': a hand is always at "
                "the origin of its own axes"
            )
        return self


class IkPoseController:
    """Moves a hand's goal by actions of a position and a quaternion, x y z w.

    The quaternion is the pose's, or in delta mode that of the turn; it is normalised,
    and one of length 0 asks for no turn.

    Args:
        name: The part, and its slice.
        config: Gains and meaning of the input.
        state: The robot in the simulation.
        joints: Joints of the arm.
        site: Frame of the hand.

    Attributes:
        goal: Pose to go to, in the reference's axes.
        law: Follows the joints' targets, which are smooth between two solves.
    """

    def __init__(
        self,
        name: str,
        config: IkPoseConfig,
        state: RobotState,
        joints: tuple[str, ...],
        site: str,
    ) -> None:
        self.config, self._state = config, state
        self.law = JointLaw(
            state, joints, kp=config.kp, kd=damping_of(config.kp, config.damping_ratio)
        )
        set_torque_rules(self.law, config)
        self.law.keep_limits(state)
        step = float(state.model.opt.timestep)
        self._steps = max(1, round(1.0 / (config.solve_hz * step)))
        self._ik = PartIk(
            state, joints, site, motion=config.motion, period=self._steps * step
        )
        self._base = state.model.body(state.prefix + state.robot.links[0].name).id
        if config.input_ref_frame == "world":
            self._base = 0
        self._scaling = InputScaling(3, config, config.output_min, config.output_max)
        self.slices = (_pose_part(name, config, self._scaling),)
        everywhere = (-np.inf, np.inf)
        self._limits = GoalLimits(
            position=np.array(
                limits_of(config.position_limits or everywhere, 3, "position_limits")
            ),
            turn=np.array(
                limits_of(
                    config.orientation_limits or everywhere, 3, "orientation_limits"
                )
            ),
        )
        self.goal = pin.SE3.Identity()
        self._home = np.eye(3)
        self._due = 0.0

    def reset(self, state: RobotState) -> None:
        """Hold the hand where it is, and the posture that it has."""
        self._ik.reset(state)
        self.goal = self._reference().actInv(self._ik.measured(state))
        self._home = self.goal.rotation.copy()
        self.law.aim(state.data.qpos[self.law.drives["qpos"]])
        self._due = state.time

    def set_goal(self, values: Vector, period: float) -> None:
        """Take a position and a quaternion, x y z w, shape (7,)."""
        length = float(np.linalg.norm(values[3:]))
        turn = pin.Quaternion(*values[[6, 3, 4, 5]]).normalized().matrix()
        if self.config.input_type == "delta":
            turn = np.eye(3) if length < NOTHING else turn
            self._step(self._scaling(values[:3]), pin.log3(turn))
        else:
            turn = self.goal.rotation if length < NOTHING else turn
            self._move_goal(pin.SE3(turn, values[:3].copy()))

    def prepare(self, state: RobotState) -> int:
        """Solve when it is time to; return how many physics steps are left."""
        step = float(state.model.opt.timestep)
        left = round((self._due - state.time) / step)
        if left > 0:
            return left
        self._due = state.time + self._steps * step
        self.law.aim(*self._ik.solve(state, self._reference() * self.goal))
        return self._steps

    @property
    def hold_action(self) -> Vector:
        """The action that keeps the goal."""
        if self.config.input_type == "delta":
            return np.concatenate([self._scaling.neutral, [0.0, 0.0, 0.0, 1.0]])
        return pin.SE3ToXYZQUAT(self.goal)

    def report(self, state: RobotState) -> dict[str, Any]:
        """Return whether the goal is reached, by how much it is missed, and why.

        The keys are those of a `TaskReport`.
        """
        goal, hand = self._reference() * self.goal, self._ik.measured(state)
        position = float(np.linalg.norm(goal.translation - hand.translation))
        angle = float(np.linalg.norm(pin.log3(hand.rotation.T @ goal.rotation)))
        near = (
            position <= self.config.tolerance[0] and angle <= self.config.tolerance[1]
        )
        return {
            "name": self.slices[0].name,
            "position_error": position,
            "orientation_error": angle,
            "reached": near,
            "reasons": () if near else self._ik.reasons(),
        }

    def _step(self, shift: Vector, turn: Vector) -> None:
        """Move the goal by a step in the input's axes."""
        angle = float(np.linalg.norm(turn))
        turn = turn * min(1.0, self.config.turn_limit / max(angle, NOTHING))
        step, axes, start = np.concatenate([shift, turn]), np.eye(3), self.goal
        if self.config.input_ref_frame == "eef":
            axes = self.goal.rotation
        if not np.abs(step).max() > NOTHING:
            return
        if self.config.goal_update_mode == "achieved":
            hand = self._reference().actInv(self._ik.measured(self._state))
            start = step_origin(self.goal, hand, step, axes)
        self._move_goal(stepped(start, step, axes))

    def _move_goal(self, goal: pin.SE3) -> None:
        self.goal = self._limits.nearest(goal, self._home)

    def _reference(self) -> pin.SE3:
        """Return the pose of the goals' axes in the world."""
        data = self._state.data
        R = data.xmat[self._base].reshape(3, 3)
        return pin.SE3(R.copy(), data.xpos[self._base].copy())


def _pose_part(name: str, config: IkPoseConfig, scaling: InputScaling) -> ActionPart:
    """Return the action slice: x y z, and a quaternion."""
    units, high = ("m",) * 3, np.full(3, REACH)
    low = -high
    if config.input_type == "delta":
        low, high, units = scaling.low, scaling.high, scaling.units(units)
    return ActionPart(
        name=name,
        kind="pose",
        labels=("x", "y", "z", "qx", "qy", "qz", "qw"),
        units=(*units, *("quaternion",) * 4),
        low=(*low.tolist(), *(-1.0,) * 4),
        high=(*high.tolist(), *(1.0,) * 4),
    )
