"""IK_POSE: actions are poses of the hand; inverse kinematics gives joint references."""

from typing import Annotated, Any, Literal

import numpy as np
import pinocchio as pin
from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from wbc_suite.control.action import ActionPart, Axis, SliceKind, Unit
from wbc_suite.control.law.joint_laws import JointLaw
from wbc_suite.control.part.controller import PartController
from wbc_suite.control.part.hand_goal import HandGoal
from wbc_suite.control.part.part_ik import IkMotion, PartIk
from wbc_suite.control.part.part_settings import (
    REACH,
    ROUNDING,
    InputFrame,
    InputScaling,
    InputType,
    Numbers,
    PartSettings,
    Range,
    apply_torque_settings,
    damping_of,
)
from wbc_suite.control.robot_parts import RobotPart
from wbc_suite.control.state import RobotState
from wbc_suite.typing import Vector

AXES = (Axis.X, Axis.Y, Axis.Z, Axis.QX, Axis.QY, Axis.QZ, Axis.QW)


class IkPoseConfig(PartSettings):
    """Joints follow the inverse kinematics of poses of the hand.

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
    position_limits: Range | None = None
    orientation_limits: Range | None = None
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


class IkPoseController(PartController[JointLaw]):
    """Moves a hand's goal by actions of a position and a quaternion, x y z w.

    The quaternion is the pose's, or in delta mode that of the turn; it is normalised,
    and one of length 0 is no turn.

    Args:
        part: The arm.
        config: Gains and meaning of the input.
        state: The robot in the simulation.

    Attributes:
        law: Tracks the joints' references, which are smooth between two solves.
    """

    needs_hand = True

    def __init__(
        self, part: RobotPart, config: IkPoseConfig, state: RobotState
    ) -> None:
        assert part.hand is not None
        self.config, self._state = config, state
        kd = damping_of(config.kp, config.damping_ratio)
        self.law = JointLaw(state, part.joints, kp=config.kp, kd=kd)
        apply_torque_settings(self.law, config)
        self.law.keep_limits(state)
        step = float(state.model.opt.timestep)
        self._steps = max(1, round(1.0 / (config.solve_hz * step)))
        period = self._steps * step
        self._ik = PartIk(
            state, part.joints, part.hand, motion=config.motion, period=period
        )
        self._base = state.model.body(state.prefix + state.robot.links[0].name).id
        if config.input_ref_frame == "world":
            self._base = 0
        self._scaling = InputScaling(3, config, config.output_min, config.output_max)
        self.slices = (_pose_part(part.name, config, self._scaling),)
        self._goal = HandGoal(config)
        self._due = 0.0

    @property
    def goal(self) -> pin.SE3:
        """Pose to go to, in the reference's axes."""
        return self._goal.pose

    def reset(self, state: RobotState) -> None:
        """Hold the hand where it is, and the posture that it has."""
        self._ik.reset(state)
        hand = self._hand()
        self._goal.reset(hand.rotation, hand.translation)
        self.law.aim(state.data.qpos[self.law.drives["qpos"]])
        self._due = state.time

    def set_goal(self, values: Vector, period: float) -> None:
        """Take a position and a quaternion, x y z w, shape (7,)."""
        turn = None
        if float(np.linalg.norm(values[3:])) >= ROUNDING:
            turn = pin.Quaternion(*values[[6, 3, 4, 5]]).normalized().matrix()
        if self.config.input_type == "absolute":
            rotation = self.goal.rotation if turn is None else turn
            self._goal.set(rotation, values[:3])
            return
        rotation = np.zeros(3) if turn is None else pin.log3(turn)
        angle = float(np.linalg.norm(rotation))
        rotation = rotation * min(1.0, self.config.turn_limit / max(angle, ROUNDING))
        step, hand = np.concatenate([self._scaling(values[:3]), rotation]), self._hand()
        self._goal.step(step, hand.rotation, hand.translation)

    def prepare(self, state: RobotState) -> int:
        """Solve when it is time to; return how many physics steps are left."""
        step = float(state.model.opt.timestep)
        left = round((self._due - state.time) / step)
        if left > 0:
            return left
        self._due = state.time + self._steps * step
        self.law.follow(self._ik.solve(state, self._reference() * self.goal))
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

    def _hand(self) -> pin.SE3:
        """Return the measured pose of the hand in the goals' axes."""
        return self._reference().actInv(self._ik.measured(self._state))

    def _reference(self) -> pin.SE3:
        """Return the pose of the goals' axes in the world."""
        data = self._state.data
        R = data.xmat[self._base].reshape(3, 3)
        return pin.SE3(R.copy(), data.xpos[self._base].copy())


def _pose_part(name: str, config: IkPoseConfig, scaling: InputScaling) -> ActionPart:
    """Return the action slice: x y z, and a quaternion."""
    units, high = (Unit("m"),) * 3, np.full(3, REACH)
    low = -high
    if config.input_type == "delta":
        low, high, units = scaling.low, scaling.high, scaling.units(units)
    return ActionPart(
        name=name,
        kind=SliceKind.POSE,
        labels=AXES,
        units=(*units, *(Unit("quaternion"),) * 4),
        low=(*low.tolist(), *(-1.0,) * 4),
        high=(*high.tolist(), *(1.0,) * 4),
    )
