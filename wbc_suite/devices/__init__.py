"""Input devices, and the pipeline from their states to actions."""

from wbc_suite.devices.device import (
    Device,
    Scripted,
    device_names,
    find_device,
    is_device,
    make_device,
    register_device,
)
from wbc_suite.devices.drive_loop import drive
from wbc_suite.devices.pipeline import Clutch, Pipeline, PipelineConfig
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
