"""Reading of HDF5 files that are not trusted.

HDF5 can point out of a file (external links, external and virtual storage), load code
(filters), declare more than the disk holds, and contain objects of any type. Links,
types and sizes are checked before anything is read.
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np
from numpy.typing import NDArray

from wbc_suite.errors import DatasetError, UnknownNameError

MAX_CHILDREN = 200_000  # of a group, or names of a mask
MAX_ATTRIBUTES = 1000  # of a group or dataset
MAX_NAME = 200  # characters
MAX_BYTES = 1 << 32  # of one column
MAX_TEXT = 1 << 26  # characters of an attribute
MAX_RATIO = 1100  # bytes that one stored byte can stand for; deflate's limit is 1032
FILTERS = {1: "gzip", 2: "shuffle", 3: "fletcher32", 32000: "lzf"}
"""By HDF5's numbers; others load libraries from a search path."""
HIGHEST_CHUNK = 1 << 20  # bytes; larger ones are unpacked for each slice
ERRORS = (
    *(OSError, ValueError, LookupError, TypeError, RuntimeError),
    *(AttributeError, OverflowError),
)
"""What h5py raises for damaged files."""
_PLAIN = re.compile(r"[^/\x00\ud800-\udfff]+\Z")  # also no bytes that are not UTF-8

