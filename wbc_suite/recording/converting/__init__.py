"""Recordings in the layouts of other projects."""

from wbc_suite.recording.converting.conversion import LAYOUTS, convert, register_layout
from wbc_suite.recording.converting.layout import Layout, Piece, Progress

__all__ = ["LAYOUTS", "Layout", "Piece", "Progress", "convert", "register_layout"]
