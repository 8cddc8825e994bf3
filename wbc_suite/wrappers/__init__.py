"""Wrappers around environments; frame stacks and the like are Gymnasium's own."""

from wbc_suite.wrappers.collection import DataCollection
from wbc_suite.wrappers.demo_start import DemoStart
from wbc_suite.wrappers.flat import Flat
from wbc_suite.wrappers.indicators import Indicators
from wbc_suite.wrappers.playback import Playback

__all__ = ["DataCollection", "DemoStart", "Flat", "Indicators", "Playback"]
