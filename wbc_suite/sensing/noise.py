"""Noise, delays and filters of observations.

Any function of the same signature may take their place: noise takes values and a
generator, a delay takes a generator and returns seconds, a filter takes values.
"""

from dataclasses import dataclass

import numpy as np

from wbc_suite.arguments import check_count, check_number
from wbc_suite.typing import Vector


@dataclass(frozen=True, slots=True)
class GaussianNoise:
    """Adds normal noise; `std` and `bias` in the observation's unit."""

    std: float
    bias: float = 0.0

    def __post_init__(self) -> None:
        check_number("GaussianNoise: std", self.std, least=0.0)
        check_number("GaussianNoise: bias", self.bias)

    def __call__(self, values: Vector, rng: np.random.Generator) -> Vector:
        """Return values with noise."""
        return values + rng.normal(self.bias, self.std, values.shape)


@dataclass(frozen=True, slots=True)
class UniformNoise:
    """Adds noise between -size and size, in the observation's unit."""

    size: float

    def __post_init__(self) -> None:
        check_number("UniformNoise: size", self.size, least=0.0)

    def __call__(self, values: Vector, rng: np.random.Generator) -> Vector:
        """Return values with noise."""
        return values + rng.uniform(-self.size, self.size, values.shape)


@dataclass(frozen=True, slots=True)
class UniformDelay:
    """A delay drawn for each sample, s."""

    low: float
    high: float

    def __post_init__(self) -> None:
        check_number("UniformDelay: low", self.low, least=0.0)
        check_number("UniformDelay: high", self.high, least=self.low)

    def __call__(self, rng: np.random.Generator) -> float:
        """Return a delay, s."""
        return rng.uniform(self.low, self.high)


class LowPass:
    """First-order low-pass filter: y = share y + (1 - share) x.

    `share` is in [0, 1); after n samples share^n of a step is left.
    """

    def __init__(self, share: float) -> None:
        self.share = check_number("LowPass: share", share, least=0.0)
        check_number("LowPass: 1 - share", 1.0 - self.share, above=0.0)
        self._value: Vector | None = None

    def reset(self) -> None:
        """Delete the past."""
        self._value = None

    def __call__(self, values: Vector) -> Vector:
        """Return filtered values."""
        old = values if self._value is None else self._value
        self._value = self.share * old + (1.0 - self.share) * values
        return self._value


class MovingAverage:
    """Mean of the last `count` samples."""

    def __init__(self, count: int) -> None:
        self.count = check_count("MovingAverage: count", count, least=1)
        self._last: list[Vector] = []

    def reset(self) -> None:
        """Delete the past."""
        self._last = []

    def __call__(self, values: Vector) -> Vector:
        """Return filtered values."""
        self._last = [*self._last, values.copy()][-self.count :]
        return np.mean(self._last, axis=0)
