"""Durations of steps, their period, and latencies of inputs, for display."""

from collections import deque
from collections.abc import Iterable

import numpy as np

from wbc_suite.typing import Vector

SMOOTHING = 0.03  # weight of the newest step in the displayed times
LATENCIES = 512  # inputs over which the displayed latency is the median


class StepTimes:
    """Measures how long steps take, how far apart they are, and the inputs' ages.

    Attributes:
        duration: Smoothed time from the beginning of a step to its end, s; nan before
            one.
        period: Smoothed time between the ends of two steps, s; nan before two.
    """

    def __init__(self) -> None:
        self._latencies: deque[float] = deque(maxlen=LATENCIES)
        self.duration = self.period = self._last = float("nan")

    def restart(self) -> None:
        """Leave out the time until the next step."""
        self._last = float("nan")

    def end_step(self, inputs: Iterable[float], begun: float, now: float) -> None:
        """Note the end of a step.

        Args:
            inputs: When the inputs of the step arrived, s.
            begun: When the step began, s.
            now: Time, s.
        """
        self._latencies.extend(max(now - arrived, 0.0) for arrived in inputs)
        self.duration = _smoothed(self.duration, now - begun)
        self.period = _smoothed(self.period, now - self._last)
        self._last = now

    @property
    def latencies(self) -> Vector:
        """Ages of the last inputs at the end of their steps, s."""
        return np.array(self._latencies, dtype=np.float64)

    @property
    def latency(self) -> float:
        """Median of the latencies, s; nan before any."""
        values = self.latencies
        return float(np.median(values)) if len(values) else float("nan")


def _smoothed(mean: float, value: float) -> float:
    """Return a mean with a new value; nan stands for no mean or no value."""
    if np.isnan(mean):
        return value
    return mean if np.isnan(value) else mean + SMOOTHING * (value - mean)
