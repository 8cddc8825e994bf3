"""From a person's hand to a target: the stages between a device and a controller."""

from wbc_suite.devices.clutch import Clutch

__all__ = ["Clutch"]
