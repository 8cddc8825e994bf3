"""JOINT_POSITION, JOINT_VELOCITY and JOINT_TORQUE: actions are values of joints.

The controllers raise ConfigError if a number of values is wrong, or a range is empty.
"""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from pydantic import PositiveFloat

from wbc_suite.control.action import SliceKind, Unit
from wbc_suite.control.law.joint_laws import JointLaw, VelocityLaw
from wbc_suite.control.law.law import Law, TorqueLaw
from wbc_suite.control.memory import Parts
from wbc_suite.control.part.controller import PartController
from wbc_suite.control.part.impedance import Gains, Impedance, ImpedanceSettings
from wbc_suite.control.part.part_settings import (
    ROUNDING,
    Numbers,
    PartSettings,
    Range,
    SliceInput,
    apply_torque_settings,
    narrowed,
)
from wbc_suite.control.robot_parts import RobotPart
from wbc_suite.control.state import RobotState
from wbc_suite.typing import Vector

TORQUE_SHARE = 0.1
"""Part of the greatest torque at full input: 8.7 N m at Panda's shoulder, 1.2 N m at
its wrist. robosuite's 0.1 N m for all joints moves nothing visibly."""

_UNITS: dict[SliceKind, tuple[Unit, Unit]] = {
    SliceKind.POSTURE: (Unit("rad"), Unit("m")),
    SliceKind.VELOCITY: (Unit("rad/s"), Unit("m/s")),
    SliceKind.TORQUE: (Unit("N m"), Unit("N")),
}
"""Units of revolute and of prismatic joints."""


class JointPositionConfig(ImpedanceSettings, PartSettings):
    """Joints follow positions; see `JointLaw`.

    Attributes:
        kp: Stiffness, 1/s^2, for all joints or each.
        output_min: Step at `input_min`, rad or m.
        output_max: Step at `input_max`, rad or m.
        qpos_limits: Least and greatest positions of goals, within the joints' ranges.
        velocity_limits: Least and greatest velocities, rad/s or m/s, symmetric, within
            the joints' own.
    """

    type: Literal["JOINT_POSITION"] = "JOINT_POSITION"
    kp: Gains = 50.0
    output_min: Numbers = -0.05
    output_max: Numbers = 0.05
    qpos_limits: Range | None = None
    velocity_limits: Range | None = None


class JointVelocityConfig(PartSettings):
    """Joints follow velocities; see `VelocityLaw`.

    Attributes:
        kp: Gain of the velocity error, 1/s: velocities settle in 3 / kp.
        ki: Gain of its integral, 1/s^2; `kp^2 / 4` when absent, critically damped.
        windup_limit: Greatest integral of the error, rad or m.
        output_min: Velocity at `input_min`, rad/s or m/s.
        output_max: Velocity at `input_max`, rad/s or m/s.
        velocity_limits: Least and greatest velocities, within the joints' own.
        qpos_limits: Positions at which joints are stopped, within their ranges.
    """

    type: Literal["JOINT_VELOCITY"] = "JOINT_VELOCITY"
    kp: PositiveFloat = 40.0
    ki: PositiveFloat | None = None
    windup_limit: PositiveFloat = 0.1
    output_min: Numbers = -0.5
    output_max: Numbers = 0.5
    velocity_limits: Range | None = None
    qpos_limits: Range | None = None


class JointTorqueConfig(PartSettings):
    """Torques on top of those that compensate gravity; see `TorqueLaw`.

    Attributes:
        output_min: Torque at `input_min`, N m or N; a tenth of the least when absent.
        output_max: Torque at `input_max`; a tenth of the greatest when absent.
    """

    type: Literal["JOINT_TORQUE"] = "JOINT_TORQUE"
    output_min: Numbers | None = None
    output_max: Numbers | None = None


class JointPositionController(PartController[JointLaw]):
    """Moves joint goals by actions; gains have slices of their own.

    Attributes:
        goal: Positions to hold, shape (n,), rad or m.
    """

    def __init__(
        self, part: RobotPart, config: JointPositionConfig, state: RobotState
    ) -> None:
        self.config, self._state = config, state
        gains = self._impedance = Impedance(part.name, part.joints, config)
        self.law = JointLaw(state, part.joints, kp=gains.kp, kd=gains.kd)
        low, high = _position_limits(state, part.joints, config.qpos_limits)
        least, greatest = _velocity_limits(state, part.joints, config.velocity_limits)
        self.law.keep_limits(state)
        _narrow(self.law, low, high, np.minimum(-least, greatest))
        apply_torque_settings(self.law, config)
        outputs = config.output_min, config.output_max
        self._input = _joint_input(
            part, SliceKind.POSTURE, state, config, outputs, (low, high)
        )
        self.slices = (self._input.action, *gains.slices)
        self.goal: Vector = np.zeros(len(part.joints))

    @property
    def memory(self) -> Parts:
        """Goal, and gains that actions set; views."""
        gains = self.law.gains if self._impedance.slices else ()
        return self.goal, *self._impedance.memory, *gains

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
        if self._input.scaled:
            self._step(self._input.scaling(values[:size]))
        else:
            self.goal[:] = self._input(values[:size])
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
        self.goal[moves] = self._input.clip(start + step)[moves]


