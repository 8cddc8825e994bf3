"""Rows that grow on disk, so that a long episode costs no memory."""

import mmap
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wbc_suite.errors import DatasetError

__all__ = ["RowLog"]

BLOCK_BYTES = 1 << 16
"""Rows are written when so many bytes have come together."""
MAX_ROWS = 512
"""... or so many rows."""


class RowLog:
    """Rows of one structured type, written into a block that goes to disk when full.

    The row at `at` is in progress, and so may be the one after it: there is always room
    for both. `advance` says that the first is complete.

    Args:
        folder: Where the rows that no longer fit into memory go. Their file has no
            name, so that nothing is left of it whatever happens.

    Attributes:
        block: Rows in memory, shape (n + 1,); another one after each `begin`.
        at: Which of them is in progress, less than n.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.close()

    def __len__(self) -> int:
        """Return the number of complete rows."""
        return self._written + self.at

    def begin(self, kind: np.dtype[Any]) -> None:
        """Forget everything, and take rows of a type."""
        self.close()
        rows = int(np.clip(BLOCK_BYTES // max(kind.itemsize, 1), 1, MAX_ROWS))
        self.block, self._full = np.zeros(rows + 1, dtype=kind), rows

    def advance(self) -> None:
        """Say that the row in progress is complete, and the next one begins.

        Raises:
            DatasetError: If the disk is full.
        """
        self.at += 1
        if self.at == self._full:
            self._spill()

    def rows(self) -> NDArray[Any]:
        """Return all complete rows and the one in progress, read-only.

        Those on disk are read from there when they are used. What is appended later
        does not change them, but for the last.

        Raises:
            DatasetError: If the disk is full.
        """
        if self._file is None:
            rows = self.block[: self.at + 1].copy()
            rows.flags.writeable = False
            return rows
        self._spill()
        self._write(1)
        self._file.seek(self._written * self.block.itemsize)
        held = mmap.mmap(self._file.fileno(), 0, access=mmap.ACCESS_READ)
        return np.ndarray((self._written + 1,), self.block.dtype, buffer=held)

    def close(self) -> None:
        """Forget everything."""
        if getattr(self, "_file", None) is not None:
            self._file.close()
        self._file: Any = None
        self.block: NDArray[Any] = np.empty(0)
        self.at = self._written = self._full = 0

    def _spill(self) -> None:
        """Move complete rows to the file."""
        self._write(self.at)
        self._written += self.at
        self.block[0] = self.block[self.at]
        self.at = 0

    def _write(self, count: int) -> None:
        rest = self.block.view(np.uint8).data[: count * self.block.itemsize]
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile(dir=self._folder, buffering=0)  # noqa: SIM115 - closed by close()
            while rest:  # a disk that fills up takes a part, and says so only then
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            raise DatasetError(
                f"'{self._folder}' cannot be written: {error.strerror}. The episode in "
                "progress is lost; finished ones are safe."
            ) from error
