"""JOINT_TORQUE: actions are joint torques."""

from typing import Literal

import numpy as np

from wbc_suite.control.action import SliceKind
from wbc_suite.control.law.law import TorqueLaw
from wbc_suite.control.part.controller import PartController
from wbc_suite.control.part.joint_input import JointInput
from wbc_suite.control.part.part_settings import (
    InputType,
    Numbers,
    PartSettings,
    apply_torque_settings,
)
from wbc_suite.control.robot_parts import RobotPart
from wbc_suite.control.state import RobotState
from wbc_suite.typing import Vector

SHARE = 0.1
"""Part of the greatest torque at full input: 8.7 N m at Panda's shoulder, 1.2 N m at
its wrist. robosuite's 0.1 N m for all joints moves nothing visibly."""


class JointTorqueConfig(PartSettings):
    """Torques on top of those that compensate gravity; see `TorqueLaw`.

    Attributes:
        input_type: `delta`: values are scaled to torques. `absolute`: they are torques.
        output_min: Torque at `input_min`, N m or N; a tenth of the least when absent.
        output_max: Torque at `input_max`; a tenth of the greatest when absent.
    """

    type: Literal["JOINT_TORQUE"] = "JOINT_TORQUE"
    input_type: InputType = "delta"
    output_min: Numbers | None = None
    output_max: Numbers | None = None


class JointTorqueController(PartController[TorqueLaw]):
    """Sets joint torques by actions.

    Args:
        part: Its joints.
        config: Limits and meaning of the input.
        state: The robot in the simulation.

    Attributes:
        goal: Commanded torques, shape (n,), N m or N.

    Raises:
        ConfigError: If a number of values is wrong, or a range is empty.
    """

    def __init__(
        self, part: RobotPart, config: JointTorqueConfig, state: RobotState
    ) -> None:
        self.config = config
        self.law = TorqueLaw(state, part.joints)
        apply_torque_settings(self.law, config)
        drives = self.law.drives
        limits = drives["command_min"].copy(), drives["command_max"].copy()
        given = config.output_min, config.output_max
        least, greatest = (
            tuple((SHARE * limit).tolist()) if output is None else output
            for output, limit in zip(given, limits, strict=True)
        )
        self._input = JointInput(
            part,
            SliceKind.TORQUE,
            state,
            config=config,
            outputs=(least, greatest),
            scaled=config.input_type == "delta",
            limits=limits,
        )
        self.slices = (self._input.action,)
        self.goal: Vector = np.zeros(len(part.joints))

    def reset(self, state: RobotState) -> None:
        """Command zero torque."""
        self.goal = np.zeros(len(self.law.joints))
        self.law.aim(self.goal)

    def set_goal(self, values: Vector, period: float) -> None:
        """Take torques, shape (n,)."""
        self.goal = self._input(values)
        self.law.move(self.goal, self.config.ramp(period))

    @property
    def hold_action(self) -> Vector:
        """The action of zero torque."""
        return self._input.neutral
