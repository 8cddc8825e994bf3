"""robosuite's actions of variable impedance: damping ratios, stiffness, then motion.

`variable` is `[ratios, kp, motion]` with `kd = 2 ratio sqrt(kp)`, `variable_kp` is
`[kp, motion]` and critically damped; our own parts take `[motion, kp, kd]`.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from wbc_suite.control.action import ActionPart, Unit
from wbc_suite.control.part.impedance import Gains
from wbc_suite.control.part.joint_controllers import (
    JointPositionConfig,
    JointPositionController,
)
from wbc_suite.control.part.part_settings import damping_of, limits_of
from wbc_suite.control.part.registry import register_part_controller
from wbc_suite.control.robot_parts import RobotPart
from wbc_suite.control.state import RobotState
from wbc_suite.typing import Vector

VARIABLE_JOINTS = "VARIABLE_JOINT_POSITION"
"""Type of `JOINT_POSITION` with variable impedance of robosuite's configs."""


class GainsFirst:
    """The order of a part's action in robosuite.

    Args:
        slices: Our slices: motion, perhaps stiffness, perhaps damping.
        ratio_limits: Least and greatest damping ratios.

    Attributes:
        slices: The same in robosuite's order, with damping ratios for damping.
    """

    def __init__(
        self, slices: Sequence[ActionPart], ratio_limits: tuple[Gains, Gains]
    ) -> None:
        motion, *gains = slices
        self._motion = len(motion.labels)
        self._kp = len(gains[0].labels) if gains else 0
        if len(gains) == 2:
            damping = gains[1]
            low, high = limits_of(ratio_limits, self._kp, "damping_ratio_limits")
            gains[1] = replace(
                damping,
                name=damping.name.removesuffix("kd") + "damping_ratio",
                units=(Unit("1"),) * self._kp,
                low=tuple(low.tolist()),
                high=tuple(high.tolist()),
            )
        self.slices = (*reversed(gains), motion)

    def ours(self, values: Vector) -> Vector:
        """Return motion, stiffness and damping of an action in robosuite's order."""
        first = len(values) - self._motion
        gains, motion = values[:first], values[first:]
        kp = gains[first - self._kp :]
        kd = damping_of(kp, gains[: self._kp]) if first > self._kp else kp[:0]
        return np.concatenate([motion, kp, kd])

    def theirs(self, values: Vector) -> Vector:
        """Return the action in robosuite's order of motion, stiffness and damping."""
        last = self._motion + self._kp
        motion, kp, kd = np.split(values, [self._motion, last])
        ratio = kd / damping_of(np.maximum(kp, 1e-12), 1.0) if len(kd) else kd
        return np.concatenate([ratio, kp, motion])


class GainsFirstController:
    """Mixed into a part controller: robosuite's order of the action."""

    def __init__(self, part: RobotPart, config: Any, state: RobotState) -> None:
        super().__init__(part, config, state)  # pyright: ignore[reportCallIssue] - of the next class
        own: Any = self
        self._order = GainsFirst(own.slices, config.damping_ratio_limits)
        self.slices = self._order.slices

    def set_goal(self, values: Vector, period: float) -> None:
        """Take gains, then a step or a goal."""
        following: Any = super()
        following.set_goal(self._order.ours(values), period)

    @property
    def hold_action(self) -> Vector:
        """The action that keeps the goal and the gains."""
        following: Any = super()
        return self._order.theirs(following.hold_action)


class VariableJointConfig(JointPositionConfig):
    """Config of joint positions with robosuite's order of the action."""

    type: Literal["VARIABLE_JOINT_POSITION"] = "VARIABLE_JOINT_POSITION"  # pyright: ignore[reportIncompatibleVariableOverride] - a type of its own
    damping_ratio_limits: tuple[Gains, Gains] = (0.0, 100.0)


class VariableJointController(GainsFirstController, JointPositionController):
    """`JointPositionController` with robosuite's order of the action."""


register_part_controller(VARIABLE_JOINTS, VariableJointController, VariableJointConfig)
