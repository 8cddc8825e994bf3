"""Joint goals from an action: one value for each joint, within limits."""

from collections.abc import Sequence

import numpy as np

from wbc_suite.control.action import ActionPart, SliceKind, Unit
from wbc_suite.control.law.law import Law
from wbc_suite.control.part.part_settings import (
    InputScaling,
    Numbers,
    PartSettings,
    Range,
    limits_of,
)
from wbc_suite.control.robot_parts import RobotPart
from wbc_suite.control.state import RobotState
from wbc_suite.typing import Vector

_UNITS: dict[SliceKind, tuple[Unit, Unit]] = {
    SliceKind.POSTURE: (Unit("rad"), Unit("m")),
    SliceKind.VELOCITY: (Unit("rad/s"), Unit("m/s")),
    SliceKind.TORQUE: (Unit("N m"), Unit("N")),
}
"""Units of revolute and of prismatic joints."""


class JointInput:
    """Makes positions, velocities or torques of joints from an action's values.

    Args:
        part: The part; its name is that of the slice.
        kind: What the values set.
        state: The robot in the simulation.
        config: Settings with the range of the input.
        outputs: Outputs at `input_min` and at `input_max`, their units.
        scaled: Whether values are scaled; otherwise they are outputs.
        limits: Least and greatest outputs, each of shape (n,).

    Attributes:
        scaled: Whether values are scaled.
        scaling: Scales them.
        low: Least outputs, shape (n,).
        high: Greatest outputs, shape (n,).
        action: The action's slice, with one value for each joint.

    Raises:
        ConfigError: If a number of values is wrong, or a range is empty.
    """

    def __init__(
        self,
        part: RobotPart,
        kind: SliceKind,
        state: RobotState,
        *,
        config: PartSettings,
        outputs: tuple[Numbers, Numbers],
        scaled: bool,
        limits: tuple[Vector, Vector],
    ) -> None:
        self.scaled = scaled
        self.scaling = InputScaling(len(part.joints), config, *outputs)
        self.low, self.high = limits
        hinge, slide = _UNITS[kind]
        units = tuple(
            hinge if state.robot.joint(joint).type == "hinge" else slide
            for joint in part.joints
        )
        if scaled:
            limits = self.scaling.low, self.scaling.high
            units = self.scaling.units(units)
        low, high = (tuple(limit.tolist()) for limit in limits)
        self.action = ActionPart(
            name=part.name,
            kind=kind,
            labels=part.joints,
            units=units,
            low=low,
            high=high,
        )

    def __call__(self, values: Vector) -> Vector:
        """Return the outputs, shape (n,)."""
        return self.clip(self.scaling(values) if self.scaled else values)

    def clip(self, outputs: Vector) -> Vector:
        """Return outputs within their limits, shape (n,)."""
        return np.minimum(np.maximum(outputs, self.low), self.high)

    @property
    def neutral(self) -> Vector:
        """The values whose outputs are zero, or nearest to it, shape (n,)."""
        return (
            self.scaling.neutral if self.scaled else self.clip(np.zeros_like(self.low))
        )


def position_limits(
    state: RobotState, joints: Sequence[str], given: Range | None = None
) -> tuple[Vector, Vector]:
    """Return least and greatest positions, rad or m, infinite where there are none.

    Args:
        state: The robot.
        joints: Its joints.
        given: Narrower limits, the key `qpos_limits`.
    """
    ranges = [state.robot.joint(j).range or (-np.inf, np.inf) for j in joints]
    low, high = np.array(ranges, dtype=np.float64).reshape(-1, 2).T
    return _narrowed(low, high, given, "qpos_limits")


def velocity_limits(
    state: RobotState, joints: Sequence[str], given: Range | None = None
) -> tuple[Vector, Vector]:
    """Return least and greatest velocities, rad/s or m/s.

    Args:
        state: The robot.
        joints: Its joints.
        given: Narrower limits, the key `velocity_limits`.
    """
    known = [state.robot.joint(joint).velocity for joint in joints]
    high = np.array([np.inf if x is None else x for x in known], dtype=np.float64)
    return _narrowed(-high, high, given, "velocity_limits")


def narrow_limits(law: Law, low: Vector, high: Vector, velocity: Vector) -> None:
    """Let a law keep limits of position and velocity as well as those it has."""
    drives = law.drives
    drives["position_min"] = np.maximum(drives["position_min"], low)
    drives["position_max"] = np.minimum(drives["position_max"], high)
    drives["velocity_max"] = np.minimum(drives["velocity_max"], velocity)


def _narrowed(
    low: Vector, high: Vector, given: Range | None, key: str
) -> tuple[Vector, Vector]:
    if given is None:
        return low, high
    least, greatest = limits_of(given, len(low), key)
    return np.maximum(low, least), np.minimum(high, greatest)