Node = TypeVar("Node", bound=h5py.HLObject)


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn every error that a file can cause into a DatasetError that names it."""
    try:
        yield
    except UnknownNameError:
        raise
    except DatasetError as error:
        if str(path) in str(error):
            raise
        raise DatasetError(f"'{path}': {error}") from error
    except MemoryError as error:
        raise DatasetError(f"'{path}' declares more data than memory holds.") from error
    except ERRORS as error:
        reason = " ".join(str(error).split())[:160]
        raise DatasetError(
            f"'{path}' cannot be read: {reason}. It may be damaged: `wbc-suite verify` "
            "lists intact episodes, `wbc-suite repair` saves them."
        ) from error


def child_names(group: h5py.Group) -> list[str]:
    """Return the names in a group; raise DatasetError if there are too many."""
    count = group.id.get_num_objs()
    if count > MAX_CHILDREN:
        raise DatasetError(
            f"'{group.name}' has {count} entries; at most {MAX_CHILDREN} are read."
        )
    return list(group)


def child(group: h5py.Group, name: str, kind: type[Node]) -> Node | None:
    """Return a member of a group, or None; raise DatasetError for links."""
    if len(name) > MAX_NAME or not _PLAIN.match(name) or name in (".", ".."):
        raise DatasetError(f"'{name:.40}' is not a valid name in a dataset.")
    link = group.get(name, getlink=True)
    if link is None:
        return None
    if not isinstance(link, h5py.HardLink):
        raise DatasetError(
            f"'{group.name}/{name}' is a link ({type(link).__name__}); such "
            "links are not followed."
        )
    found = group[name]
    if not isinstance(found, kind):
        raise DatasetError(
            f"'{group.name}/{name}' is a {type(found).__name__}, not a {kind.__name__}."
        )
    return found


def attribute_names(node: h5py.Group | h5py.Dataset) -> list[str]:
    """Return the names of attributes; raise DatasetError if there are too many."""
    if len(node.attrs) > MAX_ATTRIBUTES:
        raise DatasetError(f"'{node.name}' has {len(node.attrs)} attributes.")
    return list(node.attrs)


def attribute(
    node: h5py.Group | h5py.Dataset, name: str
) -> str | int | float | bool | None:
    """Return a text or number, or None if missing; raise DatasetError for others."""
    if name not in node.attrs:
        return None
    held = node.attrs.get_id(name)
    if held.shape not in ((), (1,)) or held.get_storage_size() > MAX_TEXT:
        raise DatasetError(f"'{node.name}': '{name}' is not a single string or number.")
    if held.dtype.kind not in "fiubSO" or (
        held.dtype.kind == "O" and h5py.check_string_dtype(held.dtype) is None
    ):
        raise DatasetError(f"'{node.name}': '{name}' has the type {held.dtype}.")
    value: Any = node.attrs[name]
    if isinstance(value, np.ndarray):
        value = value.reshape(-1)[0]
    if isinstance(value, str):  # h5py keeps bytes that are not UTF-8 as surrogates
        value = value.encode("utf-8", errors="surrogateescape")
    if isinstance(value, bytes):
        value = value.decode("utf-8", errors="replace")
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, str) and len(value) > MAX_TEXT:
        raise DatasetError(f"'{node.name}': '{name}' is too long.")
    return value


class StoredColumn:
    """Numbers that are read slice by slice when they are used.

    `shape`, `dtype`, `ndim` and `nbytes` are NumPy's; `sliced` says whether a slice is
    read without reading much else. `path` is the file, for messages.

    Raises:
        DatasetError: If they are no numbers, too many, or not in this file; or later,
            if they cannot be read.
    """

    def __init__(self, dataset: h5py.Dataset, path: Path) -> None:
        _check_storage(dataset)
        if dataset.dtype.kind not in "fiub" or dataset.dtype.itemsize > 8:
            raise DatasetError(f"'{dataset.name}' holds {dataset.dtype}, not numbers.")
        self._dataset, self._path = dataset, path
        self.shape, self.dtype, self.ndim = dataset.shape, dataset.dtype, dataset.ndim
        self.nbytes = int(np.prod(self.shape, dtype=object)) * self.dtype.itemsize
        row = self.nbytes // max(self.shape[0], 1)
        high = dataset.chunks[0] if dataset.chunks else 1
        self.sliced = row > 0 and (high == 1 or high * row <= HIGHEST_CHUNK)

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, rows: slice) -> NDArray[Any]:
        with reading(self._path):
            return np.asarray(self._dataset[rows])


def read_names(dataset: h5py.Dataset) -> list[str]:
    """Return a list of short texts, as filter keys have it, or raise DatasetError."""
    _check_storage(dataset)
    text = h5py.check_string_dtype(dataset.dtype)
    if text is None or dataset.ndim != 1 or len(dataset) > MAX_CHILDREN:
        raise DatasetError(f"'{dataset.name}' is not a list of names.")
    if text.length is not None and text.length > MAX_NAME:
        raise DatasetError(f"'{dataset.name}' has names of {text.length} characters.")
    names = []
    for name in (bytes(dataset[k]) for k in range(len(dataset))):
        if len(name) > MAX_NAME:
            raise DatasetError(f"'{dataset.name}' has a name of {len(name)} letters.")
        names.append(name.decode("utf-8", errors="replace"))
    return names


def _check_storage(dataset: h5py.Dataset) -> None:
    if dataset.is_virtual or dataset.external:
        raise DatasetError(f"'{dataset.name}' is stored outside of the file.")
    plan = dataset.id.get_create_plist()
    filters = [plan.get_filter(k)[0] for k in range(plan.get_nfilters())]
    unknown = [number for number in filters if number not in FILTERS]
    if unknown:
        raise DatasetError(
            f"'{dataset.name}' needs HDF5's filter {unknown[0]}; allowed are "
            f"{', '.join(FILTERS.values())}."
        )
    claimed = int(np.prod(dataset.shape, dtype=object) or 0) * dataset.dtype.itemsize
    stored = dataset.id.get_storage_size()
    ratio = MAX_RATIO if set(filters) & {1, 32000} else 1
    chunk = int(np.prod(dataset.chunks or (1,), dtype=object)) * dataset.dtype.itemsize
    if claimed > MAX_BYTES or chunk > MAX_BYTES or claimed > stored * ratio:
        raise DatasetError(
            f"'{dataset.name}' claims {claimed} bytes in a shape of {dataset.shape}, "
            f"but only {stored} are stored."
        )
