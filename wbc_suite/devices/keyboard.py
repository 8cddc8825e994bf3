"""The keyboard of a terminal, also over ssh, and what its keys do."""

import contextlib
import os
import re
import select
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from typing import Any

import numpy as np

from wbc_suite.devices.state import DeviceState, LimbInput
from wbc_suite.errors import DeviceError
from wbc_suite.typing import Vector

HOLD = 0.12  # s, after a press; a terminal repeats a held key every 0.03 s
TWIST = (0.25, 0.25, 0.25, 0.8, 0.8, 0.8)  # m/s and rad/s, of a held key
BASE = (0.4, 0.4, 0.6)  # m/s and rad/s
RISE = 0.1  # m/s, of the body
FACTORS = {"+": 1.5, "=": 1.5, "-": 1.0 / 1.5}  # of the speeds, by key
SLOWEST, FASTEST = 0.1, 4.0  # of the speeds above

JOG: dict[str, tuple[int, float]] = {
    "w": (0, 1), "s": (0, -1), "a": (1, 1), "d": (1, -1), "r": (2, 1), "f": (2, -1),
    "u": (3, -1), "o": (3, 1), "i": (4, 1), "k": (4, -1), "j": (5, 1), "l": (5, -1),
}  # fmt: skip
"""Component of the twist and sign by key."""

BASE_JOG: dict[str, tuple[int, float]] = {
    "up": (0, 1), "down": (0, -1), ",": (1, 1), ".": (1, -1),
    "left": (2, 1), "right": (2, -1),
}  # fmt: skip
"""Component of the base's velocity and sign by key."""

DRIVE_JOG: dict[str, tuple[int, float]] = {
    "w": (0, 1), "s": (0, -1), "a": (1, 1), "d": (1, -1), "q": (2, 1), "e": (2, -1),
    "r": (3, 1), "f": (3, -1),
}  # fmt: skip
"""Component of the robot's velocity and sign by key, while keys drive."""

BUTTONS = {
    " ": "grip", "tab": "next", "m": "mirror", "h": "home", "p": "pause", "0": "reset",
    "enter": "keep", "backspace": "discard", "z": "undo", "escape": "quit",
}  # fmt: skip
"""Button by key."""

HELP = """\
  w s  forward, back     u o  roll       space  open or close the gripper
  a d  left, right       i k  pitch      tab    next hand      m  mirror
  r f  up, down          j l  yaw        + -    faster, slower  h  home
  arrows , .  drive and turn the base    p pause  0 reset  esc quit
  v  let w s a d q e r f drive: forward, back, left, right, turn, up, down
  enter  keep the episode    backspace  discard it    z  undo
"""

_NAMES = {
    "\x1b[A": "up", "\x1b[B": "down", "\x1b[C": "right", "\x1b[D": "left",
    "\x1b": "escape", "\t": "tab", "\r": "enter", "\n": "enter",
    "\x7f": "backspace", "\b": "backspace",
}  # fmt: skip


def parse_keys(data: bytes) -> Iterator[str]:
    """Yield the names of the keys in a terminal's input."""
    for found in re.finditer("\x1b\\[[A-D]|.", data.decode("latin-1"), re.DOTALL):
        key: str = found.group()
        yield _NAMES.get(key, key.lower())


def _velocity(
    held: Set[str], keys: Mapping[str, tuple[int, float]], speeds: Sequence[float]
) -> Vector:
    """Return a velocity by held keys; `speeds` is that of each component."""
    velocity = np.zeros(len(speeds))
    for key in held & keys.keys():
        index, sign = keys[key]
        velocity[index] += sign * speeds[index]
    return velocity


class Keyboard:
    """Keys of the terminal that the program runs in.

    A terminal reports presses and repeats, but no releases: a key counts as held for
    `HOLD` after each of them. A tap moves 3 cm. A held key pauses before it repeats, as
    in writing.

    Args:
        descriptor: File descriptor of the terminal; standard input by default.
        clock: Source of time, s.
        drives: Whether w s a d q e r f drive the robot at first; else they move the
            selected hand. The key v changes it.
    """

    help = HELP

    def __init__(
        self,
        descriptor: int | None = None,
        clock: Callable[[], float] = time.monotonic,
        *,
        drives: bool = False,
    ) -> None:
        self._drives = drives
        self._asked, self._descriptor = descriptor, -1
        self._clock, self._pace = clock, 1.0
        self._until: dict[str, float] = {}
        self._before: list[Any] | None = None

    def start(self) -> None:
        """Read single keys without echo; raises DeviceError if there is no terminal."""
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
        """Return the state of the keys."""
        now, pressed = self._clock(), set(parse_keys(self._waiting()))
        self._until = {key: end for key, end in self._until.items() if end >= now}
        fresh = {key for key in pressed if key not in self._until}
        for key in fresh:
            if key in FACTORS:
                pace = self._pace * FACTORS[key]
                self._pace = min(max(pace, SLOWEST), FASTEST)
        self._drives ^= "v" in fresh
        self._until |= dict.fromkeys(pressed, now + HOLD)
        held = self._until.keys()
        driving = held & DRIVE_JOG.keys() if self._drives else set[str]()
        drive = _velocity(driving, DRIVE_JOG, (*BASE, RISE))
        base = drive[:3] + _velocity(held, BASE_JOG, BASE)
        return DeviceState(
            time=now,
            limbs={
                "hand": LimbInput(
                    twist=self._pace * _velocity(held - driving, JOG, TWIST)
                )
            },
            base=self._pace * base,
            height=self._pace * float(drive[3]),
            buttons=frozenset(BUTTONS[key] for key in fresh & BUTTONS.keys()),
        )

    def stop(self) -> None:
        """Restore the terminal."""
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
