"""JOINT_VELOCITY: actions are joint speeds."""

from typing import Literal

import numpy as np
from pydantic import PositiveFloat

from wbc_suite.control.part.config import (
    InputType,
    Numbers,
    PartSettings,
    Span,
    set_torque_rules,
)
from wbc_suite.control.part.controller import WHENEVER
from wbc_suite.control.part.joint import VelocityLaw
from wbc_suite.control.part.joint_input import JointInput
from wbc_suite.control.part.joint_limits import (
    keep_within,
    position_limits,
    speed_limits,
)
from wbc_suite.control.state import RobotState
from wbc_suite.typing import Vector

__all__ = ["JointVelocityConfig", "JointVelocityController"]


class JointVelocityConfig(PartSettings):
    """Joints follow speeds; see `VelocityLaw`.

    Attributes:
        kp: Gain on the error of the speed, 1/s: speeds settle in 3 / kp.
        ki: Gain on its integral, 1/s^2; `kp^2 / 4` when absent, critically damped.
        windup_limit: Greatest integral of the error, rad or m.
        input_type: `delta`: values are scaled to speeds. `absolute`: they are speeds.
        output_min: Speed at `input_min`, rad/s or m/s.
        output_max: Speed at `input_max`, rad/s or m/s.
        velocity_limits: Least and greatest speeds, within the joints' own.
        qpos_limits: Positions at which joints are stopped, within their ranges.
    """

    type: Literal["JOINT_VELOCITY"] = "JOINT_VELOCITY"
    kp: PositiveFloat = 40.0
    ki: PositiveFloat | None = None
    windup_limit: PositiveFloat = 0.1
    input_type: InputType = "delta"
    output_min: Numbers = -0.5
    output_max: Numbers = 0.5
    velocity_limits: Span | None = None
    qpos_limits: Span | None = None


class JointVelocityController:
    """Sets joint speeds by actions; without any the joints stand still.

    Args:
        name: The part, and its slice.
        config: Gains and meaning of the input.
        state: The robot in the simulation.
        joints: Joints of the part.

    Attributes:
        goal: Speeds asked for, shape (n,), rad/s or m/s.

    Raises:
        ConfigError: If a number of values is wrong, or a range is empty.
    """

    def __init__(
        self,
        name: str,
        config: JointVelocityConfig,
        state: RobotState,
        joints: tuple[str, ...],
    ) -> None:
        self.config = config
        low, high = speed_limits(state, joints, config.velocity_limits)
        self.law = VelocityLaw(
            state,
            joints,
            kp=0.25 * config.kp**2 if config.ki is None else config.ki,
            kd=config.kp,
            leash=config.windup_limit,
        )
        set_torque_rules(self.law, config)
        least, greatest = position_limits(state, joints, config.qpos_limits)
        self.law.keep_limits(state)
        fastest = np.maximum(-low, high)
        keep_within(self.law, least, greatest, fastest)
        self._input = JointInput(
            name,
            "velocity",
            state,
            joints,
            config=config,
            outputs=(config.output_min, config.output_max),
            scaled=config.input_type == "delta",
            limits=(low, high),
        )
        self.slices = (self._input.part,)
        self.goal: Vector = np.zeros(len(joints))

    def reset(self, state: RobotState) -> None:
        """Stand still."""
        self.goal = np.zeros(len(self.law.joints))
        self.law.halt(state)

    def set_goal(self, values: Vector, period: float) -> None:
        """Take speeds, shape (n,)."""
        self.goal = self._input(values)
        self.law.set_speed(self.goal, duration=self.config.ramp(period))

    def prepare(self, state: RobotState) -> int:
        """Do nothing: the law follows."""
        return WHENEVER

    @property
    def hold_action(self) -> Vector:
        """The action that lets the joints stand still."""
        return self._input.neutral
