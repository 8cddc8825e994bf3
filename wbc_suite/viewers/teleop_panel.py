"""The panel of the teleoperation page: status, buttons, limbs, grippers and plots."""

import functools
import threading
from collections.abc import Callable
from types import MappingProxyType
from typing import TYPE_CHECKING, Protocol

from wbc_suite.recording.episode_control import EpisodeCommand
from wbc_suite.viewers.balance_overlay import legend_html
from wbc_suite.viewers.drag_handles import HandleMode
from wbc_suite.viewers.drive_panel import DrivePanel
from wbc_suite.viewers.gripper_sliders import GripperSliders
from wbc_suite.viewers.scene_setup import (
    add_views,
    marked,
    set_dark,
    unmarked,
)
from wbc_suite.viewers.session_state import SessionInfo, Snapshot
from wbc_suite.viewers.status_text import (
    limbs_html,
    pause_text,
    status_html,
    task_html,
)
from wbc_suite.viewers.tracking_plots import TrackingPlots

if TYPE_CHECKING:
    import viser

    from wbc_suite.viewers.balance_overlay import BalanceOverlays
    from wbc_suite.viewers.camera_follower import CameraFollower
    from wbc_suite.viewers.camera_pictures import CameraPictures
    from wbc_suite.viewers.drag_handles import DragHandles
    from wbc_suite.viewers.remote_session import Session
    from wbc_suite.viewers.scene_setup import Box, Colour

RECORD_NOTE = (
    "This session has no file to record into. Start it by "
    "`wbc-suite teleop --record FILE`."
)
PAUSE_NOTE = "Only who paused may resume; anybody once they have left."
BUTTON_HINT = (
    "Keys: P pause, 0 reset, C record or keep, Y keep as a success, X discard, "
    "U delete the last episode. Reset and Record return the robot to its start."
)
CLUTCH_HINT = "Engaged: the limb follows its handle. Released: the handle moves alone."
BALANCE_HINT = "Feet, capture point, next footstep and contact forces."
SHADOW_HINT = "Without a graphics card, two thirds of the rendering time."
HELP = "Keys and gestures"
RECORD_KEYS = {
    "C": (EpisodeCommand.RECORD, "Record from the robot's start, or keep the episode"),
    "Y": (EpisodeCommand.SUCCESS, "Keep the episode as a success"),
    "X": (EpisodeCommand.DISCARD, "Discard the episode"),
    "U": (EpisodeCommand.UNDO, "Delete the last episode"),
}


class Page(Protocol):
    """What the panel is given of its page; see `TeleopPage`."""

    session: "Session"
    colours: "MappingProxyType[str, Colour]"
    handles: "DragHandles"
    overlays: "BalanceOverlays"
    pictures: "CameraPictures"
    cameras: "CameraFollower"

    @property
    def server(self) -> "viser.ViserServer":
        """The server of the page."""
        ...

    @property
    def box(self) -> "Box":
        """Corners of a box around the robot, m."""
        ...


