"""Limits of a part's joints: the robot's own, and narrower ones of a config."""

from collections.abc import Sequence

import numpy as np

from wbc_suite.control.part.config import Span, limits_of
from wbc_suite.control.part.law import Law
from wbc_suite.control.state import RobotState
from wbc_suite.typing import Vector

__all__ = ["keep_within", "position_limits", "speed_limits"]


def position_limits(
    state: RobotState, joints: Sequence[str], span: Span | None = None
) -> tuple[Vector, Vector]:
    """Return least and greatest positions, rad or m, infinite where there are none.

    Args:
        state: The robot.
        joints: Its joints.
        span: Narrower limits, the key `qpos_limits`.
    """
    ranges = [state.robot.joint(j).range or (-np.inf, np.inf) for j in joints]
    low, high = np.array(ranges, dtype=np.float64).reshape(-1, 2).T
    return _narrowed(low, high, span, "qpos_limits")


def speed_limits(
    state: RobotState, joints: Sequence[str], span: Span | None = None
) -> tuple[Vector, Vector]:
    """Return least and greatest speeds, rad/s or m/s.

    Args:
        state: The robot.
        joints: Its joints.
        span: Narrower limits, the key `velocity_limits`.
    """
    high = _numbers([state.robot.joint(j).velocity for j in joints])
    return _narrowed(-high, high, span, "velocity_limits")


def keep_within(law: Law, low: Vector, high: Vector, fastest: Vector) -> None:
    """Let a law keep these limits beside those that it keeps; see `Law.keep_limits`."""
    drives = law.drives
    drives["lowest"] = np.maximum(drives["lowest"], low)
    drives["highest"] = np.minimum(drives["highest"], high)
    drives["fastest"] = np.minimum(drives["fastest"], fastest)


def _numbers(values: Sequence[float | None]) -> Vector:
    return np.array([np.inf if x is None else x for x in values], dtype=np.float64)


def _narrowed(
    low: Vector, high: Vector, span: Span | None, key: str
) -> tuple[Vector, Vector]:
    if span is None:
        return low, high
    least, greatest = limits_of(span, len(low), key)
    return np.maximum(low, least), np.minimum(high, greatest)
