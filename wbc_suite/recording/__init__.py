"""Demonstrations: recording, storage, replay and conversion.

Functions raise DatasetError for what cannot be read, written or replayed. Modules that
need robots are loaded when they are first used.
"""

import importlib
from typing import TYPE_CHECKING, Any

from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.episode import Episode
from wbc_suite.recording.episode_store import Store

if TYPE_CHECKING:
    from wbc_suite.recording.env_source import EnvSource, rebuild
    from wbc_suite.recording.recorder import Recorder

_HOME = {"EnvSource": "env_source", "Recorder": "recorder", "rebuild": "env_source"}

__all__ = ["Dataset", "EnvSource", "Episode", "Recorder", "Store", "rebuild"]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(importlib.import_module(f"{__name__}.{_HOME[name]}"), name)
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
