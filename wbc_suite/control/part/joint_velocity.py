"""JOINT_VELOCITY: actions are joint velocities."""

from typing import Literal

import numpy as np
from pydantic import PositiveFloat

from wbc_suite.control.action import SliceKind
from wbc_suite.control.law.joint_laws import VelocityLaw
from wbc_suite.control.part.controller import PartController
from wbc_suite.control.part.joint_input import (
    JointInput,
    narrow_limits,
    position_limits,
    velocity_limits,
)
from wbc_suite.control.part.part_settings import (
    InputType,
    Numbers,
    PartSettings,
    Range,
    apply_torque_settings,
)
from wbc_suite.control.robot_parts import RobotPart
from wbc_suite.control.state import RobotState
from wbc_suite.typing import Vector


class JointVelocityConfig(PartSettings):
    """Joints follow velocities; see `VelocityLaw`.

    Attributes:
        kp: Gain of the velocity error, 1/s: velocities settle in 3 / kp.
        ki: Gain of its integral, 1/s^2; `kp^2 / 4` when absent, critically damped.
        windup_limit: Greatest integral of the error, rad or m.
        input_type: `delta`: values are scaled to velocities. `absolute`: they are
            velocities.
        output_min: Velocity at `input_min`, rad/s or m/s.
        output_max: Velocity at `input_max`, rad/s or m/s.
        velocity_limits: Least and greatest velocities, within the joints' own.
        qpos_limits: Positions at which joints are stopped, within their ranges.
    """

    type: Literal["JOINT_VELOCITY"] = "JOINT_VELOCITY"
    kp: PositiveFloat = 40.0
    ki: PositiveFloat | None = None
    windup_limit: PositiveFloat = 0.1
    input_type: InputType = "delta"
    output_min: Numbers = -0.5
    output_max: Numbers = 0.5
    velocity_limits: Range | None = None
    qpos_limits: Range | None = None


class JointVelocityController(PartController[VelocityLaw]):
    """Sets joint velocities by actions; joints of zero velocity hold their positions.

    Args:
        part: Its joints.
        config: Gains and meaning of the input.
        state: The robot in the simulation.

    Attributes:
        goal: Commanded velocities, shape (n,), rad/s or m/s.

    Raises:
        ConfigError: If a number of values is wrong, or a range is empty.
    """

    def __init__(
        self, part: RobotPart, config: JointVelocityConfig, state: RobotState
    ) -> None:
        self.config = config
        low, high = velocity_limits(state, part.joints, config.velocity_limits)
        self.law = VelocityLaw(
            state,
            part.joints,
            kp=0.25 * config.kp**2 if config.ki is None else config.ki,
            kd=config.kp,
            windup=config.windup_limit,
        )
        apply_torque_settings(self.law, config)
        least, greatest = position_limits(state, part.joints, config.qpos_limits)
        self.law.keep_limits(state)
        narrow_limits(self.law, least, greatest, np.maximum(-low, high))
        self._input = JointInput(
            part,
            SliceKind.VELOCITY,
            state,
            config=config,
            outputs=(config.output_min, config.output_max),
            scaled=config.input_type == "delta",
            limits=(low, high),
        )
        self.slices = (self._input.action,)
        self.goal: Vector = np.zeros(len(part.joints))

    def reset(self, state: RobotState) -> None:
        """Stand still."""
        self.goal = np.zeros(len(self.law.joints))
        self.law.halt(state)

    def set_goal(self, values: Vector, period: float) -> None:
        """Take velocities, shape (n,)."""
        self.goal = self._input(values)
        self.law.set_speed(self.goal, duration=self.config.ramp(period))

    @property
    def hold_action(self) -> Vector:
        """The action of zero velocity."""
        return self._input.neutral
