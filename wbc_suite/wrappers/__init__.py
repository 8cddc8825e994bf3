"""Wrappers around environments; frame stacks and the like are Gymnasium's own."""

from wbc_suite.wrappers.disturbance import Disturbance
from wbc_suite.wrappers.flat import Flat
from wbc_suite.wrappers.goals import Goals
from wbc_suite.wrappers.indicators import Indicators
from wbc_suite.wrappers.recordings import DataCollection, DemoStart, Playback

__all__ = [
    "DataCollection",
    "DemoStart",
    "Disturbance",
    "Flat",
    "Goals",
    "Indicators",
    "Playback",
]
