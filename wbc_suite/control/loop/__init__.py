"""The control loop: laws as data, and the compiled step over them."""

from wbc_suite.control.loop.advance import advance, needed
from wbc_suite.control.loop.haste import bind_haste
from wbc_suite.control.loop.physics import bind_physics, physics_table
from wbc_suite.control.loop.sound import (
    LARGEST,
    SoundField,
    begins_sound,
    bind_sound,
    ends_sound,
)
from wbc_suite.control.loop.table import DRIVE, LAW, LawKind, Records, gather

__all__ = [
    "DRIVE",
    "LARGEST",
    "LAW",
    "LawKind",
    "Records",
    "SoundField",
    "advance",
    "begins_sound",
    "bind_haste",
    "bind_physics",
    "bind_sound",
    "ends_sound",
    "gather",
    "needed",
    "physics_table",
]
