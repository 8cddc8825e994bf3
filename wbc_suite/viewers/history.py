"""A fixed window over the recent past, for live plots and running figures."""

import threading

import numpy as np
from numpy.typing import NDArray

from wbc_suite.typing import Vector

__all__ = ["History"]


class History:
    """The last rows of a table of figures, oldest first; safe to share by threads."""

    def __init__(self, columns: int, capacity: int) -> None:
        self._rows = np.full((capacity, columns), np.nan)
        self._count = 0
        self._lock = threading.Lock()

    def __len__(self) -> int:
        return min(self._count, len(self._rows))

    def append(self, row: Vector) -> None:
        """Add a row, shape (columns,), in place of the oldest one when full."""
        with self._lock:
            self._rows[self._count % len(self._rows)] = row
            self._count += 1

    def clear(self) -> None:
        """Forget everything."""
        self._count = 0

    def rows(self) -> NDArray[np.float64]:
        """Return a copy of what is held, shape (length, columns), oldest first."""
        with self._lock:
            if self._count <= len(self._rows):
                return self._rows[: self._count].copy()
            return np.roll(self._rows, -(self._count % len(self._rows)), axis=0)
