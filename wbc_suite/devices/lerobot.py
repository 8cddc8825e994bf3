"""Adapters between devices and LeRobot's teleoperators; LeRobot is not imported.

A teleoperator returns a flat dictionary of numbers. The keys here are
`right.x .y .z .rx .ry .rz` for a pose (m, rotation vector in rad), `right.vx ... .wz`
for a twist, `right.engaged`, `right.grip` (or `right.grip.0`, ... by synergy),
`elbow.pos` for a joint, `base.forward .left .turn`, and `button.keep`, `button.grip`.
"""

import math
import time
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np
import pinocchio as pin

from wbc_suite.devices.device import Device
from wbc_suite.devices.state import DeviceState, LimbInput
from wbc_suite.errors import DeviceError
from wbc_suite.typing import Vector

POSE = ("x", "y", "z", "rx", "ry", "rz")
TWIST = ("vx", "vy", "vz", "wx", "wy", "wz")
BASE = ("forward", "left", "turn")


class Teleoperator(Protocol):
    """The part of LeRobot's teleoperators that is used here."""

    def connect(self) -> None:
        """Open it."""
        ...

    def get_action(self) -> Mapping[str, Any]:
        """Return numbers by name."""
        ...

    def disconnect(self) -> None:
        """Close it."""
        ...


def flatten(state: DeviceState) -> dict[str, float]:
    """Return a state as a flat dictionary; for its keys see the module."""
    flat: dict[str, float] = {}
    for name, limb in state.limbs.items():
        if limb.pose is not None:
            turn = pin.log3(limb.pose.rotation)
            flat |= _named(name, POSE, np.concatenate([limb.pose.translation, turn]))
        if limb.twist is not None:
            flat |= _named(name, TWIST, limb.twist)
        flat[f"{name}.engaged"] = float(limb.engaged)
        if limb.grip is not None and limb.grip.ndim == 0:
            flat[f"{name}.grip"] = float(limb.grip)
        elif limb.grip is not None:
            flat |= {f"{name}.grip.{k}": float(x) for k, x in enumerate(limb.grip)}
    flat |= {f"{joint}.pos": float(x) for joint, x in state.joints.items()}
    if state.base is not None:
        flat |= _named("base", BASE, state.base)
    return flat | {f"button.{name}": 1.0 for name in sorted(state.buttons)}


def unflatten(flat: Mapping[str, Any], time: float) -> DeviceState:
    """Return a flat dictionary as a state; other keys are ignored.

    Raises:
        DeviceError: If a value is not a number.
    """
    groups: dict[str, dict[str, float]] = {}
    joints: dict[str, float] = {}
    for key, value in flat.items():
        name, _, rest = key.partition(".")
        groups.setdefault(name, {})[rest] = _number(key, value)
        if key.endswith(".pos"):
            joints[key.removesuffix(".pos")] = groups[name][rest]
    buttons = groups.pop("button", {})
    return DeviceState(
        time=time,
        limbs={n: _limb(groups[n]) for n in sorted(groups) if _is_limb(groups[n])},
        joints=joints,
        base=_taken(groups.get("base", {}), BASE),
        buttons=frozenset(name for name, x in buttons.items() if x > 0.5),
    )


class ToLeRobot:
    """A device as a teleoperator of LeRobot."""

    name = "wbc_suite"
    is_calibrated = True

    def __init__(self, device: Device) -> None:
        self._device = device
        self.is_connected = False

    @property
    def action_features(self) -> dict[str, type]:
        """Keys of the current state, each a float."""
        return dict.fromkeys(self.get_action(), float)

    @property
    def feedback_features(self) -> dict[str, type]:
        """Empty: devices have no feedback."""
        return {}

    def connect(self, calibrate: bool = True) -> None:
        """Start the device."""
        self._device.start()
        self.is_connected = True

    def calibrate(self) -> None:
        """Do nothing."""

    def configure(self) -> None:
        """Do nothing."""

    def get_action(self) -> dict[str, float]:
        """Return the newest state as a flat dictionary."""
        return flatten(self._device.read())

    def send_feedback(self, feedback: Mapping[str, Any]) -> None:
        """Do nothing."""

    def disconnect(self) -> None:
        """Stop the device."""
        self.is_connected = False
        self._device.stop()


class FromLeRobot:
    """A teleoperator of LeRobot as a device.

    Args:
        teleoperator: Connected by `start`.
        names: New keys of the teleoperator's keys, such as `shoulder_pan.pos` to
            `right_shoulder_yaw_joint.pos`; other keys are kept.
        scale: Factor by new key; LeRobot's arms often have degrees: `DEGREES`.
        clock: Source of time, s.
    """

    def __init__(
        self,
        teleoperator: Teleoperator,
        names: Mapping[str, str] | None = None,
        scale: Mapping[str, float] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._teleoperator, self._clock = teleoperator, clock
        self._names, self._scale = dict(names or {}), dict(scale or {})

    def start(self) -> None:
        """Connect the teleoperator."""
        self._teleoperator.connect()

    def read(self) -> DeviceState:
        """Return its current state."""
        action = self._teleoperator.get_action()
        flat = {self._names.get(name, name): value for name, value in action.items()}
        for name, factor in self._scale.items():
            if name in flat:
                flat[name] = factor * _number(name, flat[name])
        return unflatten(flat, self._clock())

    def stop(self) -> None:
        """Disconnect the teleoperator."""
        self._teleoperator.disconnect()


def _named(name: str, ends: tuple[str, ...], values: Vector) -> dict[str, float]:
    return {f"{name}.{end}": float(x) for end, x in zip(ends, values, strict=True)}


def _taken(group: Mapping[str, float], ends: tuple[str, ...]) -> Vector | None:
    """Return the values of a group, 0 where missing; None when all are missing."""
    if not any(end in group for end in ends):
        return None
    return np.array([group.get(end, 0.0) for end in ends])


def _is_limb(group: Mapping[str, float]) -> bool:
    ends = {*POSE, *TWIST, "engaged", "grip"}
    return any(key.split(".")[0] in ends for key in group)


def _limb(group: Mapping[str, float]) -> LimbInput:
    place = _taken(group, POSE)
    fingers = [x for key, x in group.items() if key.startswith("grip.")]
    whole = group.get("grip")
    return LimbInput(
        pose=None if place is None else pin.SE3(pin.exp3(place[3:]), place[:3]),
        twist=_taken(group, TWIST),
        engaged=group.get("engaged", 1.0) > 0.5,
        grip=None if whole is None and not fingers else np.array(fingers or whole),
    )


def _number(name: str, value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError) as error:
        raise DeviceError(f"'{name}' is not a number: {value!r:.40}.") from error


DEGREES = math.pi / 180.0
"""Factor from degrees to rad, for `FromLeRobot`'s `scale`."""
