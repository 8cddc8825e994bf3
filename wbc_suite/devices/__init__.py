"""From a person's hand to an action: devices, and the pipeline behind them."""

from wbc_suite.devices.device import (
    Device,
    device_names,
    find_device,
    is_device,
    make_device,
    register_device,
)
from wbc_suite.devices.driving import drive
from wbc_suite.devices.pipeline import Clutch, Pipeline, PipelineConfig
from wbc_suite.devices.scripted import Scripted
from wbc_suite.devices.state import DeviceState, LimbInput

__all__ = [
    "Clutch",
    "Device",
    "DeviceState",
    "LimbInput",
    "Pipeline",
    "PipelineConfig",
    "Scripted",
    "device_names",
    "drive",
    "find_device",
    "is_device",
    "make_device",
    "register_device",
]
