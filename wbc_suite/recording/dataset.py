"""Reading of datasets: a file, and finished episodes in files beside it."""

import re
from collections.abc import Container, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Self, cast

import h5py
import numpy as np

from wbc_suite.errors import DatasetError, UnknownNameError
from wbc_suite.recording import hdf5_reader
from wbc_suite.recording.episode import Column, Episode, Fact, fingerprint, pieces
from wbc_suite.recording.hdf5_check import check_files, open_safely

_DEMO = re.compile(r"demo_?(\d{1,9})\Z")
_DIMENSIONS = {"states": 2, "actions": 2, "rewards": 1, "dones": 1}


def parts_folder(path: Path) -> Path:
    """Return the folder of episodes that are not merged into the file yet."""
    return path.with_name(path.name + ".parts")


def part_files(path: Path) -> list[Path]:
    """Return the files of finished episodes beside a dataset, in their order."""
    return sorted(parts_folder(path).glob("episode_*.hdf5"))


def dataset_files(path: Path) -> list[Path]:
    """Return a dataset's file, unless only the files beside it exist, and these."""
    parts = part_files(path)
    return [path, *parts] if path.exists() or not parts else parts


class Dataset:
    """Episodes of a file in robomimic's layout, robosuite's raw one, or our own.

    The file is not trusted: nothing in it is executed, links out of it are not
    followed, sizes are checked before memory is allocated. An interrupted recording
    reads as if it had been closed.

    With `alone`, finished episodes beside the file are left out. With `checked`, this
    process has read or written the files before; all others are read by a child process
    first, see `check_files`.

    Raises:
        DatasetError: If it, or later an episode, cannot be read.
        UnknownNameError: Later, if there is no episode of a name.

    Attributes:
        header: Attributes of `data`: `env_args`, `schema_version`, ...
        names: Names of the episodes, in their order.
        masks: Names of episodes by filter key.
    """

    def __init__(
        self, path: str | Path, *, alone: bool = False, checked: bool = False
    ) -> None:
        self.path = Path(path)
        files = [self.path] if alone else dataset_files(self.path)
        self._open = ExitStack()
        self._groups: dict[str, tuple[Path, h5py.Group]] = {}
        self._uids: set[Fact] = set()
        self.header: dict[str, Fact] = {}
        self.masks: dict[str, list[str]] = {}
        if not checked:
            check_files(files)
        try:
            for file in files:
                self._add(file)
        except DatasetError:
            self.close()
            raise
        self.names = tuple(sorted(self._groups, key=_number))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def __len__(self) -> int:
        return len(self.names)

    def __iter__(self) -> Iterator[Episode]:
        return (self.episode(name) for name in self.names)

    def close(self) -> None:
        """Close the files."""
        self._open.close()

    def facts(self, name: str) -> Mapping[str, Fact]:
        """Return the facts of an episode, without reading its columns."""
        path, group = self._find(name)
        with hdf5_reader.reading(path):
            return _facts(group)

    def length(self, name: str) -> int:
        """Return an episode's number of actions, without reading it."""
        path, group = self._find(name)
        with hdf5_reader.reading(path):
            return _dataset(group, "actions").shape[0]

    def column(self, name: str, key: str) -> Column:
        """Return one column of an episode, or raise UnknownNameError."""
        path, group = self._find(name)
        with hdf5_reader.reading(path):
            columns = _columns(group)
            if key not in columns:
                raise UnknownNameError("column", key, tuple(columns))
            return hdf5_reader.StoredColumn(columns[key], path)[:]

    def streamed(self) -> Iterator[Episode]:
        """Read episodes one by one, and slices of columns when they are used."""
        return (self.episode(name, later=True) for name in self.names)

    def episode(self, name: str, *, later: bool = False) -> Episode:
        """Read an episode; with `later`, columns are read when they are used.

        Raises:
            DatasetError: If columns differ in length, or numbers are not those written.
        """
        path, group = self._find(name)
        with hdf5_reader.reading(path):
            stored = {
                k: hdf5_reader.StoredColumn(d, path) for k, d in _columns(group).items()
            }
            columns = {
                k: cast("Column", column) if later and column.sliced else column[:]
                for k, column in stored.items()
            }
            last = hdf5_reader.child(group, "final_state", h5py.Dataset)
            final = None if last is None else hdf5_reader.StoredColumn(last, path)[:]
            _check_columns(name, columns)
            facts = _facts(group)
            written = facts.pop("sha256", None)
            claimed = facts.pop("num_samples", len(columns["actions"]))
            if claimed != len(columns["actions"]):
                raise DatasetError(
                    f"'{name}' declares {claimed} samples, but has "
                    f"{len(columns['actions'])} actions."
                )
            if written is not None and written != fingerprint(columns, final):
                raise DatasetError(f"'{name}' is damaged: its checksum does not match.")
        return Episode(name=name, columns=columns, facts=facts, final_state=final)

    def _find(self, name: str) -> tuple[Path, h5py.Group]:
        if name not in self._groups:
            raise UnknownNameError("episode", name, self.names)
        return self._groups[name]

    def _add(self, path: Path) -> None:
        file = self._open.enter_context(open_safely(path, checked=True))
        with hdf5_reader.reading(path):
            data = hdf5_reader.child(file, "data", h5py.Group)
            if data is None:
                raise DatasetError("it has no group 'data', so it holds no episodes.")
            earlier = set(self._uids)
            for name in filter(_DEMO.match, hdf5_reader.child_names(data)):
                group = hdf5_reader.child(data, name, h5py.Group)
                uid = None if group is None else _facts(group).get("uid")
                if group is None or uid in earlier:
                    continue
                self._groups[free_name(name, self._groups)] = path, group
                if uid is not None:
                    self._uids.add(uid)
            if not self.header:
                self.header = _facts(data)
                self.header.pop("total", None)
            self.masks |= _masks(file)


