"""The watchdog: it detects devices that send no valid new data."""

import math
from collections.abc import Callable
from enum import StrEnum

from wbc_suite.devices.state import DeviceState


class Phase(StrEnum):
    """What the pipeline does, by the time without new data."""

    LIVE = "live"
    HOLD = "hold"
    RETURN = "return"


class Watchdog:
    """Detects whether a device sends new data.

    A state is new if its time, on the device's clock, is later than all before and all
    its numbers are finite. So a device that stalls, repeats itself, goes back in time
    or sends NaN has no new data. After `hold_after` its time may start again: the
    device was restarted. Silence is measured by `clock`, s, which never goes back,
    however slowly the loop runs. For times see `PipelineConfig`.

    Attributes:
        silence: Time without new data at the last check, s; infinite before any.
    """

    def __init__(
        self,
        hold_after: float,
        return_after: float | None,
        clock: Callable[[], float],
    ) -> None:
        self._hold, self._clock = hold_after, clock
        self._return = math.inf if return_after is None else return_after
        self.reset()

    def reset(self) -> None:
        """Wait for a first state."""
        self._latest, self._last = -math.inf, -math.inf
        self._heard, self.silence = -math.inf, math.inf
        self._fault = ""

    @property
    def has_data(self) -> bool:
        """Whether there was a state since the reset."""
        return self._heard > -math.inf

    @property
    def phase(self) -> Phase:
        """What the pipeline has to do."""
        if self.silence <= self._hold:
            return Phase.LIVE
        silent = self.silence if self.has_data else 0.0
        return Phase.RETURN if silent > self._return else Phase.HOLD

    @property
    def acting(self) -> str:
        """What the watchdog reports; empty while the device sends new data."""
        if self.phase is Phase.LIVE:
            return self._fault
        if not self.has_data:
            return "waiting for the device"
        doing = "returning" if self.phase is Phase.RETURN else "holding"
        return f"{self._fault or 'no data from the device'}: {doing}"

    def check(self, state: DeviceState) -> DeviceState | None:
        """Return the state if it is new, else None."""
        now = self._clock()
        self.silence = now - self._heard
        if not state.finite:
            self._fault = "the device sends invalid numbers"
            return None
        held = self.phase is not Phase.LIVE
        moved_on = state.time > self._latest or (held and state.time > self._last)
        if state.time < self._latest and not moved_on:
            self._fault = "the device's time goes backwards"
        self._last = state.time
        if not moved_on:
            return None
        self._latest, self._heard, self.silence = state.time, now, 0.0
        self._fault = ""
        return state
