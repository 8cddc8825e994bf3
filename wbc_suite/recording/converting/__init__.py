"""Recordings in the layouts of other projects."""

from wbc_suite.recording.converting.conversion import LAYOUTS, convert

__all__ = ["LAYOUTS", "convert"]
