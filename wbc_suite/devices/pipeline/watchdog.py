"""The watchdog: which messages count, and what happens when none come."""

import math
from enum import StrEnum

from wbc_suite.devices.state import DeviceState

__all__ = ["Phase", "Watchdog"]


class Phase(StrEnum):
    """How long the device has been silent."""

    LIVE = "live"
    HOLD = "hold"
    RETURN = "return"


class Watchdog:
    """Judges a device by whether its own time moves on.

    A state counts if its time is later than that of all before, and all its numbers are
    finite. So a device that stalls, repeats itself or goes back in time is silent, and
    so is one that says NaN. When it has been silent long enough to be held, its time
    may begin anew: it was restarted.

    Args:
        hold_after: Silence before limbs are held, s.
        return_after: Silence before they go home, s; None for never.
        dt: Time between two looks, s.
    """

    def __init__(
        self, hold_after: float, return_after: float | None, dt: float
    ) -> None:
        self._hold, self._dt = hold_after, dt
        self._return = math.inf if return_after is None else return_after
        self.reset()

    def reset(self) -> None:
        """Wait for a first message."""
        self._latest, self._last = -math.inf, -math.inf
        self._silent, self._spoke = math.inf, False
        self._fault = ""

    @property
    def phase(self) -> Phase:
        """What to do now."""
        if self._silent <= self._hold:
            return Phase.LIVE
        silent = self._silent if self._spoke else 0.0
        return Phase.RETURN if silent > self._return else Phase.HOLD

    @property
    def acting(self) -> str:
        """What it does, in words; empty while all is well."""
        if self.phase is Phase.LIVE:
            return self._fault
        if not self._spoke:
            return "waiting for the device"
        doing = "going back" if self.phase is Phase.RETURN else "holding"
        return f"{self._fault or 'the device is silent'}: {doing}"

    def look(self, state: DeviceState) -> DeviceState | None:
        """Return the state if it is news, else None."""
        self._silent += self._dt
        if not state.finite:
            self._fault = "the device says what is no number"
            return None
        held = self.phase is not Phase.LIVE
        moved_on = state.time > self._latest or (held and state.time > self._last)
        if state.time < self._latest and not moved_on:
            self._fault = "the device goes back in time"
        self._last = state.time
        if not moved_on:
            return None
        self._latest, self._silent, self._spoke = state.time, 0.0, True
        self._fault = ""
        return state
