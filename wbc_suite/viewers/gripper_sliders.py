"""Sliders that set a gripper and display what devices and other clients command."""

import time
from typing import TYPE_CHECKING

import numpy as np

from wbc_suite.typing import Vector
from wbc_suite.viewers.session_state import plain

if TYPE_CHECKING:
    import viser

    from wbc_suite.viewers.remote_session import Session

    Slider = viser.GuiSliderHandle[float]
    Event = viser.GuiEvent[Slider]

STEP = 0.02  # of the closing, -1 .. 1
USER_TIME = 1.0  # s; after the user moved a slider, it is not updated for so long


class GripperSliders:
    """A slider for the whole gripper and, below it, one per synergy."""

    def __init__(self, gui: "viser.GuiApi", session: "Session", name: str) -> None:
        self._gui, self._session, self._name = gui, session, name
        self._touched = -np.inf  # time
        labels, goal = session.info.grippers[name], session.snapshot.grippers[name]
        self._whole = self._add(plain(name).capitalize(), float(np.mean(goal)))
        self._fingers: list[Slider] = []
        if len(labels) > 1:
            with gui.add_folder("Fingers", expand_by_default=False):
                self._fingers = [
                    self._add(plain(label), float(value))
                    for label, value in zip(labels, goal, strict=True)
                ]
        self._whole.on_update(self._close_all)
        for index, finger in enumerate(self._fingers):
            finger.on_update(lambda event, i=index: self._close_one(event, i))

    def update(self, goal: Vector) -> None:
        """Display the commanded closing, shape (synergies,)."""
        if time.monotonic() - self._touched < USER_TIME:
            return
        _show(self._whole, float(np.mean(goal)))
        for finger, value in zip(self._fingers, goal, strict=False):
            _show(finger, float(value))

    def touch(self) -> None:
        """Record that the user moves them now."""
        self._touched = time.monotonic()

    def _close_all(self, event: "Event") -> None:
        if event.client is None:  # moved by `update`
            return
        self.touch()
        for index in range(len(self._session.info.grippers[self._name])):
            self._session.set_gripper(self._name, index, self._whole.value)
        for finger in self._fingers:
            _show(finger, self._whole.value)

    def _close_one(self, event: "Event", index: int) -> None:
        if event.client is None:
            return
        self.touch()
        self._session.set_gripper(self._name, index, self._fingers[index].value)

    def _add(self, label: str, value: float) -> "Slider":
        return self._gui.add_slider(
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
