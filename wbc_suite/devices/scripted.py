"""A device without hardware: it says what a program tells it to."""

from collections.abc import Iterable

from wbc_suite.devices.state import DeviceState

__all__ = ["Scripted"]


class Scripted:
    """Says one state after the other, one per read, and then the last one for ever.

    Args:
        states: What it says; taken one by one, so a generator may be endless.
    """

    def __init__(self, states: Iterable[DeviceState]) -> None:
        self._states = iter(states)
        self._last = DeviceState(time=0.0)

    def start(self) -> None:
        """Do nothing: there is nothing to open."""

    def read(self) -> DeviceState:
        """Return the next state."""
        self._last = next(self._states, self._last)
        return self._last

    def stop(self) -> None:
        """Do nothing."""
