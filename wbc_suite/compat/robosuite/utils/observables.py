"""Observables: sensors that are sampled, corrupted, delayed and filtered."""

from collections.abc import Callable
from typing import Any

import numpy as np

Sensor = Callable[[dict[str, Any]], Any]
MODIFIERS = (
    *("sensor", "corrupter", "filter", "delayer", "sampling_rate"),
    *("enabled", "active"),
)


def sensor(modality: str) -> Callable[[Sensor], Sensor]:
    """Decorate a function of the cache of observations as a sensor of a modality."""

    def mark(function: Sensor) -> Sensor:
        function.__modality__ = modality  # pyright: ignore[reportFunctionMemberAccess] - where robosuite keeps it
        return function

    return mark


Corrupter = Callable[[Any], Any]
Delayer = Callable[[], float]


def create_deterministic_corrupter(
    corruption: Any, low: Any = -np.inf, high: Any = np.inf
) -> Corrupter:
    """Return a function that adds the same values and clips."""
    return lambda values: np.clip(np.asarray(values) + corruption, low, high)


def create_uniform_noise_corrupter(
    min_noise: Any, max_noise: Any, low: Any = -np.inf, high: Any = np.inf
) -> Corrupter:
    """Return a function that adds uniform noise and clips."""
    return _noisy(np.random.uniform, min_noise, max_noise, low, high)


def create_gaussian_noise_corrupter(
    mean: Any, std: Any, low: Any = -np.inf, high: Any = np.inf
) -> Corrupter:
    """Return a function that adds Gaussian noise and clips."""
    return _noisy(np.random.normal, mean, std, low, high)


def _noisy(draw: Any, a: Any, b: Any, low: Any, high: Any) -> Corrupter:
    def corrupt(values: Any) -> Any:
        values = np.asarray(values)
        return np.clip(values + draw(a, b, values.shape), low, high)

    return corrupt


def create_deterministic_delayer(delay: float) -> Delayer:
    """Return a function that returns the same delay, s."""
    return lambda: delay


def create_uniform_sampled_delayer(min_delay: float, max_delay: float) -> Delayer:
    """Return a function that draws delays uniformly, s."""
    return lambda: float(np.random.uniform(min_delay, max_delay))  # noqa: NPY002 - as above


def create_gaussian_sampled_delayer(mean: float, std: float) -> Delayer:
    """Return a function that draws Gaussian delays, s, at least 0."""
    return lambda: max(float(np.random.normal(mean, std)), 0.0)  # noqa: NPY002 - as above


def NO_CORRUPTION(inp: Any) -> Any:
    """Return values unchanged."""
    return inp


NO_FILTER, NO_DELAY = NO_CORRUPTION, create_deterministic_delayer(0.0)


class Observable:
    """One observation, sampled once in a period and shown until the next sample.

    A delay of d seconds takes the sample d before the end of the period, so that what
    is shown at its end is d old; delays are below the period.

    Attributes:
        modality: Group of the observation, such as `object` or `image`.
        is_plain: Whether the sample is the sensor's value at the end of each period.
    """

    def __init__(
        self,
        name: str,
        sensor: Sensor,
        corrupter: Callable[[Any], Any] | None = None,
        filter: Callable[[Any], Any] | None = None,
        delayer: Callable[[], float] | None = None,
        sampling_rate: float = 20,
        enabled: bool = True,
        active: bool = True,
    ) -> None:
        self.name, self._sensor = name, sensor
        self._corrupter = corrupter or NO_CORRUPTION
        self._filter, self._delayer = filter or NO_FILTER, delayer or NO_DELAY
        self.set_sampling_rate(sampling_rate)
        self._enabled, self._active = enabled, active
        self._value: Any = np.asarray(sensor({}))
        self.modality = str(getattr(sensor, "__modality__", "observation"))
        self.reset()

    def update(
        self, timestep: float, obs_cache: dict[str, Any], force: bool = False
    ) -> None:
        """Advance by a timestep, s, and take the sample that is due, or is forced."""
        if self._enabled:
            self._time += timestep
            due = self._time >= self._period - self._delay - 1e-9
            if force or (due and not self._sampled):
                value = self._filter(self._corrupter(self._sensor(obs_cache)))
                self._value = obs_cache[self.name] = np.asarray(value)
                self._sampled = True
            if self._time >= self._period - 1e-9:
                self._time -= self._period
                self._delay = self._draw_delay()
                self._sampled = False
        obs_cache[self.name] = self._value

    def reset(self) -> None:
        """Start an episode."""
        self._time, self._sampled = 0.0, False
        self._delay = self._draw_delay()

    def is_enabled(self) -> bool:
        """Whether samples are taken."""
        return self._enabled

    def is_active(self) -> bool:
        """Whether it is part of observations."""
        return self._active

    def set_enabled(self, enabled: bool) -> None:
        """Take samples from now on, or be no part of observations."""
        self._enabled = enabled
        self.reset()

    def set_active(self, active: bool) -> None:
        """Be part of observations from now on, or not."""
        self._active = active

    def set_sensor(self, sensor: Sensor) -> None:
        """Replace the sensor."""
        self._sensor = sensor

    def set_corrupter(self, corrupter: Callable[[Any], Any] | None) -> None:
        """Replace the corrupter; None for none."""
        self._corrupter = corrupter or NO_CORRUPTION

    def set_filter(self, filter: Callable[[Any], Any] | None) -> None:
        """Replace the filter; None for none."""
        self._filter = filter or NO_FILTER

    def set_delayer(self, delayer: Callable[[], float] | None) -> None:
        """Replace the delayer; None for none."""
        self._delayer = delayer or NO_DELAY
        self._delay = self._draw_delay()

    def set_sampling_rate(self, rate: float) -> None:
        """Take `rate` samples a second."""
        self._sampling_rate = float(rate)
        self._period = 1.0 / self._sampling_rate

    def is_plain_at(self, control_freq: float) -> bool:
        """Whether its value is the sensor's at the end of each control period."""
        period = abs(self._period * control_freq - 1.0) < 1e-9
        return period and self._delayer is NO_DELAY and self._enabled

    @property
    def obs(self) -> Any:
        """The present value; a number where there is only one."""
        return self._value

    def _draw_delay(self) -> float:
        return min(max(self._delayer(), 0.0), self._period)
