"""Rows of numbers that grow on disk, so that a long episode costs no memory."""

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wbc_suite.errors import DatasetError

__all__ = ["RowLog"]

BLOCK_BYTES = 1 << 20
"""Rows are written when so many bytes have come together."""
MAX_ROWS = 512
"""... or so many rows."""


class RowLog:
    """Appends rows of named numbers; the first row says their types and shapes.

    Args:
        folder: Where the rows that no longer fit into memory go. Their file has no
            name, so that nothing is left of it whatever happens.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._file: Any = None
        self._block: NDArray[Any] = np.empty(0)
        self._fields: list[tuple[str, NDArray[Any]]] = []
        self._filled = self._written = 0

    def __len__(self) -> int:
        """Return the number of rows."""
        return self._written + self._filled

    def append(self, row: Mapping[str, Any]) -> None:
        """Add a row.

        Raises:
            DatasetError: If a name is missing, a shape differs from the first row's,
                or the disk is full.
        """
        if not self._fields:
            self._begin(row)
        at, name = self._filled, ""
        try:
            for name, field in self._fields:
                field[at] = row[name]
        except (KeyError, ValueError) as error:
            raise DatasetError(
                f"A step's '{name}' differs from the first step's: {error}."
            ) from error
        self._filled += 1
        if self._filled == len(self._block):
            self._spill()

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return all rows by name, each with a row per entry.

        They are apart from what is appended later; those on disk are read from there
        when they are used, and take no memory until then.
        """
        if self._file is None:
            rows = self._block[: self._filled].copy()
        else:
            self._spill()
            rows = np.memmap(self._file, dtype=self._block.dtype, mode="c")
        return {name: rows[name] for name, _ in self._fields}

    def close(self) -> None:
        """Forget everything."""
        if self._file is not None:
            self._file.close()
        self._file, self._fields, self._filled, self._written = None, [], 0, 0
        self._block = np.empty(0)

    def _begin(self, row: Mapping[str, Any]) -> None:
        arrays = {name: np.asarray(value) for name, value in row.items()}
        kind = np.dtype([(n, a.dtype, a.shape) for n, a in arrays.items()])
        rows = int(np.clip(BLOCK_BYTES // max(kind.itemsize, 1), 1, MAX_ROWS))
        self._block = np.zeros(rows, dtype=kind)
        self._fields = [(name, self._block[name]) for name in arrays]

    def _spill(self) -> None:
        """Move the block to the file."""
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile(dir=self._folder, buffering=0)  # noqa: SIM115 - closed by close()
            rest = memoryview(self._block[: self._filled].tobytes())
            while rest:  # a disk that fills up takes a part, and says so only then
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            raise DatasetError(
                f"'{self._folder}' cannot be written: {error.strerror}. The episode in "
                "progress is lost; finished ones are safe."
            ) from error
        self._written += self._filled
        self._filled = 0
