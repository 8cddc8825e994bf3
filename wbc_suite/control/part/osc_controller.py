"""OSC_POSE and OSC_POSITION: actions move a hand's goal, which `OscLaw` follows."""

import numpy as np
import pinocchio as pin

from wbc_suite.control.action import ActionPart
from wbc_suite.control.part.config import (
    InputScaling,
    Span,
    damping_of,
    limits_of,
    set_torque_rules,
)
from wbc_suite.control.part.controller import WHENEVER
from wbc_suite.control.part.impedance import Impedance
from wbc_suite.control.part.osc import OscLaw
from wbc_suite.control.part.osc_config import OscConfig
from wbc_suite.control.part.osc_goal import GoalLimits
from wbc_suite.control.part.osc_step import (
    GoalField,
    bound_goal,
    move_goal,
    relative_pose,
)
from wbc_suite.control.state import RobotState
from wbc_suite.errors import UnknownNameError
from wbc_suite.kinematics.array_table import ArrayTable
from wbc_suite.typing import Matrix, Vector

__all__ = ["OscConfig", "OscController"]

AXES = ("x", "y", "z", "rx", "ry", "rz")
UNITS = ("m", "m", "m", "rad", "rad", "rad")

REACH = 10.0
"""Bound of absolute positions, m: a typing error, not a place to reach for."""


