"""What a device says: one frozen, time-stamped, name-keyed value."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from wbc_suite.typing import Matrix, Vector

__all__ = ["DeviceState", "LimbInput"]


def _frozen(values: ArrayLike | None) -> Vector | None:
    if values is None:
        return None
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array


@dataclass(frozen=True, slots=True, kw_only=True)
class LimbInput:
    """What a device says about one limb; what is None is not said.

    Attributes:
        pose: Pose of the input in a fixed frame of the device, x forward, y left, z up.
        twist: Velocity that is wanted, axes of the world, m/s and rad/s, shape (6,).
        engaged: Whether the limb follows; a clutch pedal that is let go says no.
        grip: Closing of the gripper, -1 open .. 1 closed: one value for all synergies,
            or one for each. A device that only toggles says the button `grip`.
        fingers: Joints of the person's hand, m, in any frame, shape (25, 3), in the
            order of WebXR.
    """

    pose: pin.SE3 | None = None
    twist: Vector | None = None
    engaged: bool = True
    grip: Vector | None = None
    fingers: Matrix | None = None

    def __post_init__(self) -> None:
        for name in ("twist", "grip", "fingers"):
            object.__setattr__(self, name, _frozen(getattr(self, name)))

    @property
    def finite(self) -> bool:
        """Whether every number is one."""
        arrays = [self.twist, self.grip, self.fingers]
        if self.pose is not None:
            arrays += [self.pose.rotation, self.pose.translation]
        return all(np.isfinite(array).all() for array in arrays if array is not None)


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceState:
    """Everything that a device says at one moment.

    Attributes:
        time: When it was measured, on the device's own clock, s. A state whose time has
            not moved on is the old one.
        limbs: Input by limb: a slice of the action (`right_hand`), its side (`right`),
            or `hand`, which is the one that is switched to.
        joints: Positions by joint, rad or m, as a leader arm has them.
        base: Velocity of the base that is wanted, in its own axes: forward and left,
            m/s, turn, rad/s.
        height: Velocity of the torso's height that is wanted, m/s.
        buttons: Names of what is pressed, or was since the last read: `grip` (closes
            the gripper of the hand that is switched to, or opens it), `next`, `mirror`,
            `home`, `pause`, `reset`, `quit`, and of a recording `keep` (or begin),
            `discard`, `undo` and `success`.
    """

    time: float
    limbs: Mapping[str, LimbInput] = field(default_factory=dict)
    joints: Mapping[str, float] = field(default_factory=dict)
    base: Vector | None = None
    height: float = 0.0
    buttons: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        object.__setattr__(self, "limbs", MappingProxyType(dict(self.limbs)))
        object.__setattr__(self, "joints", MappingProxyType(dict(self.joints)))
        object.__setattr__(self, "base", _frozen(self.base))

    @property
    def finite(self) -> bool:
        """Whether every number is one."""
        numbers = [self.time, self.height, *self.joints.values()]
        base = () if self.base is None else self.base
        return bool(np.isfinite([*numbers, *base]).all()) and all(
            limb.finite for limb in self.limbs.values()
        )
