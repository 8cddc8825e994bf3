"""Buffers of the last values."""

from typing import Any

import numpy as np

from wbc_suite.typing import Array


class RingBuffer:
    """The last `length` values, shape (length, dim)."""

    def __init__(self, dim: int, length: int) -> None:
        self.dim, self.length = dim, length
        self.clear()

    def push(self, value: Any) -> None:
        """Add a value."""
        self.buf[self._next % self.length] = value
        self._next += 1
        self._size = min(self._next, self.length)

    def clear(self) -> None:
        """Forget all values."""
        self.buf: Array = np.zeros((self.length, self.dim))
        self._next = self._size = 0

    @property
    def current(self) -> Array:
        """The last value."""
        return self.buf[(self._next - 1) % self.length]

    @property
    def average(self) -> Array:
        """The mean of the values in the buffer."""
        return self.buf[: max(self._size, 1)].mean(axis=0)


class DelayBuffer(RingBuffer):
    """The last values, to be read late."""

    def get_delayed_value(self, delay: int) -> Array:
        """Return the value of some pushes ago."""
        return self.buf[(self._next - 1 - delay) % self.length]


class DeltaBuffer:
    """The last two values."""

    def __init__(self, dim: int, init_value: Any = None) -> None:
        self.dim = dim
        self.last = np.zeros(dim) if init_value is None else np.asarray(init_value)
        self.current = self.last

    def push(self, value: Any) -> None:
        """Add a value."""
        self.last, self.current = self.current, np.array(value)

    def clear(self) -> None:
        """Forget both values."""
        self.last = self.current = np.zeros(self.dim)

    @property
    def delta(self) -> Array:
        """The difference of the last two values."""
        return self.current - self.last

    @property
    def average(self) -> Array:
        """The mean of the last two values."""
        return (self.current + self.last) / 2.0