class JointVelocityController(PartController[VelocityLaw]):
    """Sets joint velocities by actions; joints of zero velocity hold their positions.

    Attributes:
        goal: Commanded velocities, shape (n,), rad/s or m/s.
    """

    def __init__(
        self, part: RobotPart, config: JointVelocityConfig, state: RobotState
    ) -> None:
        self.config = config
        low, high = _velocity_limits(state, part.joints, config.velocity_limits)
        self.law = VelocityLaw(
            state,
            part.joints,
            kp=0.25 * config.kp**2 if config.ki is None else config.ki,
            kd=config.kp,
            windup=config.windup_limit,
        )
        apply_torque_settings(self.law, config)
        least, greatest = _position_limits(state, part.joints, config.qpos_limits)
        self.law.keep_limits(state)
        _narrow(self.law, least, greatest, np.maximum(-low, high))
        outputs = config.output_min, config.output_max
        self._input = _joint_input(
            part, SliceKind.VELOCITY, state, config, outputs, (low, high)
        )
        self.slices = (self._input.action,)
        self.goal: Vector = np.zeros(len(part.joints))

    @property
    def memory(self) -> Parts:
        """The commanded velocities, a view."""
        return (self.goal,)

    def reset(self, state: RobotState) -> None:
        """Stand still."""
        self.goal[:] = 0.0
        self.law.halt(state)

    def set_goal(self, values: Vector, period: float) -> None:
        """Take velocities, shape (n,)."""
        self.goal[:] = self._input(values)
        self.law.set_speed(self.goal, duration=self.config.ramp(period))

    @property
    def hold_action(self) -> Vector:
        """The action of zero velocity."""
        return self._input.neutral


class JointTorqueController(PartController[TorqueLaw]):
    """Sets joint torques by actions.

    Attributes:
        goal: Commanded torques, shape (n,), N m or N.
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
            tuple((TORQUE_SHARE * limit).tolist()) if output is None else output
            for output, limit in zip(given, limits, strict=True)
        )
        self._input = _joint_input(
            part, SliceKind.TORQUE, state, config, (least, greatest), limits
        )
        self.slices = (self._input.action,)
        self.goal: Vector = np.zeros(len(part.joints))

    @property
    def memory(self) -> Parts:
        """The commanded torques, a view."""
        return (self.goal,)

    def reset(self, state: RobotState) -> None:
        """Command zero torque."""
        self.goal[:] = 0.0
        self.law.aim(self.goal)

    def set_goal(self, values: Vector, period: float) -> None:
        """Take torques, shape (n,)."""
        self.goal[:] = self._input(values)
        self.law.move(self.goal, self.config.ramp(period))

    @property
    def hold_action(self) -> Vector:
        """The action of zero torque."""
        return self._input.neutral


def _joint_input(
    part: RobotPart,
    kind: SliceKind,
    state: RobotState,
    config: PartSettings,
    outputs: tuple[Numbers, Numbers],
    limits: tuple[Vector, Vector],
) -> SliceInput:
    """Return the input of a part with one value for each joint; see `SliceInput`."""
    hinge, slide = _UNITS[kind]
    types = [state.robot.joint(joint).type for joint in part.joints]
    return SliceInput(
        part.name,
        kind,
        labels=part.joints,
        units=tuple(hinge if kind == "hinge" else slide for kind in types),
        config=config,
        outputs=outputs,
        limits=limits,
    )


def _position_limits(
    state: RobotState, joints: Sequence[str], given: Range | None
) -> tuple[Vector, Vector]:
    """Return least and greatest positions, rad or m, infinite where there are none."""
    ranges = [state.robot.joint(j).range or (-np.inf, np.inf) for j in joints]
    low, high = np.array(ranges, dtype=np.float64).reshape(-1, 2).T
    if given is None:
        return low, high
    return narrowed(low, high, given, "qpos_limits")


def _velocity_limits(
    state: RobotState, joints: Sequence[str], given: Range | None
) -> tuple[Vector, Vector]:
    """Return least and greatest velocities, rad/s or m/s."""
    known = [state.robot.joint(joint).velocity for joint in joints]
    high = np.array([np.inf if x is None else x for x in known], dtype=np.float64)
    if given is None:
        return -high, high
    return narrowed(-high, high, given, "velocity_limits")


def _narrow(law: Law, low: Vector, high: Vector, velocity: Vector) -> None:
    """Let a law keep limits of position and velocity as well as those it has."""
    drives = law.drives
    drives["position_min"] = np.maximum(drives["position_min"], low)
    drives["position_max"] = np.minimum(drives["position_max"], high)
    drives["velocity_max"] = np.minimum(drives["velocity_max"], velocity)
