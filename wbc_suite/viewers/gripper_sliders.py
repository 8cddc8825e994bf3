"""The sliders of one gripper: people move them, and they show what others command."""

import time
from typing import TYPE_CHECKING

import numpy as np

from wbc_suite.typing import Vector
from wbc_suite.viewers.drivable import Drivable
from wbc_suite.viewers.words import plain

if TYPE_CHECKING:
    import viser

    Slider = viser.GuiSliderHandle[float]
    Event = viser.GuiEvent[Slider]

__all__ = ["GripperSliders"]

STEP = 0.02
OWN = 1.0  # s; so long after a person's touch a slider is left to the person


class GripperSliders:
    """A slider for the whole gripper and, below it, one per synergy.

    Args:
        server: Server whose panel they are on.
        session: Session that they command.
        name: The gripper.
    """

    def __init__(
        self, server: "viser.ViserServer", session: Drivable, name: str
    ) -> None:
        self._server, self._session, self._name = server, session, name
        self._touched = -np.inf  # time
        labels, goal = session.traits.grippers[name], session.snapshot.grippers[name]
        self._whole = self._add(plain(name).capitalize(), float(np.mean(goal)))
        self._fingers: list[Slider] = []
        if len(labels) > 1:
            with server.gui.add_folder("Fingers", expand_by_default=False):
                self._fingers = [
                    self._add(plain(label), float(value))
                    for label, value in zip(labels, goal, strict=True)
                ]
        self._whole.on_update(self._close_all)
        for index, finger in enumerate(self._fingers):
            finger.on_update(lambda event, i=index: self._close_one(event, i))

    def update(self, goal: Vector) -> None:
        """Show what is commanded, by whomever, shape (synergies,)."""
        if time.monotonic() - self._touched < OWN:
            return
        _show(self._whole, float(np.mean(goal)))
        for finger, value in zip(self._fingers, goal, strict=False):
            _show(finger, float(value))

    def touch(self) -> None:
        """Note that a person moves them now."""
        self._touched = time.monotonic()

    def _close_all(self, event: "Event") -> None:
        if event.client is None:  # `update` moved it
            return
        self.touch()
        for index in range(len(self._session.traits.grippers[self._name])):
            self._session.set_gripper(self._name, index, self._whole.value)
        for finger in self._fingers:
            _show(finger, self._whole.value)

    def _close_one(self, event: "Event", index: int) -> None:
        if event.client is None:
            return
        self.touch()
        self._session.set_gripper(self._name, index, self._fingers[index].value)

    def _add(self, label: str, value: float) -> "Slider":
        return self._server.gui.add_slider(
            label,
            min=-1.0,
            max=1.0,
            step=STEP,
            initial_value=float(np.clip(value, -1.0, 1.0)),
            marks=((-1.0, "open"), (1.0, "closed")),
        )


def _show(slider: "Slider", value: float) -> None:
    if abs(slider.value - value) > 0.5 * STEP:
        slider.value = value
