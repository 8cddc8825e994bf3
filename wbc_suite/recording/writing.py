"""Episodes in robomimic's HDF5 layout.

Layout: https://robomimic.github.io/docs/datasets/overview.html. What it does not know
of is added beside it: readers of the layout do not look there.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from wbc_suite.errors import DatasetError
from wbc_suite.recording.episode import Column, Episode, Fact, fingerprint, pieces
from wbc_suite.recording.files import check_folder, replace_file
from wbc_suite.recording.late_errors import late_errors

__all__ = ["SCHEMA_VERSION", "plain_bytes", "write_dataset"]

SCHEMA_VERSION = 1
PICTURE_BYTES = 10_000
"""Rows of bytes of at least this size are pictures, and are compressed."""


def plain_bytes(episode: Episode) -> int:
    """Return how many bytes of an episode are stored as they are."""
    columns = episode.columns.values()
    return sum(column.nbytes for column in columns if not _compression(column))


def write_dataset(
    path: Path,
    episodes: Iterable[Episode],
    header: Mapping[str, Fact],
    *,
    masks: Mapping[str, Sequence[str]] | None = None,
    needed: int = 0,
) -> None:
    """Write a dataset in place of what is there, at once.

    Args:
        path: File to write.
        episodes: Read one by one; a piece of a column at a time is copied.
        header: Attributes of `data`, such as `env_args`.
        masks: Names of episodes by filter key.
        needed: Bytes that it will take, if known.

    Raises:
        DatasetError: If it cannot be written; then an old file is as it was.
    """
    check_folder(path.parent, needed)

    def write(aside: Path) -> None:
        with late_errors(aside) as disk, h5py.File(disk, "w") as file:
            _write(file, episodes, header, masks or {})

    replace_file(path, write)


def _write(
    file: h5py.File,
    episodes: Iterable[Episode],
    header: Mapping[str, Fact],
    masks: Mapping[str, Sequence[str]],
) -> None:
    data = file.create_group("data")
    for name, value in header.items():
        data.attrs[name] = value
    data.attrs["schema_version"] = SCHEMA_VERSION
    total = 0
    for episode in episodes:
        if episode.name in data:
            raise DatasetError(f"There are two episodes '{episode.name}'.")
        total += episode.length
        _write_episode(data.create_group(episode.name), episode)
    data.attrs["total"] = total
    for key, names in masks.items():
        file.create_dataset(f"mask/{key}", data=np.array(names, dtype="S"))


def _write_episode(group: h5py.Group, episode: Episode) -> None:
    for name, column in episode.columns.items():
        stored = group.create_dataset(
            name, column.shape, column.dtype, **_compression(column)
        )
        for begin, piece in pieces(column):
            stored[begin : begin + len(piece)] = piece
    if episode.final_state is not None:
        group.create_dataset("final_state", data=episode.final_state)
    for name, fact in episode.facts.items():
        group.attrs[name] = fact
    group.attrs["num_samples"] = episode.length
    group.attrs["sha256"] = fingerprint(episode.columns, episode.final_state)


def _compression(column: Column) -> dict[str, Any]:
    if column.dtype != np.uint8 or column[:1].nbytes < PICTURE_BYTES:
        return {}
    chunk = (1, *column.shape[1:])
    return {"chunks": chunk, "compression": "gzip", "compression_opts": 1}
