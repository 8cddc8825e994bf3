"""SpaceMouse: six axes for one hand, or one mouse for each hand."""

import struct
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from wbc_suite.devices.hid import open_hid, waiting_reports
from wbc_suite.devices.state import DeviceState, LimbInput
from wbc_suite.typing import Vector

VENDORS = (0x256F, 0x046D)  # 3Dconnexion, and Logitech for models before 2013
PRODUCTS = (
    0xC62E, 0xC62F, 0xC631, 0xC632, 0xC633, 0xC635, 0xC652, 0xC63A,  # 3Dconnexion
    0xC603, 0xC605, 0xC606, 0xC621, 0xC623, 0xC625, 0xC626, 0xC627, 0xC628, 0xC629,
    0xC62B,
)  # fmt: skip
FULL = 350.0  # counts at full deflection; vendor's nominal range
DEAD = 0.06  # dead zone, as a fraction of full deflection
EXPONENT = 1.6  # of the response, which is finer near rest
SPEED, TURN = 0.35, 1.2  # m/s and rad/s at full deflection
SHARED = {0: "grip", 1: "next"}  # buttons of a mouse for the selected hand
TIMEOUT = 0.3  # s; a mouse at rest sends no reports

_TO_OURS = np.array([[0, -1, 0], [-1, 0, 0], [0, 0, -1]], dtype=np.float64)
"""From the mouse's axes (right, backward, down) to forward, left, up."""


def parse_axes(report: bytes, axes: Vector) -> Vector:
    """Return the deflections after a report, in the mouse's axes, shape (6,).

    Full deflection is 1. Report 1 is translation, or all six axes in newer models; 2 is
    rotation; others are ignored. Values are little-endian, 16 bits.
    """
    axes = axes.copy()
    count = 6 if len(report) >= 13 and report[0] == 1 else 3
    if len(report) < 1 + 2 * count or report[0] not in (1, 2):
        return axes
    values = np.array(struct.unpack_from(f"<{count}h", report, 1)) / FULL
    start = 0 if report[0] == 1 else 3
    axes[start : start + count] = np.clip(values, -1.0, 1.0)
    return axes


def parse_buttons(report: bytes) -> frozenset[int] | None:
    """Return the numbers of the pressed buttons in a report, or None."""
    if len(report) < 2 or report[0] != 3:
        return None
    bits = int.from_bytes(report[1:5], "little")
    return frozenset(k for k in range(32) if bits >> k & 1)


def shaped(axes: Vector) -> Vector:
    """Return deflections with dead zone and exponent applied, shape (6,)."""
    beyond = np.maximum(np.abs(axes) - DEAD, 0.0) / (1.0 - DEAD)
    return np.sign(axes) * beyond**EXPONENT


class _Mouse:
    """State of one mouse."""

    def __init__(self, hid: Any) -> None:
        self.hid = hid
        self.axes: Vector = np.zeros(6)
        self.buttons: frozenset[int] = frozenset()
        self.closed = False
        self.last_report = -np.inf

    def drain(self, now: float) -> frozenset[int]:
        """Read the queued reports; return the buttons that were pressed."""
        pressed: frozenset[int] = frozenset()
        for report in waiting_reports(self.hid):
            self.last_report = now
            self.axes = parse_axes(report, self.axes)
            down = parse_buttons(report)
            if down is not None:
                pressed |= down - self.buttons
                self.buttons = down
        if now - self.last_report > TIMEOUT:
            self.axes = np.zeros(6)
        return pressed

    def twist(self) -> Vector:
        """Return the velocity: forward, left, up, m/s and rad/s, shape (6,)."""
        linear, angular = shaped(self.axes).reshape(2, 3) @ _TO_OURS.T
        return np.concatenate([SPEED * linear, TURN * angular])


class SpaceMouse:
    """One SpaceMouse for the selected hand, or one for each hand.

    The left button closes and opens the gripper. The right one selects the next hand,
    or moves all hands home if each has a mouse. `hands` has the limb of each mouse, in
    the order in which they are found.
    """

    help = "SpaceMouse: left button closes and opens, right button: next hand.\n"

    def __init__(
        self,
        hands: Sequence[str] = ("hand",),
        find: Callable[[], list[Any]] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._hands, self._clock = tuple(hands), clock
        self._find = find or (
            lambda: open_hid("SpaceMouse", VENDORS, PRODUCTS, len(self._hands))
        )
        self._mice: list[_Mouse] = []

    def start(self) -> None:
        """Open the mice; raises DeviceError if there are too few."""
        self._mice = [_Mouse(hid) for hid in self._find()]

    def read(self) -> DeviceState:
        """Return the state of all mice."""
        now, limbs = self._clock(), {}
        buttons: set[str] = set()
        for name, mouse in zip(self._hands, self._mice, strict=False):
            pressed = mouse.drain(now)
            if name == "hand":
                buttons |= {SHARED[number] for number in pressed & SHARED.keys()}
                limbs[name] = LimbInput(twist=mouse.twist())
                continue
            if 0 in pressed:
                mouse.closed = not mouse.closed
            if 1 in pressed:
                buttons.add("home")
            grip = np.array(1.0 if mouse.closed else -1.0)
            limbs[name] = LimbInput(twist=mouse.twist(), grip=grip)
        return DeviceState(time=now, limbs=limbs, buttons=frozenset(buttons))

    def stop(self) -> None:
        """Close the mice."""
        for mouse in self._mice:
            mouse.hid.close()
        self._mice = []
