"""Memory of controllers: their numbers that outlive a tick, as one vector."""

from collections.abc import Iterable
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from wbc_suite.typing import Vector

Parts: TypeAlias = tuple[NDArray[Any], ...]
"""Arrays of numbers, as views that can be written."""

LARGEST = float(np.finfo(np.float64).max)
"""Stands for infinity in a vector, which is finite."""


class Memory:
    """Arrays of any shape, read as one vector and written back from it.

    Attributes:
        sizes: Number of values of each array.
    """

    def __init__(self, parts: Iterable[NDArray[Any]]) -> None:
        self._parts = tuple(parts)
        self.sizes = tuple(part.size for part in self._parts)

    @property
    def size(self) -> int:
        """Number of values."""
        return sum(self.sizes)

    def read(self) -> Vector:
        """Return the values, a copy."""
        values = np.concatenate([np.zeros(0), *(part.ravel() for part in self._parts)])
        return np.clip(values, -LARGEST, LARGEST)

    def write(self, values: Vector) -> None:
        """Write values of `read`, shape (size,), into the arrays."""
        ends = np.cumsum(self.sizes)[:-1]
        for part, own in zip(self._parts, np.split(values, ends), strict=True):
            part[...] = own.reshape(part.shape)
