"""Devices: robosuite's interface, and ours behind it."""

from wbc_suite.compat.robosuite.devices.device import Device, Keyboard, SpaceMouse

__all__ = ["Device", "Keyboard", "SpaceMouse"]