def free_name(name: str, taken: Container[str]) -> str:
    """Return an episode's name, or the next free one if it is taken."""
    while name in taken:
        name = f"demo_{_number(name) + 1}"
    return name


def _number(name: str) -> int:
    return int(name.removeprefix("demo").removeprefix("_"))


def _facts(group: h5py.Group) -> dict[str, Fact]:
    found = {
        name: hdf5_reader.attribute(group, name)
        for name in hdf5_reader.attribute_names(group)
    }
    return {name: value for name, value in found.items() if value is not None}


def _masks(file: h5py.File) -> dict[str, list[str]]:
    group = hdf5_reader.child(file, "mask", h5py.Group)
    if group is None:
        return {}
    found = {
        n: hdf5_reader.child(group, n, h5py.Dataset)
        for n in hdf5_reader.child_names(group)
    }
    return {n: hdf5_reader.read_names(d) for n, d in found.items() if d is not None}


def _dataset(group: h5py.Group, name: str) -> h5py.Dataset:
    found = hdf5_reader.child(group, name, h5py.Dataset)
    if found is None or found.ndim < 1:
        raise DatasetError(f"'{group.name}' has no '{name}'.")
    return found


def _columns(group: h5py.Group) -> dict[str, h5py.Dataset]:
    """Return the datasets with a row per action, by name."""
    _dataset(group, "actions")
    found: dict[str, h5py.Dataset] = {}
    for name in hdf5_reader.child_names(group):
        if name == "final_state":
            continue
        if name in ("obs", "next_obs"):
            inner = hdf5_reader.child(group, name, h5py.Group)
            assert inner is not None, "its name was listed"
            for key in hdf5_reader.child_names(inner):
                found[f"{name}/{key}"] = _dataset(inner, key)
        elif isinstance(hdf5_reader.child(group, name, h5py.HLObject), h5py.Dataset):
            found[name] = _dataset(group, name)
    return found


def _check_columns(name: str, columns: Mapping[str, Column]) -> None:
    length = len(columns["actions"])
    for key, column in columns.items():
        if len(column) != length:
            raise DatasetError(
                f"'{name}': '{key}' has {len(column)} rows for {length} actions."
            )
    for key, dimensions in _DIMENSIONS.items():
        if key in columns and columns[key].ndim != dimensions:
            raise DatasetError(f"'{name}': '{key}' has the shape {columns[key].shape}.")
    for key in ("states", "actions"):
        parts = pieces(columns[key]) if key in columns else ()
        if not all(np.isfinite(part).all() for _, part in parts):
            raise DatasetError(f"'{name}': '{key}' holds numbers that are not finite.")
