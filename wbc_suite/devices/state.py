"""The state of a device: frozen, with a time stamp, by limb, and its mirror image."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from wbc_suite.typing import Matrix, Vector

_FLIP = np.diag([1.0, -1.0, 1.0])  # left and right change places
_TWIST = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])  # a rotation is a pseudovector


def _frozen(values: ArrayLike | None, shape: tuple[int, ...] = ()) -> Vector | None:
    if values is None:
        return None
    array = np.array(values, dtype=np.float64)
    if shape and array.shape != shape:
        raise ValueError(f"an array of a device has shape {array.shape}, not {shape}")
    array.flags.writeable = False
    return array


@dataclass(frozen=True, slots=True, kw_only=True)
class LimbInput:
    """Input of a device for one limb; None where there is none.

    Attributes:
        pose: Pose of the input in a fixed frame, x forward, y left, z up.
        twist: Velocity in axes of the world, m/s and rad/s, shape (6,).
        engaged: Whether the limb follows the input.
        grip: Closing of the gripper, -1 open .. 1 closed: one value for all synergies,
            or one for each. A device that only toggles has the button `grip`.
        fingers: Joints of the user's hand, m, in any frame, shape (25, 3), in the
            order of WebXR.
    """

    pose: pin.SE3 | None = None
    twist: Vector | None = None
    engaged: bool = True
    grip: Vector | None = None
    fingers: Matrix | None = None

    def __post_init__(self) -> None:
        shapes = {"twist": (6,), "grip": (), "fingers": (25, 3)}
        for name, shape in shapes.items():
            object.__setattr__(self, name, _frozen(getattr(self, name), shape))

    @property
    def finite(self) -> bool:
        """Whether all numbers are finite."""
        arrays = [self.twist, self.grip, self.fingers]
        if self.pose is not None:
            arrays += [self.pose.rotation, self.pose.translation]
        return all(np.isfinite(array).all() for array in arrays if array is not None)


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceState:
    """State of a device at one moment.

    Attributes:
        time: Time of the measurement on the device's own clock, s. A state whose time
            has not advanced is an old one.
        limbs: Input by limb: a slice of the action (`right_hand`), its side (`right`),
            or `hand`, the selected one.
        joints: Positions by joint, rad or m, as a leader arm has them.
        base: Velocity of the base in its own axes: forward and left, m/s, turn, rad/s.
        height: Velocity of the torso's height, m/s.
        buttons: Names of buttons pressed since the last read: `grip` (closes or opens
            the gripper of the selected hand), `next`, `mirror`, `home`, `pause`,
            `reset`, `quit`, and of a recording `keep` (or start), `discard`, `undo`
            and `success`.
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
        object.__setattr__(self, "base", _frozen(self.base, (3,)))

    @property
    def finite(self) -> bool:
        """Whether all numbers are finite."""
        base = () if self.base is None else self.base
        numbers = [self.time, self.height, *self.joints.values(), *base]
        limbs = all(limb.finite for limb in self.limbs.values())
        return limbs and bool(np.isfinite(numbers).all())

    @property
    def at_rest(self) -> bool:
        """Whether no velocity is commanded."""
        base = self.base is not None and bool(self.base.any())
        twists = [limb.twist for limb in self.limbs.values()]
        turns = any(twist is not None and twist.any() for twist in twists)
        return not (turns or base or self.height)


def without_velocities(state: DeviceState) -> DeviceState:
    """Return a state that commands no velocity."""
    limbs = {name: replace(limb, twist=None) for name, limb in state.limbs.items()}
    return replace(state, limbs=limbs, base=None, height=0.0)


def mirrored(state: DeviceState) -> DeviceState:
    """Return a state with left and right swapped, for a user who faces the robot."""
    base = state.base
    return replace(
        state,
        limbs={_swapped(name): _mirror(limb) for name, limb in state.limbs.items()},
        base=None if base is None else base * _TWIST[[0, 1, 5]],
    )


def _swapped(name: str) -> str:
    other = {"left": "right", "right": "left"}
    return "_".join(other.get(word, word) for word in name.split("_"))


def _mirror(limb: LimbInput) -> LimbInput:
    pose, twist, fingers = limb.pose, limb.twist, limb.fingers
    if pose is not None:
        pose = pin.SE3(_FLIP @ pose.rotation @ _FLIP, _FLIP @ pose.translation)
    return replace(
        limb,
        pose=pose,
        twist=None if twist is None else twist * _TWIST,
        fingers=None if fingers is None else fingers @ _FLIP,
    )
