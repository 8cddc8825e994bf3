"""Gamepads: DualSense by its HID reports, others by Linux' joystick files.

A gamepad moves the robot only while its enable button is held: a stick that drifts, or
is pushed by accident, moves nothing.
"""

import errno
import os
import struct
import time
from collections.abc import Callable, Set
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from wbc_suite.devices.hid import open_hid, waiting_reports
from wbc_suite.devices.state import DeviceState, LimbInput
from wbc_suite.errors import DeviceError
from wbc_suite.typing import Vector

DEAD = 0.1  # dead zone, as a fraction of a stick's range
SPEED, TURN = 0.3, 1.0  # m/s and rad/s at full deflection
DRIVE, SPIN, RISE = 0.4, 0.6, 0.1  # of the base, and of the body up and down
FULL_REPORT = 64  # bytes; shorter ones may come on changes only
SONY, DUALSENSE = (0x054C,), (0x0CE6, 0x0DF2)

ENABLE = "l1"  # held to move the robot
MOVING = frozenset({"grip", "home"})  # buttons that need it too

BUTTONS = {
    "south": "grip", "north": "next", "west": "home", "east": "discard",
    "start": "keep", "select": "reset",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Pad:
    """State of a gamepad.

    Attributes:
        left: Left stick, right and up, -1 .. 1.
        right: Right stick.
        triggers: Left and right, 0 .. 1.
        cross: Right and up, -1, 0 or 1.
        down: Names of pressed buttons: `south`, `east`, `west`, `north`, `l1`, `r1`,
            `select`, `start`, `l3` and `r3` (presses of the sticks).
    """

    left: tuple[float, float] = (0.0, 0.0)
    right: tuple[float, float] = (0.0, 0.0)
    triggers: tuple[float, float] = (0.0, 0.0)
    cross: tuple[int, int] = (0, 0)
    down: frozenset[str] = frozenset()


def parse_dualsense(report: bytes) -> Pad | None:
    """Parse a DualSense's report of USB (1) or Bluetooth (49); None for others.

    Source: Linux, drivers/hid/hid-playstation.c, struct dualsense_input_report.
    """
    if len(report) >= 11 and report[0] == 0x01:
        body = report[1:]
    elif len(report) >= 12 and report[0] == 0x31:
        body = report[2:]
    else:
        return None
    x, y, rx, ry, left, right = body[:6]
    hat, bits = body[7] & 15, int.from_bytes(body[7:9], "little") >> 4
    above = ("l1", "r1", "l2", "r2", "select", "start", "l3", "r3")
    names = ("west", "south", "east", "north", *above)
    down = {name for k, name in enumerate(names) if bits >> k & 1}
    around = [(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)]
    return Pad(
        left=(_byte(x), -_byte(y)),
        right=(_byte(rx), -_byte(ry)),
        triggers=(left / 255.0, right / 255.0),
        cross=around[hat] if hat < 8 else (0, 0),
        down=frozenset(down - {"l2", "r2"}),
    )


def parse_joystick(event: bytes, pad: Pad) -> Pad:
    """Return a pad after an event of a Linux joystick file, 8 bytes.

    Source: Linux, Documentation/input/joydev/joystick-api.rst; numbers as the driver
    xpad gives them.
    """
    _, value, kind, number = struct.unpack("<IhBB", event)
    if kind & 2:  # an axis; bit 7 marks the first report
        return _with_axis(pad, number, value / 32767.0)
    names = ("south", "east", "west", "north", "l1", "r1", "select", "start")
    names = (*names, "guide", "l3", "r3")
    if not kind & 1 or number >= len(names):
        return pad
    name = {names[number]}
    return replace(pad, down=pad.down | name if value else pad.down - name)


def _with_axis(pad: Pad, number: int, x: float) -> Pad:
    """Return a pad with one axis of the joystick file set, -1 .. 1."""
    changes: dict[int, dict[str, Any]] = {
        0: {"left": (x, pad.left[1])},
        1: {"left": (pad.left[0], -x)},
        2: {"triggers": (0.5 * (x + 1.0), pad.triggers[1])},
        3: {"right": (x, pad.right[1])},
        4: {"right": (pad.right[0], -x)},
        5: {"triggers": (pad.triggers[0], 0.5 * (x + 1.0))},
        6: {"cross": (round(x), pad.cross[1])},
        7: {"cross": (pad.cross[0], round(-x))},
    }
    return replace(pad, **changes.get(number, {}))


def pad_state(
    time: float,
    pad: Pad,
    pressed: Set[str] = frozenset(),
    *,
    drives: bool = False,
) -> DeviceState:
    """Return velocities of the selected hand and the base, zero without `ENABLE`.

    While r1 is held the right stick rolls the hand in place of yawing it. `pressed` are
    the buttons that were pressed since the last state. If it `drives`, the sticks drive
    the robot, and else they move the hand.
    """
    buttons = frozenset(BUTTONS[n] for n in (pad.down | pressed) & BUTTONS.keys())
    if ENABLE not in pad.down:
        pad, buttons = Pad(), buttons - MOVING
    (lx, ly), (rx, ry) = _without_dead_zone(pad.left), _without_dead_zone(pad.right)
    base = np.array([DRIVE * pad.cross[1], 0.0, -SPIN * pad.cross[0]])
    height = 0.0
    if drives:
        base += [DRIVE * ly, -DRIVE * lx, -SPIN * rx]
        height, (lx, ly), (rx, ry) = RISE * ry, (0.0, 0.0), (0.0, 0.0)
    rise = pad.triggers[1] - pad.triggers[0]
    rolls = "r1" in pad.down
    linear = np.array([ly, -lx, rise])
    angular = np.array([rx * rolls, ry, -rx * (not rolls)])
    twist: Vector = np.concatenate([SPEED * linear, TURN * angular])
    return DeviceState(
        time=time,
        limbs={"hand": LimbInput(twist=twist)},
        base=base,
        height=height,
        buttons=buttons,
    )


class Gamepad:
    """A gamepad by its joystick file; Linux only.

    On other systems use the page of the stream: there the browser reads the gamepad.

    Args:
        path: The joystick file.
        clock: Source of time, s.
        drives: Whether the sticks drive the robot at first; pressing the left one
            changes it.
    """

    help = (
        "Gamepad: hold L1 to move the robot. Left stick and triggers move the hand, "
        "right stick turns it (with R1 it rolls it), south button closes, north: next "
        "hand, the D-pad drives. Press the left stick: both sticks drive.\n"
    )

    def __init__(
        self,
        path: str | Path = "/dev/input/js0",
        clock: Callable[[], float] = time.monotonic,
        *,
        drives: bool = False,
    ) -> None:
        self._path, self._clock, self._drives = Path(path), clock, drives
        self._file, self._pad = -1, Pad()

    def start(self) -> None:
        """Open the file; raises DeviceError if there is none."""
        try:
            self._file = os.open(self._path, os.O_RDONLY | os.O_NONBLOCK)
        except OSError as error:
            raise DeviceError(
                f"No gamepad at '{self._path}' ({error.strerror}). Plug it in, or use "
                "--device stream and the browser's page, which reads any gamepad."
            ) from error

    def read(self) -> DeviceState:
        """Return the state of the gamepad."""
        pressed: frozenset[str] = frozenset()
        try:
            while len(event := os.read(self._file, 8)) == 8:
                before, self._pad = self._pad, parse_joystick(event, self._pad)
                pressed |= self._pad.down
                self._drives ^= "l3" in self._pad.down - before.down
        except OSError as error:
            if error.errno != errno.EAGAIN:  # unplugged: everything at rest
                self._pad = Pad()
        return pad_state(self._clock(), self._pad, pressed, drives=self._drives)

    def stop(self) -> None:
        """Close the file."""
        if self._file >= 0:
            os.close(self._file)
        self._file = -1


class DualSense:
    """Sony's DualSense, by USB or Bluetooth, on any system.

    `find` opens the connected ones; for other arguments see `Gamepad`.
    """

    help = Gamepad.help

    def __init__(
        self,
        find: Callable[[], list[Any]] | None = None,
        clock: Callable[[], float] = time.monotonic,
        *,
        drives: bool = False,
    ) -> None:
        self._find = find or (lambda: open_hid("DualSense", SONY, DUALSENSE))
        self._clock, self._drives = clock, drives
        self._hid: Any = None
        self._pad = Pad()
        self._heard: float | None = None  # when a full report came, s

    def start(self) -> None:
        """Open the gamepad; raises DeviceError if there is none."""
        self._hid = self._find()[0]

    def read(self) -> DeviceState:
        """Return the state of the gamepad, at the time of its last full report.

        Full reports come without a break: a gamepad that has lost its connection while
        a stick is held is one without new data, and not one whose stick is held.
        """
        pressed: frozenset[str] = frozenset()
        for report in waiting_reports(self._hid):
            if len(report) >= FULL_REPORT:
                self._heard = self._clock()
            before, self._pad = self._pad, parse_dualsense(report) or self._pad
            pressed |= self._pad.down
            self._drives ^= "l3" in self._pad.down - before.down
        now = self._clock() if self._heard is None else self._heard
        return pad_state(now, self._pad, pressed, drives=self._drives)

    def stop(self) -> None:
        """Close the gamepad."""
        if self._hid is not None:
            self._hid.close()
        self._hid = None


def _byte(x: int) -> float:
    return min(max((x - 127.5) / 127.5, -1.0), 1.0)


def _without_dead_zone(stick: tuple[float, float]) -> tuple[float, float]:
    """Return a stick's deflection without its round dead zone."""
    far = float(np.hypot(*stick))
    factor = max(0.0, far - DEAD) / (1.0 - DEAD) / max(far, 1e-9)
    return stick[0] * factor, stick[1] * factor
