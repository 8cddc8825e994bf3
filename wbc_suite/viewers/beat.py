"""The beat of a loop in time: when its steps begin, and when it rests."""

import threading
import time
from collections.abc import Callable

__all__ = ["Beat"]

LEAD = 3e-3  # s; for GR1 1 ms is enough, 2 where the processor is shared
PATIENCE = 5  # periods; a loop that is further behind does not catch up


class Beat:
    """Has the steps of a loop begin one period after the other.

    What comes before a step takes more or less long. So the loop wakes ahead of the
    step, gets it ready, and waits for the moment at which it is due:

        beat.start()
        while ...:
            ...  # get ready
            beat.await_step()
            ...  # the step, and what follows from it
            beat.rest()
        beat.stop()

    Args:
        period: Time between two steps, s.
        clock: Source of wall time, s.
        sleep: Lets time pass, s.

    Attributes:
        resting: Set while the loop sleeps between two ticks or does not run: when other
            threads that take Python's lock do not hold it up.
    """

    def __init__(
        self,
        period: float,
        *,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._period, self._clock, self._sleep = period, clock, sleep
        self.resting = threading.Event()
        self.stop()

    def start(self) -> None:
        """Begin: the first step is due as soon as it can be ready."""
        self.resting.clear()
        self._due = self._clock() + LEAD

    def stop(self) -> None:
        """End; from now on no step is waited for."""
        self._due = -float("inf")
        self.resting.set()

    def await_step(self) -> None:
        """Wait until the step is due."""
        self._wait_until(self._due)

    def rest(self) -> None:
        """Wait until the next step must be got ready."""
        self._due += self._period
        if self._due < self._clock() - PATIENCE * self._period:
            self._due = self._clock()
        self.resting.set()
        self._wait_until(self._due - LEAD)
        self.resting.clear()

    def _wait_until(self, moment: float) -> None:
        if (wait := moment - self._clock()) > 0.0:
            self._sleep(wait)
