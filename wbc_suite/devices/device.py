"""The protocol of devices, and their registry by name."""

import importlib
import time
from collections.abc import Callable, Iterable
from typing import Any, Protocol

from wbc_suite import logs
from wbc_suite.devices.state import DeviceState
from wbc_suite.errors import ConfigError, DeviceError, UnknownNameError

log = logs.logger(__name__)


class Device(Protocol):
    """An input device; classes need no base, only these three methods."""

    def start(self) -> None:
        """Open the device; raises DeviceError if it is not available."""
        ...

    def read(self) -> DeviceState:
        """Return the newest state without waiting."""
        ...

    def stop(self) -> None:
        """Close the device; also called after a failed start."""
        ...


class Scripted:
    """A device without hardware: one given state per read, then the last one again.

    The states may be an endless generator.
    """

    def __init__(self, states: Iterable[DeviceState]) -> None:
        self._states = iter(states)
        self._last = DeviceState(time=0.0)

    def start(self) -> None:
        """Do nothing."""

    def read(self) -> DeviceState:
        """Return the next state."""
        self._last = next(self._states, self._last)
        return self._last

    def stop(self) -> None:
        """Do nothing."""


class ButtonReader:
    """Read a device, or none; an error of the device does not stop its reader.

    Attributes:
        faults: Why the last read failed; empty if it did not.
    """

    def __init__(self, device: Device | None) -> None:
        self._device, self._last = device, DeviceState(time=0.0)
        self.faults: tuple[str, ...] = ()

    def read(self) -> tuple[DeviceState, frozenset[str]]:
        """Return the state, and the buttons that were not pressed before.

        If the device fails it is the last state.
        """
        before = self._last.buttons
        if self._device is None:
            return DeviceState(time=time.perf_counter()), frozenset()
        try:
            self._last, self.faults = self._device.read(), ()
            return self._last, self._last.buttons - before
        except Exception as error:
            if not self.faults:
                log.exception("A device failed")
            self.faults = (f"device error: {error}",)
        return self._last, frozenset()


_DEVICES: dict[str, str | Callable[..., Device]] = {
    "dualsense": "wbc_suite.devices.gamepad:DualSense",
    "gamepad": "wbc_suite.devices.gamepad:Gamepad",
    "headset": "wbc_suite.devices.headset:Headset",
    "keyboard": "wbc_suite.devices.keyboard:Keyboard",
    "mjgui": "wbc_suite.devices.mjgui:MjGui",
    "spacemouse": "wbc_suite.devices.spacemouse:SpaceMouse",
    "stream": "wbc_suite.devices.stream:Stream",
}
"""Class or factory by name; those of a text are imported when one is created."""


def register_device(name: str, make: Callable[..., Device]) -> None:
    """Register a device for `make_device` and `--device`; case is ignored.

    Raises:
        ConfigError: If the name is taken.
    """
    if name.lower() in device_names():
        raise ConfigError(f"A device named '{name}' exists already.")
    _DEVICES[name.lower()] = make


def device_names() -> tuple[str, ...]:
    """Return the names of all devices."""
    return tuple(sorted(_DEVICES))


def find_device(name: str) -> Callable[..., Device]:
    """Return the class or factory of a device by its name, or of `module:Class`.

    Raises:
        UnknownNameError: If there is no device of this name.
        DeviceError: If the module cannot be imported, or lacks the class.
    """
    found = _DEVICES.get(name.lower(), name)
    if callable(found):
        return found
    module, colon, kind = found.partition(":")
    if not colon:
        raise UnknownNameError("device", name, device_names())
    try:
        return getattr(importlib.import_module(module), kind)
    except (ImportError, AttributeError) as error:
        raise DeviceError(
            f"Device '{name}': {error}. A device of your own is named module:Class, "
            "and its module must be importable (see PYTHONPATH)."
        ) from error


def is_device(name: str) -> bool:
    """Return whether a name is that of a device."""
    if name.lower() in device_names():
        return True
    try:
        found = find_device(name)
    except (DeviceError, UnknownNameError):
        return False
    return all(hasattr(found, method) for method in ("start", "read", "stop"))


def make_device(name: str, **options: Any) -> Device:
    """Create a device by its name; `start` opens it. For errors see `find_device`."""
    return find_device(name)(**options)
