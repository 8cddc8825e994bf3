"""Durations of steps, and latencies of inputs, for display."""

from collections import deque
from collections.abc import Iterable

import numpy as np

from wbc_suite.typing import Vector

SMOOTHING = 0.03  # weight of the newest step in the displayed duration
LATENCIES = 512  # inputs over which the displayed latency is the median


class StepTimes:
    """Measures how long steps take, and how old their inputs are.

    Attributes:
        mean: Smoothed duration of a step, s; nan before two steps.
    """

    def __init__(self) -> None:
        self._latencies: deque[float] = deque(maxlen=LATENCIES)
        self.mean, self._last = float("nan"), float("nan")

    def restart(self) -> None:
        """Leave out the time until the next step."""
        self._last = float("nan")

    def end_step(self, inputs: Iterable[float], now: float) -> None:
        """Note the end of a step.

        Args:
            inputs: When the inputs of the step arrived, s.
            now: Time, s.
        """
        self._latencies.extend(max(now - arrived, 0.0) for arrived in inputs)
        spent, self._last = now - self._last, now
        if np.isnan(self.mean):
            self.mean = spent
        elif not np.isnan(spent):
            self.mean += SMOOTHING * (spent - self.mean)

    @property
    def latencies(self) -> Vector:
        """Ages of the last inputs at the end of their steps, s."""
        return np.array(self._latencies, dtype=np.float64)

    @property
    def latency(self) -> float:
        """Median of the latencies, s; nan before any."""
        values = self.latencies
        return float(np.median(values)) if len(values) else float("nan")