class TeleopPanel:
    """Status, buttons, limbs, grippers and plots of a page.

    Elements that all clients share are created once; those that each client has for
    itself are created when it connects.
    """

    def __init__(self, page: Page) -> None:
        self._page, self._session = page, page.session
        self._gui, session = page.server.gui, page.session
        self._info = info = session.info
        self._adding = threading.Lock()
        if info.task:
            self._gui.add_html(task_html(info.task))
        self._status = self._gui.add_html("")
        self._stand_up = self._gui.add_button(
            "Reset after the fall", color="red", visible=False
        )
        self._stand_up.on_click(lambda _: session.reset())
        self._add_buttons()
        self.drive = DrivePanel(self._gui, session) if info.drive.any() else None
        if info.limbs:
            self._limb_folder = self._gui.add_folder("Limbs")
        self._limbs: dict[int, viser.GuiHtmlHandle] = {}
        self._handle_folder = self._gui.add_folder("Handles" if info.limbs else "View")
        if info.limbs:
            self._add_clutches()
        self._grippers: dict[str, GripperSliders] = {}
        if info.grippers:
            with self._gui.add_folder("Grippers"):
                self._grippers = {
                    name: GripperSliders(self._gui, session, name)
                    for name in info.grippers
                }
        with self._gui.add_folder("Tracking and timing"):
            self.plots = TrackingPlots(self._gui, info, page.colours)

    def add_client(self, client: "viser.ClientHandle") -> None:
        """Add the controls that each client has for itself."""
        if self._info.limbs:
            with self._adding, self._limb_folder:  # viser: one thread at a time
                self._limbs[client.client_id] = client.gui.add_html("")
        with self._adding, self._handle_folder:
            if self._info.limbs:
                self._add_handle_controls(client)
            add_views(client, lambda: self._page.box)
            self._page.pictures.add_client(client)
            if self.drive is not None:
                follow = functools.partial(self._page.cameras.follow, client)
                _add_checkbox(client.gui, "Camera follows the robot", follow)
                follow(True)
            if self._info.walks:
                self._add_balance(client)
            with client.gui.add_folder("Show", expand_by_default=False):
                for name, limb in self._info.limbs.items():
                    show = functools.partial(
                        self._page.handles.show, client.client_id, name
                    )
                    _add_checkbox(client.gui, limb.title, show)
                _add_checkbox(
                    client.gui,
                    "Shadows",
                    lambda on: client.scene.configure_default_lights(cast_shadow=on),
                    SHADOW_HINT,
                )
                dark = functools.partial(set_dark, client)
                _add_checkbox(client.gui, "Dark colours", dark, value=False)
            keys = client.gui.add_button(HELP, color="gray", hint="Key: ?")
            keys.on_click(lambda _: _show_help(client, self._info))

    def remove_client(self, client: int) -> None:
        """Forget the controls of a client that has left."""
        self._limbs.pop(client, None)

    def _add_balance(self, client: "viser.ClientHandle") -> None:
        """Add the checkbox that draws the balance for one client, and a legend."""

        def show(shown: bool) -> None:
            self._page.overlays.show(client, shown)
            legend.visible = shown

        _add_checkbox(client.gui, "Balance", show, BALANCE_HINT, value=False)
        legend = client.gui.add_html(legend_html(), visible=False)

    def _add_handle_controls(self, client: "viser.ClientHandle") -> None:
        """Add mode and recall of one client's handles."""
        from viser import Icon

        number, handles = client.client_id, self._page.handles
        mode = client.gui.add_button_group(
            "Drag to",
            marked(HandleMode, HandleMode.MOVE),
            hint="Arrows move, arcs turn. Key: T",
        )
        recall = client.gui.add_button(
            "Bring handles to the limbs",
            icon=Icon.ARROWS_MINIMIZE,
            color="gray",
            hint="For handles that were moved with the clutch released. Key: H",
        )

        def set_mode(chosen: HandleMode) -> None:
            handles.set_mode(number, chosen)
            mode.options = marked(HandleMode, chosen)

        mode.on_click(lambda _: set_mode(HandleMode(unmarked(mode.value))))
        recall.on_click(lambda _: handles.recall(number))
        client.gui.add_command("Move or turn", hotkey="T").on_trigger(
            lambda _: set_mode(handles.mode(number).next())
        )
        client.gui.add_command("Bring handles to the limbs", hotkey="H").on_trigger(
            lambda _: handles.recall(number)
        )

    def _add_clutches(self) -> None:
        with self._gui.add_folder("Clutches", expand_by_default=False):
            for name, limb in self._info.limbs.items():
                engage = functools.partial(self._session.enable, name)
                _add_checkbox(self._gui, limb.title, engage, CLUTCH_HINT)

    def update(self, snapshot: Snapshot) -> None:
        """Display the state of the session."""
        limbs = self._info.limbs  # viser sends only changes
        self._status.content = status_html(snapshot, self._info, self._page.colours)
        self._stand_up.visible = bool(snapshot.fell)
        for client, table in list(self._limbs.items()):
            table.content = limbs_html(
                snapshot, limbs, self._page.colours, client=client
            )
        if self.drive is not None:
            self.drive.update(snapshot)
        for name, sliders in self._grippers.items():
            sliders.update(snapshot.grippers[name])
        self._buttons.options = _buttons(snapshot)

    def _add_buttons(self) -> None:
        gui = self._gui
        self._buttons = gui.add_button_group(
            "Session", _buttons(self._session.snapshot), hint=BUTTON_HINT
        )

        @self._buttons.on_click
        def _(event: "viser.GuiEvent[viser.GuiButtonGroupHandle]") -> None:
            match event.target.value:
                case "Reset":
                    self._session.reset()
                case "Record" | "Keep":
                    self._command_episode(EpisodeCommand.RECORD, event.client)
                case "Discard":
                    self._command_episode(EpisodeCommand.DISCARD, event.client)
                case _:
                    self._toggle(event.client)

        gui.add_command("Pause or resume", hotkey="P").on_trigger(
            lambda event: self._toggle(event.client)
        )
        gui.add_command("Reset", hotkey="0").on_trigger(lambda _: self._session.reset())

        for key, (request, text) in RECORD_KEYS.items():
            command = gui.add_command(text, hotkey=key)  # type: ignore[arg-type]
            command.on_trigger(
                lambda event, r=request: self._command_episode(r, event.client)
            )

    def _command_episode(
        self, command: EpisodeCommand, client: "viser.ClientHandle | None"
    ) -> None:
        if self._info.records:
            self._session.command_episode(command)
        elif client is not None:
            client.add_notification("Record", RECORD_NOTE, auto_close_seconds=8.0)

    def _toggle(self, client: "viser.ClientHandle | None") -> None:
        """Pause; resume if this client paused, or whoever did has left."""
        if client is None:
            return
        snapshot = self._session.snapshot
        if snapshot.paused and snapshot.paused_by not in (None, client.client_id):
            client.add_notification(
                pause_text(snapshot), PAUSE_NOTE, auto_close_seconds=8.0
            )
            return
        self._session.pause(client.client_id, not snapshot.paused)