class OscController:
    """Moves a hand's goal by actions.

    Args:
        name: The part, and its slice; gains have slices of their own.
        config: Gains and meaning of the input.
        state: The robot in the simulation.
        joints: Joints of the arm.
        site: Frame of the hand.

    Raises:
        ConfigError: If a number of values is wrong, or a range is empty.
        UnknownNameError: If the posture names a joint that the arm does not have.
    """

    def __init__(
        self,
        name: str,
        config: OscConfig,
        state: RobotState,
        joints: tuple[str, ...],
        site: str,
    ) -> None:
        self.config, self._state = config, state
        self._size, self._absolute = config.size, config.input_type == "absolute"
        self._ramp = config.ramp(1.0)
        self._impedance = Impedance(name, AXES, config)
        self._scaling = InputScaling(config.size, config, *config.outputs())
        self._limits = GoalLimits(
            position=_limits(config.position_limits, "position_limits"),
            turn=_limits(config.orientation_limits, "orientation_limits"),
        )
        for joint in config.posture:
            if joint not in joints:
                raise UnknownNameError(f"joint of '{name}'", joint, joints)
        self.law = self._make_law(joints, site)
        self.slices = (self._motion_part(name), *self._impedance.slices)
        self._goal, self._start = np.zeros(12), np.zeros(9)
        self._frames = self.law.frames(state)
        self._table = self._bind()
        self._write_gains()
        self.reset(state)

    def reset(self, state: RobotState) -> None:
        """Hold the hand where it is, and the posture that it has."""
        posture = state.data.qpos[self.law.drives["qpos"]]
        for k, joint in enumerate(self.law.joints):
            posture[k] = self.config.posture.get(joint, posture[k])
        self.law.drives["position"] = posture
        relative_pose(*self._frames, self._goal)
        self._start[:] = self._goal[:9]
        self.law.jump(self._goal)

    def set_goal(self, values: Vector, period: float) -> None:
        """Take a step or a goal, shape (6,) or (3,), and gains as the mode has them."""
        size, ramp = self._size, self._ramp * period
        if self._impedance.slices:
            self._impedance.take(values[size:])
            self._write_gains()
        start = self.law.target_pose()[0] if ramp > 0.0 else None
        if self._absolute:
            self._go_to(values[:size])
            self.law.jump(self._goal)
        else:
            move_goal(values[:size], self._table.table, self.law.record)
        if start is not None:
            self.law.set_goal(self.goal, start=start, duration=ramp)

    @property
    def goal(self) -> pin.SE3:
        """Pose to hold, in the reference's axes."""
        return pin.SE3(self._goal[:9].reshape(3, 3), self._goal[9:])

    @goal.setter
    def goal(self, pose: pin.SE3) -> None:
        self._goal[:9], self._goal[9:] = pose.rotation.ravel(), pose.translation

    def prepare(self, state: RobotState) -> int:
        """Do nothing: the law follows."""
        return WHENEVER

    @property
    def hold_action(self) -> Vector:
        """The action that keeps the goal."""
        motion = self._scaling.neutral
        if self.config.input_type == "absolute":
            pose = [self.goal.translation, pin.log3(self.goal.rotation)]
            motion = np.concatenate(pose)[: self.config.size]
        return np.concatenate([motion, self._impedance.hold_action])

    def _go_to(self, values: Vector) -> None:
        """Take a goal: a position, and a rotation vector or the first orientation."""
        goal, limits = self._goal, self._limits
        turned = len(values) == 6
        goal[:9] = pin.exp3(values[3:]).ravel() if turned else self._start
        goal[9:] = values[:3]
        bound_goal(goal, self._start, limits.position, limits.turn)

    def _bind(self) -> ArrayTable:
        """Return where what moves the goal is; see `move_goal`."""
        config, limits = self.config, self._limits
        in_hand = config.input_ref_frame == "eef"
        from_hand = config.goal_update_mode == "achieved"
        return ArrayTable(
            GoalField,
            {
                GoalField.GOAL: self._goal,
                GoalField.START: self._start,
                GoalField.GAIN: self._scaling.gain,
                GoalField.OFFSET: self._scaling.offset,
                GoalField.R_BODY: self._frames[0],
                GoalField.P_BODY: self._frames[1],
                GoalField.R_SITE: self._frames[2],
                GoalField.P_SITE: self._frames[3],
                GoalField.POSITION: limits.position,
                GoalField.TURN: limits.turn,
                GoalField.RULES: np.array([in_hand, from_hand], dtype=np.int64),
            },
        )

    def _make_law(self, joints: tuple[str, ...], site: str) -> OscLaw:
        config, state = self.config, self._state
        law = OscLaw(state, joints, site)
        set_torque_rules(law, config)
        law.keep_limits(state)
        law.drives["kp"] = config.posture_kp
        law.drives["kd"] = damping_of(config.posture_kp, 1.0)
        law.record["speed"] = config.velocity_limits or np.inf
        law.record["straight"] = float(config.saturation == "qp")
        if config.input_ref_frame != "world":
            base = state.prefix + state.robot.links[0].name
            law.record["reference"] = state.model.body(base).id
        return law

    def _write_gains(self) -> None:
        self.law.record["kp"] = self._impedance.kp
        self.law.record["kd"] = self._impedance.kd

    def _motion_part(self, name: str) -> ActionPart:
        """Return the slice that moves the goal."""
        size = self.config.size
        units, (low, high) = UNITS[:size], self._bounds()
        if self.config.input_type == "delta":
            low, high = self._scaling.low, self._scaling.high
            units = self._scaling.units(units)
        return ActionPart(
            name=name,
            kind="pose" if size == 6 else "position",
            labels=AXES[:size],
            units=units,
            low=tuple(low.tolist()),
            high=tuple(high.tolist()),
        )

    def _bounds(self) -> tuple[Vector, Vector]:
        """Return least and greatest absolute goals."""
        turn = np.full(3, np.pi)
        low = np.concatenate([np.maximum(self._limits.position[0], -REACH), -turn])
        high = np.concatenate([np.minimum(self._limits.position[1], REACH), turn])
        return low[: self.config.size], high[: self.config.size]


def _limits(span: Span | None, key: str) -> Matrix:
    """Return least and greatest values, shape (2, 3), infinite without a span."""
    if span is None:
        return np.array([[-np.inf] * 3, [np.inf] * 3])
    return np.array(limits_of(span, 3, key))
