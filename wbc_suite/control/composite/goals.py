"""Goals of controlled frames: from action slices to poses in the world and back."""

import numpy as np
import pinocchio as pin

from wbc_suite.control.action import ActionPart, SliceKind
from wbc_suite.control.composite.config import ControlledFrame, WholeBodyIKConfig
from wbc_suite.typing import Matrix, Vector

__all__ = [
    "REACH",
    "action_of_pose",
    "action_part",
    "bounded_pose",
    "pose_of_action",
    "shift_pose",
]

REACH = 10.0
"""Bound of absolute positions, m: a typing error, not a place to reach for."""

_XYZ = ("x", "y", "z")
_TURN = ("rx", "ry", "rz")
_LABELS: dict[str, tuple[str, ...]] = {
    "pose": (*_XYZ, *_TURN),
    "position": _XYZ,
    "com": _XYZ,
    "orientation": _TURN,
    "base": ("x", "y", "yaw"),
}
_KINDS: dict[str, SliceKind] = {
    "pose": "pose",
    "position": "position",
    "com": "position",
    "orientation": "orientation",
    "base": "base",
}


def action_part(frame: ControlledFrame, config: WholeBodyIKConfig) -> ActionPart:
    """Return the action slice of a controlled frame.

    Rotations are rotation vectors (axis times angle), rad.
    """
    labels = _LABELS[frame.kind]
    absolute = config.input_type == "absolute"
    far = REACH if absolute else config.delta_position
    turn = float(np.pi) if absolute else config.delta_rotation
    units = tuple("m" if label in _XYZ else "rad" for label in labels)
    bounds = tuple(far if unit == "m" else turn for unit in units)
    return ActionPart(
        name=frame.name,
        kind=_KINDS[frame.kind],
        labels=labels,
        units=units,
        low=tuple(-b for b in bounds),
        high=bounds,
    )


def action_of_pose(kind: str, pose: pin.SE3) -> Vector:
    """Return the absolute slice values that ask for a pose."""
    turn = pin.log3(pose.rotation)
    match kind:
        case "pose":
            return np.concatenate([pose.translation, turn])
        case "orientation":
            return turn
        case "base":
            yaw = np.arctan2(pose.rotation[1, 0], pose.rotation[0, 0])
            return np.array([pose.translation[0], pose.translation[1], yaw])
    return pose.translation.copy()


def pose_of_action(kind: str, values: Vector, now: pin.SE3) -> pin.SE3:
    """Return the pose that absolute slice values ask for.

    Args:
        kind: Kind of the controlled frame.
        values: The slice.
        now: Gives what the slice does not say.
    """
    match kind:
        case "pose":
            return pin.SE3(pin.exp3(values[3:]), values[:3].copy())
        case "orientation":
            return pin.SE3(pin.exp3(values), now.translation.copy())
        case "base":
            place = np.array([values[0], values[1], now.translation[2]])
            return pin.SE3(pin.exp3(np.array([0.0, 0.0, values[2]])), place)
    return pin.SE3(now.rotation.copy(), values.copy())


def bounded_pose(
    goal: pin.SE3, home: pin.SE3, limits: tuple[float, float] | None
) -> pin.SE3:
    """Return the goal, or the pose on the way from home to it that is within limits.

    Args:
        goal: Where to go.
        home: Where distances are counted from.
        limits: Greatest distances, m and rad.
    """
    if limits is None:
        return goal
    offset = goal.translation - home.translation
    turn = pin.log3(home.rotation.T @ goal.rotation)
    offset = offset * min(1.0, limits[0] / max(float(np.linalg.norm(offset)), 1e-12))
    turn = turn * min(1.0, limits[1] / max(float(np.linalg.norm(turn)), 1e-12))
    return pin.SE3(home.rotation @ pin.exp3(turn), home.translation + offset)


def shift_pose(kind: str, values: Vector, goal: pin.SE3, axes: Matrix) -> pin.SE3:
    """Return a goal moved by a delta slice, in the given axes, shape (3, 3)."""
    step, turn = np.zeros(3), np.zeros(3)
    match kind:
        case "pose":
            step, turn = values[:3], values[3:]
        case "orientation":
            turn = values
        case "base":
            step, turn = np.array([*values[:2], 0.0]), np.array([0.0, 0.0, values[2]])
        case _:
            step = values
    rotation = pin.exp3(axes @ turn) @ goal.rotation
    return pin.SE3(rotation, goal.translation + axes @ step)
