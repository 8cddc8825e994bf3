"""The stages between a device and a controller."""

from wbc_suite.devices.pipeline.clutch import Clutch
from wbc_suite.devices.pipeline.config import PipelineConfig
from wbc_suite.devices.pipeline.pipeline import Pipeline

__all__ = ["Clutch", "Pipeline", "PipelineConfig"]
