"""The folder of the teleoperation page that drives: pad, speed, hands, readout."""

from typing import TYPE_CHECKING

import numpy as np

from wbc_suite.typing import Vector
from wbc_suite.viewers.scene_setup import marked, unmarked
from wbc_suite.viewers.session_state import Snapshot

if TYPE_CHECKING:
    import viser

    from wbc_suite.viewers.remote_session import Session

FIRST_SPEED = 50  # per cent of the greatest
MOVING = 5e-3  # m/s and rad/s; slower is displayed as standing
PAD = (
    ("KeyQ", "&#8634;", "turn left", 2),
    ("KeyW", "&#9650;", "forward", 0),
    ("KeyE", "&#8635;", "turn right", 2),
    ("KeyR", "up", "up", 3),
    ("KeyA", "&#9664;", "left", 1),
    ("KeyS", "&#9660;", "back", 0),
    ("KeyD", "&#9654;", "right", 1),
    ("KeyF", "down", "down", 3),
)
"""Key, sign, meaning and axis of each button, in rows of four as on a keyboard."""
IN_BODY, IN_WORLD = HOLDS = "Body", "World"
HOLD_HINT = (
    "Body: targets of hands move with the robot. World: they stay where they are."
)
RELEASE_FIRST = "Release the key or the button, and press it again"
SPEED_HINT = "Percentage of top speed, for keys, buttons and sticks."


class DrivePanel:
    """Buttons that are held, speed, and what targets of hands are fixed to.

    Keys and buttons are received by `HeldKeys`.
    """

    def __init__(self, gui: "viser.GuiApi", session: "Session") -> None:
        self._session, self._info = session, session.info
        title = "Walk" if self._info.walks else "Drive"
        with gui.add_folder(title):
            gui.add_html(pad_html(self._info.drive))
            self._readout = gui.add_html("")
            self._speed = gui.add_slider(
                "Speed [%]",
                min=10,
                max=100,
                step=5,
                initial_value=FIRST_SPEED,
                hint=SPEED_HINT,
            )
            self._hold = (
                gui.add_button_group(
                    "Hands stay in", marked(HOLDS, IN_BODY), hint=HOLD_HINT
                )
                if self._info.rides
                else None
            )
        if self._hold is not None:
            hold = self._hold
            hold.on_click(lambda _: session.ride(unmarked(hold.value) == IN_BODY))

    def receive(self, client: int, axes: Vector | None) -> None:
        """Drive by axes forward, left, turn, up, -1 .. 1, shape (4,); None: it left."""
        if axes is None:
            self._session.leave(client)
            return
        share = np.array([self._speed.value / 100.0] * 3 + [1.0])
        self._session.drive(client, axes * share * self._info.drive)

    def update(self, snapshot: Snapshot) -> None:
        """Display the commanded velocity."""
        self._readout.content = velocity_html(snapshot.velocity, snapshot.drive_waits)
        if self._hold is not None:
            chosen = IN_BODY if snapshot.rides else IN_WORLD
            self._hold.options = marked(HOLDS, chosen)


def pad_html(limits: Vector) -> str:
    """Return the buttons that are held; those of an axis with limit 0 are disabled."""
    buttons = "".join(
        f"<button type='button' data-drive='{key}' aria-label='{text}' "
        f"title='{text.capitalize()}: key {key[-1]}'"
        f"{'' if limits[axis] else ' disabled'}>"
        f"<b>{key[-1]}</b> <span style='opacity:.7;font-size:.85em'>{sign}</span>"
        "</button>"
        for key, sign, text, axis in PAD
    )
    return (
        "<div style='display:grid;grid-template-columns:repeat(3,1fr) 1.3fr;"
        f"gap:.35em;padding:.4em .8em .2em'>{buttons}</div>"
    )


def velocity_html(velocity: Vector, waits: bool = False) -> str:
    """Return the commanded velocity in words, or what has to be done first."""
    forward, left, turn, up = velocity
    parts = [
        f"{abs(value):.2f} {unit} {positive if value > 0 else negative}"
        for value, unit, positive, negative in (
            (forward, "m/s", "forward", "back"),
            (left, "m/s", "left", "right"),
            (turn, "rad/s", "to the left", "to the right"),
            (up, "m/s", "up", "down"),
        )
        if abs(value) > MOVING
    ]
    idle = RELEASE_FIRST if waits else "Hold a key or a button"
    text = ", ".join(parts) or idle
    return f"<div style='padding:0 .9em;font-size:.82em;opacity:.7'>{text}</div>"
