"""Episodes in robomimic's HDF5 layout.

Layout: https://robomimic.github.io/docs/datasets/overview.html. What it does not know
of is added beside it: readers of the layout do not look there.
"""

import io
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from wbc_suite.errors import DatasetError
from wbc_suite.recording.episode import Column, Episode, Fact, fingerprint
from wbc_suite.recording.files import check_folder, replace_file

__all__ = ["SCHEMA_VERSION", "episode_bytes", "write_dataset"]

SCHEMA_VERSION = 1
PICTURE_BYTES = 10_000
"""Rows of bytes of at least this size are pictures, and are compressed."""


def episode_bytes(episode: Episode, header: Mapping[str, Fact]) -> bytes:
    """Return a file with one episode; HDF5 never sees the disk, so never a full one."""
    memory = io.BytesIO()
    with h5py.File(memory, "w") as file:
        _write(file, [episode], header, {})
    return memory.getvalue()


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
        episodes: Read one by one, so that one at a time is in memory.
        header: Attributes of `data`, such as `env_args`.
        masks: Names of episodes by filter key.
        needed: Bytes that it will take, if known.

    Raises:
        DatasetError: If it cannot be written; then an old file is as it was.
    """
    check_folder(path.parent, needed)

    def write(aside: Path) -> None:
        try:
            with h5py.File(aside, "w") as file:
                _write(file, episodes, header, masks or {})
        except RuntimeError as error:  # HDF5's word for a full disk at closing
            raise OSError(str(error)[:200]) from error

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
        group.create_dataset(name, data=column, **_compression(column))
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
