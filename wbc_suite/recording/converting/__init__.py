"""Recordings in the layouts of others."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeAlias

from wbc_suite.errors import UnknownNameError
from wbc_suite.recording.converting.lerobot import write_lerobot
from wbc_suite.recording.converting.mcap import write_mcap
from wbc_suite.recording.converting.minari import write_minari
from wbc_suite.recording.converting.plain import write_npz, write_robomimic
from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.episode import Episode

__all__ = ["LAYOUTS", "convert"]

Tell: TypeAlias = Callable[[Episode], None]

LAYOUTS: Mapping[str, Callable[[Dataset, Path, Tell], Path]] = {
    "robomimic": write_robomimic,
    "npz": write_npz,
    "lerobot": write_lerobot,
    "minari": write_minari,
    "mcap": write_mcap,
}
"""What writes a dataset to a path, by the layout's name."""


def convert(
    source: str | Path, out: str | Path, layout: str, tell: Tell = lambda _: None
) -> Path:
    """Write a recording in another layout; what was written is returned.

    Args:
        source: The recording.
        out: File, or folder, to write.
        layout: One of `LAYOUTS`.
        tell: Called with every episode when it is written.

    Raises:
        UnknownNameError: If there is no such layout.
        DatasetError: If the recording cannot be read, a package is missing, or the
            path cannot be written.
    """
    if layout not in LAYOUTS:
        raise UnknownNameError("layout", layout, LAYOUTS)
    with Dataset(source) as dataset:
        return LAYOUTS[layout](dataset, Path(out), tell)
