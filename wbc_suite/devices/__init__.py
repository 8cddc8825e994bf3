"""Input devices, and the pipeline from their states to actions."""

from wbc_suite.devices.device import (
    DEVICES,
    Device,
    Scripted,
    is_device,
    make_device,
    register_device,
)
from wbc_suite.devices.drive_loop import drive
from wbc_suite.devices.pipeline import Clutch, Pipeline, PipelineConfig
from wbc_suite.devices.state import DeviceState, LimbInput

__all__ = [
    "DEVICES",
    "Clutch",
    "Device",
    "DeviceState",
    "LimbInput",
    "Pipeline",
    "PipelineConfig",
    "Scripted",
    "drive",
    "is_device",
    "make_device",
    "register_device",
]
