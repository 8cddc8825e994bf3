"""JOINT_POSITION: actions move joint goals, which the joint law tracks."""

from typing import Literal

import numpy as np

from wbc_suite.control.action import SliceKind
from wbc_suite.control.law.joint_laws import JointLaw
from wbc_suite.control.part.controller import PartController
from wbc_suite.control.part.impedance import Gains, Impedance, ImpedanceSettings
from wbc_suite.control.part.joint_input import (
    JointInput,
    narrow_limits,
    position_limits,
    velocity_limits,
)
from wbc_suite.control.part.part_settings import (
    ROUNDING,
    InputType,
    Numbers,
    PartSettings,
    Range,
    apply_torque_settings,
)
from wbc_suite.control.robot_parts import RobotPart
from wbc_suite.control.state import RobotState
from wbc_suite.typing import Vector


class JointPositionConfig(ImpedanceSettings, PartSettings):
    """Joints follow positions; see `JointLaw`.

    Attributes:
        kp: Stiffness, 1/s^2, for all joints or each.
        input_type: `delta` steps, see `goal_update_mode`, or `absolute` positions.
        output_min: Step at `input_min`, rad or m.
        output_max: Step at `input_max`, rad or m.
        qpos_limits: Least and greatest positions of goals, within the joints' ranges.
        velocity_limits: Least and greatest velocities, rad/s or m/s, symmetric, within
            the joints' own.
    """

    type: Literal["JOINT_POSITION"] = "JOINT_POSITION"
    kp: Gains = 50.0
    input_type: InputType = "delta"
    output_min: Numbers = -0.05
    output_max: Numbers = 0.05
    qpos_limits: Range | None = None
    velocity_limits: Range | None = None


class JointPositionController(PartController[JointLaw]):
    """Moves joint goals by actions.

    Args:
        part: Its joints; gains have slices of their own.
        config: Gains and meaning of the input.
        state: The robot in the simulation.

    Attributes:
        goal: Positions to hold, shape (n,), rad or m.

    Raises:
        ConfigError: If a number of values is wrong, or a range is empty.
    """

    def __init__(
        self, part: RobotPart, config: JointPositionConfig, state: RobotState
    ) -> None:
        self.config, self._state = config, state
        self._impedance = Impedance(part.name, part.joints, config)
        gains = self._impedance
        self.law = JointLaw(state, part.joints, kp=gains.kp, kd=gains.kd)
        low, high = position_limits(state, part.joints, config.qpos_limits)
        least, greatest = velocity_limits(state, part.joints, config.velocity_limits)
        self.law.keep_limits(state)
        narrow_limits(self.law, low, high, np.minimum(-least, greatest))
        apply_torque_settings(self.law, config)
        self._input = JointInput(
            part,
            SliceKind.POSTURE,
            state,
            config=config,
            outputs=(config.output_min, config.output_max),
            scaled=config.input_type == "delta",
            limits=(low, high),
        )
        self.slices = (self._input.action, *self._impedance.slices)
        self.goal: Vector = np.zeros(len(part.joints))

    def reset(self, state: RobotState) -> None:
        """Hold the joints where they are."""
        self.goal = state.data.qpos[self.law.drives["qpos"]]
        self.law.aim(self.goal)

    def set_goal(self, values: Vector, period: float) -> None:
        """Take steps or positions, shape (n,), then gains."""
        size = len(self.goal)
        if self._impedance.slices:
            self._impedance.take(values[size:])
            self.law.set_gains(self._impedance.kp, self._impedance.kd)
        if self._input.scaled:
            self._step(self._input.scaling(values[:size]))
        else:
            self.goal = self._input(values[:size])
        self.law.move(self.goal, self.config.ramp(period))

    @property
    def hold_action(self) -> Vector:
        """The action that keeps the goal and the gains."""
        motion = self._input.neutral if self._input.scaled else self.goal
        return np.concatenate([motion, self._impedance.hold_action])

    def _step(self, step: Vector) -> None:
        """Move the goals of those joints whose step is not zero, shape (n,)."""
        start = self.goal
        if self.config.goal_update_mode == "achieved":
            start = self._state.data.qpos[self.law.drives["qpos"]]
        moves = np.abs(step) >= ROUNDING
        self.goal = np.where(moves, self._input.clip(start + step), self.goal)
