"""The protocol of devices, and their registry by name."""

import time
from collections.abc import Callable, Iterable
from typing import Any, Protocol

from wbc_suite import logs
from wbc_suite.devices.state import DeviceState
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.registry import Registry

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


DEVICES: Registry[Callable[..., Device]] = Registry("device")
"""Classes of devices, or functions that make them, by name: for `--device`."""

register_device = DEVICES.register

for _name, _place in (
    ("dualsense", "gamepad:DualSense"),
    ("gamepad", "gamepad:Gamepad"),
    ("headset", "headset:Headset"),
    ("keyboard", "keyboard:Keyboard"),
    ("mjgui", "mjgui:MjGui"),
    ("spacemouse", "spacemouse:SpaceMouse"),
    ("stream", "stream:Stream"),
):
    register_device(_name, f"wbc_suite.devices.{_place}")


def is_device(name: str) -> bool:
    """Return whether a name is that of a device, or `module:Class` of one."""
    if name in DEVICES:
        return True
    try:
        found = DEVICES.find(name)
    except (ConfigError, UnknownNameError):
        return False
    return all(hasattr(found, method) for method in ("start", "read", "stop"))


def make_device(name: str, **options: Any) -> Device:
    """Create a device by its name, or `module:Class`; `start` opens it.

    Raises:
        UnknownNameError: If there is no device of this name.
        ConfigError: If the module cannot be imported, or lacks the class.
    """
    return DEVICES.find(name)(**options)
