"""Episodes written in robomimic's HDF5 layout.

Layout: https://robomimic.github.io/docs/datasets/overview.html. Attributes and columns
that it does not define are added beside it; readers of the layout ignore them.
"""

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from wbc_suite.atomic_files import check_folder, replace_file
from wbc_suite.errors import DatasetError
from wbc_suite.recording.episode import Column, Episode, Fact, fingerprint, pieces

SCHEMA_VERSION = 1  # of the attributes and columns that are added
PICTURE_BYTES = 10_000  # rows of at least so many are pictures, and are compressed
STATES = "states"  # are compressed too: most of their numbers seldom change
CHUNK_BYTES = 1 << 16  # of `states`, which is compressed chunk by chunk


def uncompressed_bytes(episode: Episode) -> int:
    """Return how many bytes of an episode are stored without compression."""
    columns = episode.columns.items()
    return sum(column.nbytes for name, column in columns if not _storage(name, column))


def write_dataset(
    path: Path,
    episodes: Iterable[Episode],
    header: Mapping[str, Fact],
    *,
    masks: Mapping[str, Sequence[str]] | None = None,
    needed: int = 0,
) -> None:
    """Write a dataset; it replaces an old file atomically, or stays as it was.

    Episodes are read one by one, with a piece of a column in memory at a time. `header`
    has the attributes of `data`, `masks` the names of episodes by filter key. `needed`
    bytes must fit on the disk.

    Raises:
        DatasetError: If it cannot be written.
    """
    check_folder(path.parent, needed)

    def write(temporary: Path) -> None:
        with open_late_errors(temporary) as disk, h5py.File(disk, "w") as file:
            data, total = file.create_group("data"), 0
            data.attrs.update(header)
            data.attrs["schema_version"] = SCHEMA_VERSION
            for episode in episodes:
                if episode.name in data:
                    raise DatasetError(f"There are two episodes '{episode.name}'.")
                total += episode.length
                _write_episode(data.create_group(episode.name), episode)
            data.attrs["total"] = total
            for key, names in (masks or {}).items():
                file.create_dataset(f"mask/{key}", data=np.array(names, dtype="S"))

    replace_file(path, write)


def _write_episode(group: h5py.Group, episode: Episode) -> None:
    for name, column in episode.columns.items():
        stored = group.create_dataset(
            name, column.shape, column.dtype, **_storage(name, column)
        )
        for begin, piece in pieces(column):
            stored[begin : begin + len(piece)] = piece
    if episode.final_state is not None:
        group.create_dataset("final_state", data=episode.final_state)
    group.attrs.update(episode.facts)
    group.attrs["num_samples"] = episode.length
    group.attrs["sha256"] = fingerprint(episode.columns, episode.final_state)


def _storage(name: str, column: Column) -> dict[str, Any]:
    """Return how a column is compressed; nothing where it is not."""
    row, high = column[:1].nbytes, 1
    if name == STATES and row:
        high = min(max(1, CHUNK_BYTES // row), len(column))
    elif column.dtype != np.uint8 or row < PICTURE_BYTES:
        return {}
    chunk = (high, *column.shape[1:])
    shuffled = {"shuffle": True} if name == STATES else {}
    return {"chunks": chunk, "compression": "gzip", "compression_opts": 1} | shuffled


@contextmanager
def open_late_errors(path: Path) -> Iterator[Any]:
    """Open a new file for h5py that reports write errors when it is closed.

    HDF5 crashes if a write fails on a full disk. Here nothing more is written after
    the first OSError; it is raised at the end, and the file must not be used.
    """
    file = _LateErrorFile(os.open(path, os.O_RDWR | os.O_CREAT | os.O_TRUNC, 0o666))
    try:
        yield file
    finally:
        os.close(file.handle)
        if file.error is not None:
            raise file.error


class _LateErrorFile:
    """The methods that h5py's driver for Python file objects calls."""

    def __init__(self, handle: int) -> None:
        self.handle = handle
        self.error: OSError | None = None
        self._at = self._end = 0

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        starts = {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self._end}
        self._at = starts[whence] + offset
        return self._at

    def tell(self) -> int:
        return self._at

    def read(self, size: int) -> bytes:
        found = os.pread(self.handle, size, self._at).ljust(size, b"\0")
        self._at += size
        return found

    def write(self, content: Any) -> int:
        rest = memoryview(content).cast("B")
        size = len(rest)
        try:
            while rest and self.error is None:  # a full disk takes a part
                written = os.pwrite(self.handle, rest, self._at)
                rest, self._at = rest[written:], self._at + written
        except OSError as error:
            self.error = error
        self._at += len(rest)
        self._end = max(self._end, self._at)
        return size

    def truncate(self, size: int | None = None) -> int:
        self._end = self._at if size is None else size
        try:
            if self.error is None:
                os.ftruncate(self.handle, self._end)
        except OSError as error:
            self.error = error
        return self._end

    def flush(self) -> None:
        """Do nothing: `replace_file` syncs the file."""
