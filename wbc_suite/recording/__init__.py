"""Demonstrations: recorded, kept safe, played again, and read by others.

What only reads and writes files loads at once; what needs robots when first used.
"""

import importlib
from typing import TYPE_CHECKING, Any

from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.episode import Episode
from wbc_suite.recording.store import Store

if TYPE_CHECKING:
    from wbc_suite.recording.recorder import Recorder
    from wbc_suite.recording.source import EnvSource, rebuild

_HOME = {
    "EnvSource": "wbc_suite.recording.source",
    "Recorder": "wbc_suite.recording.recorder",
    "rebuild": "wbc_suite.recording.source",
}

__all__ = ["Dataset", "EnvSource", "Episode", "Recorder", "Store", "rebuild"]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(importlib.import_module(_HOME[name]), name)
    raise AttributeError(f"module 'wbc_suite.recording' has no attribute '{name}'")
