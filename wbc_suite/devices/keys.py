"""What keys mean: the same in a terminal and on a page."""

from collections.abc import Set

import numpy as np

from wbc_suite.devices.state import DeviceState, LimbInput

__all__ = ["BUTTONS", "HELP", "JOG", "KeyJog"]

SPEED = 0.25  # m/s, of a key that is held
TURN = 0.8  # rad/s
BASE_SPEED, BASE_TURN = 0.4, 0.6  # m/s and rad/s
FACTOR = 1.5  # of `+` and `-`
SLOWEST, FASTEST = 0.1, 4.0

JOG: dict[str, tuple[int, float]] = {
    "w": (0, 1), "s": (0, -1), "a": (1, 1), "d": (1, -1), "r": (2, 1), "f": (2, -1),
    "u": (3, -1), "o": (3, 1), "i": (4, 1), "k": (4, -1), "j": (5, 1), "l": (5, -1),
}  # fmt: skip
"""Key to the component of the twist that it moves, and its sign."""

BASE_JOG: dict[str, tuple[int, float]] = {
    "up": (0, 1), "down": (0, -1), ",": (1, 1), ".": (1, -1),
    "left": (2, 1), "right": (2, -1),
}  # fmt: skip
"""Key to the component of the base's velocity, and its sign."""

BUTTONS = {
    " ": "grip", "tab": "next", "m": "mirror", "h": "home", "p": "pause", "0": "reset",
    "enter": "keep", "backspace": "discard", "z": "undo", "escape": "quit",
}  # fmt: skip
"""Key to the button that it stands for."""

HELP = """\
  w s  forward, back     u o  roll       space  open or close the gripper
  a d  left, right       i k  pitch      tab    next hand      m  mirror
  r f  up, down          j l  yaw        + -    faster, slower  h  home
  arrows , .  drive and turn the base    p pause  0 reset  esc quit
  enter  keep the episode    backspace  discard it    z  undo
"""


class KeyJog:
    """Turns keys into velocities of the hand that is switched to.

    Attributes:
        pace: Factor of all speeds.
    """

    def __init__(self) -> None:
        self.pace = 1.0

    def press(self, key: str) -> None:
        """Note a key that went down: what changes the pace."""
        if key in ("+", "=", "-"):
            pace = self.pace * (1.0 / FACTOR if key == "-" else FACTOR)
            self.pace = min(max(pace, SLOWEST), FASTEST)

    def state(self, time: float, held: Set[str], pressed: Set[str]) -> DeviceState:
        """Return what the keys say now.

        Args:
            time: s.
            held: Keys that are down.
            pressed: Keys that went down since the last state.
        """
        twist = np.zeros(6)
        for key in held & JOG.keys():
            index, sign = JOG[key]
            twist[index] += sign * self.pace * (SPEED if index < 3 else TURN)
        base = np.zeros(3)
        for key in held & BASE_JOG.keys():
            index, sign = BASE_JOG[key]
            base[index] += sign * self.pace * (BASE_SPEED if index < 2 else BASE_TURN)
        return DeviceState(
            time=time,
            limbs={"hand": LimbInput(twist=twist)},
            base=base,
            buttons=frozenset(BUTTONS[key] for key in pressed & BUTTONS.keys()),
        )
