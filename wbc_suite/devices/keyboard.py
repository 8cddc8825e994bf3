"""The keyboard of a terminal: works over ssh, needs nothing but Python."""

import contextlib
import os
import select
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

from wbc_suite.devices.keys import HELP, KeyJog
from wbc_suite.devices.state import DeviceState
from wbc_suite.errors import DeviceError

__all__ = ["Keyboard", "parse_keys"]

HOLD = 0.12  # s, after a press; a terminal repeats a held key every 0.03 s

_ESCAPES = {b"[A": "up", b"[B": "down", b"[C": "right", b"[D": "left"}
_NAMES = {
    "\t": "tab",
    "\r": "enter",
    "\n": "enter",
    "\x7f": "backspace",
    "\b": "backspace",
}


def parse_keys(data: bytes) -> Iterator[str]:
    """Yield the names of the keys in what a terminal sent."""
    at = 0
    while at < len(data):
        if data[at] == 0x1B and data[at + 1 : at + 3] in _ESCAPES:
            yield _ESCAPES[data[at + 1 : at + 3]]
            at += 3
            continue
        letter = data[at : at + 1].decode("latin-1")
        yield "escape" if letter == "\x1b" else _NAMES.get(letter, letter.lower())
        at += 1


class Keyboard:
    """Keys of the terminal that the program runs in.

    A terminal tells of presses and repeats, but not of releases: a key counts as held
    for a moment after each of them. A tap moves 3 cm; a key that is held pauses before
    it repeats, as it does in writing.

    Args:
        descriptor: File descriptor of the terminal; that of the input when left out.
        clock: Source of time, s.
    """

    help = HELP

    def __init__(
        self,
        descriptor: int | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._asked, self._descriptor = descriptor, -1
        self._clock = clock
        self._jog = KeyJog()
        self._until: dict[str, float] = {}
        self._before: list[Any] | None = None

    def start(self) -> None:
        """Take the terminal's keys one by one, without showing them."""
        with contextlib.suppress(ValueError, OSError):  # a closed or captured input
            asked = self._asked
            self._descriptor = sys.stdin.fileno() if asked is None else asked
        if not os.isatty(self._descriptor):
            raise DeviceError(
                "The keyboard device needs a terminal; the input is a file or a pipe. "
                "Run the command in a terminal, or choose another --device."
            )
        import termios
        import tty

        self._before = termios.tcgetattr(self._descriptor)
        tty.setcbreak(self._descriptor)

    def read(self) -> DeviceState:
        """Return what the keys say now."""
        now, pressed = self._clock(), set(parse_keys(self._waiting()))
        self._until = {key: end for key, end in self._until.items() if end >= now}
        fresh = {key for key in pressed if key not in self._until}
        for key in fresh:
            self._jog.press(key)
        self._until |= dict.fromkeys(pressed, now + HOLD)
        held = set(self._until)
        return self._jog.state(now, held, fresh)

    def stop(self) -> None:
        """Give the terminal back as it was."""
        if self._before is None:
            return
        import termios

        with contextlib.suppress(termios.error):
            termios.tcsetattr(self._descriptor, termios.TCSADRAIN, self._before)
        self._before = None

    def _waiting(self) -> bytes:
        if not select.select([self._descriptor], [], [], 0.0)[0]:
            return b""
        return os.read(self._descriptor, 1024)
