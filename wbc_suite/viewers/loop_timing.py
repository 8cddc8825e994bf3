"""Timing of the control loop: its period, what is measured of it, its priority."""

import contextlib
import gc
import os
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable

import numpy as np

from wbc_suite.typing import Vector

LEAD = 3e-3  # s; for GR1 1 ms is enough, 2 ms on a shared processor
SWITCH_INTERVAL = 1e-4  # s; at 1 ms, or Python's own 5, other threads delay the loop
SMOOTHING = 0.03  # weight of the newest step in the displayed times
LATENCIES = 512  # inputs over which the displayed latency is the median


class LoopTimer:
    """Start the steps of a loop one period apart.

    The work before a step takes a varying time. So the loop wakes `LEAD` before the
    step, prepares it, and waits for the moment at which it is due:

        timer.start()
        while ...:
            ...  # prepare
            timer.wait_for_step()
            ...  # the step
            timer.finish_step()
        timer.stop()

    A step that ends after the next one is due is an overrun. The next one begins at
    once; periods that have passed entirely are skipped, so that steps never follow each
    other in a burst.

    Attributes:
        overruns: Number of overruns since the start.
        skipped: Number of periods that were skipped since the start.
        idle: Set while the loop sleeps between two ticks or does not run. Other threads
            then take Python's lock without delaying it.
    """

    def __init__(
        self,
        period: float,
        *,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._period, self._clock, self._sleep = period, clock, sleep
        self.overruns = self.skipped = 0
        self.idle = threading.Event()
        self.stop()

    def start(self) -> None:
        """Start; the first step is due after `LEAD`."""
        self.idle.clear()
        self.overruns = self.skipped = 0
        self._due = self._clock() + LEAD

    def restart(self) -> None:
        """Leave out the time since the last step was due, which was no step's."""
        self._due = max(self._due, self._clock())

    def stop(self) -> None:
        """Stop; `wait_for_step` returns at once from now on."""
        self._due = -float("inf")
        self.idle.set()

    def wait_for_step(self) -> None:
        """Sleep until the step is due."""
        self._sleep_until(self._due)

    def finish_step(self) -> None:
        """Sleep until the next step has to be prepared."""
        self._due += self._period
        late = self._clock() - self._due
        if late > 0.0:
            missed = int(late / self._period)
            self.overruns, self.skipped = self.overruns + 1, self.skipped + missed
            self._due += missed * self._period
        self.idle.set()
        self._sleep_until(self._due - LEAD)
        self.idle.clear()

    def _sleep_until(self, moment: float) -> None:
        if (wait := moment - self._clock()) > 0.0:
            self._sleep(wait)


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
        """Note the end of a step that had inputs and began at these times, s."""
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


def prepare_interpreter() -> None:
    """Shorten thread switches and garbage collections of this interpreter.

    A collection that visits all objects created so far takes many periods; those that
    the loop creates are few.
    """
    sys.setswitchinterval(SWITCH_INTERVAL)
    gc.collect()
    gc.freeze()


def raise_priority(rank: int) -> None:
    """Give this thread a real-time priority, if the system permits it.

    Linux permits it to administrators and to users with `rtprio` in
    /etc/security/limits.conf. Threads that this one starts do not inherit it. The
    highest rank from 1 on runs first.
    """
    with contextlib.suppress(AttributeError, OSError):
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(rank))
