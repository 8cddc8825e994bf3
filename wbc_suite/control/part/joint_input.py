"""What an action says to joints: one value each, scaled or as it is, within limits."""

from collections.abc import Sequence

import numpy as np

from wbc_suite.control.action import ActionPart, SliceKind
from wbc_suite.control.part.config import InputScaling, Numbers, PartSettings
from wbc_suite.control.state import RobotState
from wbc_suite.typing import Vector

__all__ = ["JointInput"]

_UNITS: dict[SliceKind, tuple[str, str]] = {
    "posture": ("rad", "m"),
    "velocity": ("rad/s", "m/s"),
    "torque": ("N m", "N"),
}
"""Of values of hinges and of slides."""


class JointInput:
    """Makes positions, speeds or torques of joints out of an action's values.

    Args:
        name: The part, and its slice.
        kind: What values mean.
        state: The robot in the simulation.
        joints: Joints of the part.
        config: Gives the input's range.
        outputs: Outputs at `input_min` and at `input_max`, their units.
        scaled: Whether values are scaled; otherwise they are outputs.
        limits: Least and greatest outputs, each of shape (n,).

    Attributes:
        scaled: Whether values are scaled.
        scaling: What scales them.
        low: Least outputs, shape (n,).
        high: Greatest outputs, shape (n,).
        part: The action's slice, with one value for each joint.

    Raises:
        ConfigError: If a number of values is wrong, or a range is empty.
    """

    def __init__(
        self,
        name: str,
        kind: SliceKind,
        state: RobotState,
        joints: Sequence[str],
        *,
        config: PartSettings,
        outputs: tuple[Numbers, Numbers],
        scaled: bool,
        limits: tuple[Vector, Vector],
    ) -> None:
        self.scaled = scaled
        self.scaling = InputScaling(len(joints), config, *outputs)
        self.low, self.high = limits
        hinge, slide = _UNITS[kind]
        units = tuple(
            hinge if state.robot.joint(joint).type == "hinge" else slide
            for joint in joints
        )
        if scaled:
            limits = self.scaling.low, self.scaling.high
            units = self.scaling.units(units)
        low, high = (tuple(limit.tolist()) for limit in limits)
        self.part = ActionPart(
            name=name, kind=kind, labels=tuple(joints), units=units, low=low, high=high
        )

    def __call__(self, values: Vector) -> Vector:
        """Return the outputs, shape (n,)."""
        outputs = self.scaling(values) if self.scaled else values
        return np.clip(outputs, self.low, self.high)

    @property
    def neutral(self) -> Vector:
        """The values that ask for nothing, or for the least possible, shape (n,)."""
        if self.scaled:
            return self.scaling.neutral
        return np.clip(np.zeros(len(self.low)), self.low, self.high)
