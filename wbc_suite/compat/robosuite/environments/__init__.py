"""Environments: those of the catalogue, classes of users, and those of datasets."""

import json
from pathlib import Path
from typing import Any

from wbc_suite.compat.robosuite.conventions import OURS
from wbc_suite.compat.robosuite.environments import manipulation  # noqa: F401 - registers
from wbc_suite.compat.robosuite.environments.base import make
from wbc_suite.compat.robosuite.forwarding import names_of
from wbc_suite.errors import DatasetError
from wbc_suite.recording.env_source import PACKAGE

_find, __dir__ = names_of(__name__, "base")


def __getattr__(name: str) -> Any:
    return _find(name)


def make_from_env_args(env_args: str | dict[str, Any]) -> Any:
    """Make the environment of a dataset's `env_args`, JSON text or a dictionary."""
    data = json.loads(env_args) if isinstance(env_args, str) else env_args
    if "env_name" not in data:
        raise DatasetError("env_args has no 'env_name'.")
    arguments = dict(data.get("env_kwargs", {}))
    if data.get("package") == PACKAGE:
        arguments.setdefault("conventions", OURS)
    return make(data["env_name"], **arguments)


def make_from_dataset(path: str | Path) -> Any:
    """Make the environment of an HDF5 dataset, by its attribute `env_args`."""
    import h5py

    from wbc_suite.recording import hdf5_reader
    from wbc_suite.recording.hdf5_check import open_safely

    with open_safely(Path(path)) as file, hdf5_reader.reading(Path(path)):
        data = hdf5_reader.child(file, "data", h5py.Group)
        env_args = None if data is None else hdf5_reader.attribute(data, "env_args")
    if env_args is None:
        raise DatasetError(f"{path}: the file has no env_args.")
    return make_from_env_args(str(env_args))
