"""Limbs: what a target commands, and how an action says it."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import pinocchio as pin

from wbc_suite.typing import Vector

__all__ = ["LimbKind", "LimbPort", "command", "robot_of", "side_of"]


class LimbKind(StrEnum):
    """Which part of a pose a limb's target commands."""

    POSE = "pose"
    POSITION = "position"
    ORIENTATION = "orientation"
    PLANAR = "planar"


@dataclass(frozen=True, slots=True, kw_only=True)
class LimbPort:
    """A slice of the action that places a frame.

    Attributes:
        name: Name of the slice.
        kind: Which part of the pose it commands.
        body: Body of the simulation that the frame is fixed to; -1 for none.
        measure: Gives the pose of the simulated frame in the world.
        encode: Turns a target in the world into the values of the slice.
        ground: Gives the pose of what targets ride on, such as a base that drives;
            None where they stay in the world.
    """

    name: str
    kind: LimbKind
    body: int
    measure: Callable[[], pin.SE3]
    encode: Callable[[pin.SE3], Vector]
    ground: Callable[[], pin.SE3] | None = None


def command(kind: LimbKind, T_world_target: pin.SE3) -> Vector:
    """Return a target as an absolute slice in the world has it.

    Returns:
        Position (3) and rotation vector (3), either of the two, or x, y and yaw.
    """
    position, R = T_world_target.translation, T_world_target.rotation
    match kind:
        case LimbKind.POSE:
            return np.concatenate([position, pin.log3(R)])
        case LimbKind.POSITION:
            return position
        case LimbKind.ORIENTATION:
            return pin.log3(R)
        case LimbKind.PLANAR:
            return np.array([position[0], position[1], np.arctan2(R[1, 0], R[0, 0])])


def side_of(name: str) -> str:
    """Return `right` or `left` if a limb's name has it, else the name."""
    return next((side for side in ("right", "left") if side in name.split("_")), name)


def robot_of(name: str) -> str:
    """Return the prefix of a slice's robot where there are several, else nothing."""
    first = name.split("_")[0]
    return first + "_" if first[:5] == "robot" and first[5:].isdigit() else ""
