"""JOINT_POSITION: actions move joint goals, the joint law follows them."""

from typing import Literal

import numpy as np

from wbc_suite.control.part.config import (
    InputType,
    Numbers,
    Span,
    set_torque_rules,
)
from wbc_suite.control.part.controller import WHENEVER
from wbc_suite.control.part.impedance import Gains, Impedance, ImpedanceSettings
from wbc_suite.control.part.joint import JointLaw
from wbc_suite.control.part.joint_input import JointInput
from wbc_suite.control.part.joint_limits import (
    keep_within,
    position_limits,
    speed_limits,
)
from wbc_suite.control.part.joint_step import StepField, step_joints
from wbc_suite.control.state import RobotState
from wbc_suite.kinematics.array_table import ArrayTable
from wbc_suite.typing import Vector

__all__ = ["JointPositionConfig", "JointPositionController"]


class JointPositionConfig(ImpedanceSettings):
    """Joints follow positions; see `JointLaw`.

    Attributes:
        kp: Stiffness, 1/s^2, for all joints or each.
        input_type: `delta` steps, see `goal_update_mode`, or `absolute` positions.
        output_min: Step at `input_min`, rad or m.
        output_max: Step at `input_max`, rad or m.
        qpos_limits: Least and greatest positions of goals, within the joints' ranges.
        velocity_limits: Least and greatest speeds, rad/s or m/s, symmetric, within the
            joints' own.
    """

    type: Literal["JOINT_POSITION"] = "JOINT_POSITION"
    kp: Gains = 50.0
    input_type: InputType = "delta"
    output_min: Numbers = -0.05
    output_max: Numbers = 0.05
    qpos_limits: Span | None = None
    velocity_limits: Span | None = None


class JointPositionController:
    """Moves joint goals by actions.

    Args:
        name: The part, and its slice; gains have slices of their own.
        config: Gains and meaning of the input.
        state: The robot in the simulation.
        joints: Joints of the part.

    Attributes:
        goal: Positions to hold, shape (n,), rad or m.

    Raises:
        ConfigError: If a number of values is wrong, or a range is empty.
    """

    def __init__(
        self,
        name: str,
        config: JointPositionConfig,
        state: RobotState,
        joints: tuple[str, ...],
    ) -> None:
        self.config, self._state = config, state
        self._impedance = Impedance(name, joints, config)
        self.law = JointLaw(state, joints, kp=self._impedance.kp, kd=self._impedance.kd)
        low, high = position_limits(state, joints, config.qpos_limits)
        least, greatest = speed_limits(state, joints, config.velocity_limits)
        self.law.keep_limits(state)
        keep_within(self.law, low, high, np.minimum(-least, greatest))
        set_torque_rules(self.law, config)
        self._input = JointInput(
            name,
            "posture",
            state,
            joints,
            config=config,
            outputs=(config.output_min, config.output_max),
            scaled=config.input_type == "delta",
            limits=(low, high),
        )
        self.slices = (self._input.part, *self._impedance.slices)
        self.goal: Vector = np.zeros(len(joints))
        self._achieved = config.goal_update_mode == "achieved"
        self._table = ArrayTable(
            StepField,
            {
                StepField.GOAL: self.goal,
                StepField.GAIN: self._input.scaling.gain,
                StepField.OFFSET: self._input.scaling.offset,
                StepField.LOW: low.copy(),
                StepField.HIGH: high.copy(),
                StepField.QPOS: state.data.qpos,
            },
        )

    def reset(self, state: RobotState) -> None:
        """Hold the joints where they are."""
        self.goal[:] = state.data.qpos[self.law.drives["qpos"]]
        self.law.aim(self.goal)

    def set_goal(self, values: Vector, period: float) -> None:
        """Take steps or positions, shape (n,), then gains."""
        size = len(self.goal)
        if self._impedance.slices:
            self._impedance.take(values[size:])
            self.law.set_gains(self._impedance.kp, self._impedance.kd)
        if not self._input.scaled:
            self.goal[:] = self._input(values[:size])
        else:
            step_joints(
                values[:size], self._table.table, self.law.drives, self._achieved
            )
        self.law.move(self.goal, self.config.ramp(period))

    def prepare(self, state: RobotState) -> int:
        """Do nothing: the law follows."""
        return WHENEVER

    @property
    def hold_action(self) -> Vector:
        """The action that keeps the goal and the gains."""
        motion = self._input.neutral if self._input.scaled else self.goal
        return np.concatenate([motion, self._impedance.hold_action])
