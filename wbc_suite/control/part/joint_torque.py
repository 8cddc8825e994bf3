"""JOINT_TORQUE: actions are joint torques."""

from typing import Literal

import numpy as np

from wbc_suite.control.part.config import (
    InputType,
    Numbers,
    PartSettings,
    set_torque_rules,
)
from wbc_suite.control.part.controller import WHENEVER
from wbc_suite.control.part.joint_input import JointInput
from wbc_suite.control.part.law import TorqueLaw
from wbc_suite.control.state import RobotState
from wbc_suite.typing import Vector

__all__ = ["JointTorqueConfig", "JointTorqueController"]

SHARE = 0.1
"""Of the greatest torque, at full input: 8.7 N m at Panda's shoulder, 1.2 N m at its
wrist. The peer's 0.1 N m for all joints moves nothing that one could see."""


class JointTorqueConfig(PartSettings):
    """Joints are given torques on top of what carries them; see `TorqueLaw`.

    Attributes:
        input_type: `delta`: values are scaled to torques. `absolute`: they are torques.
        output_min: Torque at `input_min`, N m or N; a tenth of the least when absent.
        output_max: Torque at `input_max`; a tenth of the greatest when absent.
    """

    type: Literal["JOINT_TORQUE"] = "JOINT_TORQUE"
    input_type: InputType = "delta"
    output_min: Numbers | None = None
    output_max: Numbers | None = None


class JointTorqueController:
    """Sets joint torques by actions.

    Args:
        name: The part, and its slice.
        config: Limits and meaning of the input.
        state: The robot in the simulation.
        joints: Joints of the part.

    Attributes:
        goal: Torques asked for, shape (n,), N m or N.

    Raises:
        ConfigError: If a number of values is wrong, or a range is empty.
    """

    def __init__(
        self,
        name: str,
        config: JointTorqueConfig,
        state: RobotState,
        joints: tuple[str, ...],
    ) -> None:
        self.config = config
        self.law = TorqueLaw(state, joints)
        set_torque_rules(self.law, config)
        limits = self.law.drives["low"].copy(), self.law.drives["high"].copy()
        given = config.output_min, config.output_max
        least, greatest = (
            tuple((SHARE * limit).tolist()) if output is None else output
            for output, limit in zip(given, limits, strict=True)
        )
        self._input = JointInput(
            name,
            "torque",
            state,
            joints,
            config=config,
            outputs=(least, greatest),
            scaled=config.input_type == "delta",
            limits=limits,
        )
        self.slices = (self._input.part,)
        self.goal: Vector = np.zeros(len(joints))

    def reset(self, state: RobotState) -> None:
        """Ask for no torque."""
        self.goal = np.zeros(len(self.law.joints))
        self.law.aim(self.goal)

    def set_goal(self, values: Vector, period: float) -> None:
        """Take torques, shape (n,)."""
        self.goal = self._input(values)
        self.law.move(self.goal, self.config.ramp(period))

    def prepare(self, state: RobotState) -> int:
        """Do nothing: the law acts."""
        return WHENEVER

    @property
    def hold_action(self) -> Vector:
        """The action that asks for no torque."""
        return self._input.neutral