def _add_checkbox(
    gui: "viser.GuiApi",
    label: str,
    set_value: Callable[[bool], None],
    hint: str = "",
    *,
    value: bool = True,
) -> None:
    """Add a checkbox that calls a function with its value when it changes."""
    box = gui.add_checkbox(label, initial_value=value, hint=hint or None)
    box.on_update(lambda _: set_value(box.value))


def _show_help(client: "viser.ClientHandle", info: SessionInfo) -> None:
    """Show keys and gestures to one client until it closes them."""
    rows = [row for row, is_possible in _help_rows(info) if is_possible]
    with client.gui.add_modal(HELP) as modal:
        table = "\n".join(f"| {key} | {text} |" for key, text in rows)
        client.gui.add_markdown(f"| | |\n|---|---|\n{table}")
        client.gui.add_button("Close").on_click(lambda _: modal.close())


def _help_rows(info: SessionInfo) -> list[tuple[tuple[str, str], bool]]:
    """Return keys and what they do, and whether the session has them."""
    limbs, drives = bool(info.limbs), bool(info.drive.any())
    return [
        (("Drag an arrow, an arc", "move, turn a limb"), limbs),
        (("T", "change between arrows and arcs"), limbs),
        (("H", "bring handles to the limbs"), limbs),
        (("W A S D", "forward, left, back, right"), drives),
        (("Q E", "turn left, right"), drives),
        (("R F", "body up, down"), bool(info.drive[3])),
        (("P", "pause or resume"), True),
        (("0", "reset: the next attempt"), True),
        *(
            ((key, text.lower()), info.records)
            for key, (_, text) in RECORD_KEYS.items()
        ),
        (("Drag the floor", "turn the camera; wheel: closer, farther"), True),
    ]


def _buttons(snapshot: Snapshot) -> tuple[str, ...]:
    held = snapshot.recording is not None and snapshot.recording.recording
    last = ("Keep", "Discard") if held else ("Record",)
    return ("Resume" if snapshot.paused else "Pause", "Reset", *last)
