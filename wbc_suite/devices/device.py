"""The protocol of devices, and where they are found by name."""

import importlib
from collections.abc import Callable
from typing import Any, Protocol

from wbc_suite.devices.state import DeviceState
from wbc_suite.errors import ConfigError, DeviceError, UnknownNameError

__all__ = [
    "Device",
    "device_names",
    "find_device",
    "is_device",
    "make_device",
    "register_device",
]


class Device(Protocol):
    """Something that a person moves.

    Three methods are all there is; nothing has to be inherited.
    """

    def start(self) -> None:
        """Open it; raises DeviceError with what to do when it is not there."""
        ...

    def read(self) -> DeviceState:
        """Return the newest state at once; the last one when there is no newer."""
        ...

    def stop(self) -> None:
        """Close it; also after a start that failed."""
        ...


_BUILT_IN = {
    "dualsense": "wbc_suite.devices.gamepad:DualSense",
    "gamepad": "wbc_suite.devices.gamepad:Gamepad",
    "keyboard": "wbc_suite.devices.keyboard:Keyboard",
    "mjgui": "wbc_suite.devices.mjgui:MjGui",
    "spacemouse": "wbc_suite.devices.spacemouse:SpaceMouse",
    "stream": "wbc_suite.devices.stream:Stream",
}
"""Names of ours, and where they are: a device is imported when it is made."""

_OWN: dict[str, Callable[..., Device]] = {}


def register_device(name: str, make: Callable[..., Device]) -> None:
    """Make a device known to `make_device` and to `--device`, case ignored.

    Raises:
        ConfigError: If the name is taken.
    """
    if name.lower() in device_names():
        raise ConfigError(f"A device named '{name}' exists already.")
    _OWN[name.lower()] = make


def device_names() -> tuple[str, ...]:
    """Return the names that `make_device` knows."""
    return tuple(sorted({*_BUILT_IN, *_OWN}))


def find_device(name: str) -> Callable[..., Device]:
    """Return what makes a device of a name.

    Args:
        name: A known name, or `module:Class` for one that is found by importing it.

    Raises:
        UnknownNameError: If there is none of this name.
        DeviceError: If the module cannot be imported, or lacks the class.
    """
    key = name.lower()
    if key in _OWN:
        return _OWN[key]
    if ":" not in name and key not in _BUILT_IN:
        raise UnknownNameError("device", name, device_names())
    module, _, kind = _BUILT_IN.get(key, name).partition(":")
    try:
        return getattr(importlib.import_module(module), kind)
    except (ImportError, AttributeError) as error:
        raise DeviceError(
            f"Device '{name}': {error}. A device of your own is named module:Class, "
            "and its module must be importable (see PYTHONPATH)."
        ) from error


def is_device(name: str) -> bool:
    """Tell whether a name is that of a device, as opposed to a function's."""
    if name.lower() in device_names():
        return True
    try:
        found = find_device(name)
    except (DeviceError, UnknownNameError):
        return False
    return all(hasattr(found, method) for method in ("start", "read", "stop"))


def make_device(name: str, **options: Any) -> Device:
    """Make a device by its name; `start` opens it. For errors see `find_device`."""
    return find_device(name)(**options)
