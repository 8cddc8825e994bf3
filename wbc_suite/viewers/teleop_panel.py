"""The panel beside the scene: how things stand, and everything that is pressed."""

import html
import threading
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from wbc_suite.devices.limbs import LimbKind
from wbc_suite.recording.desk import Wish
from wbc_suite.typing import Vector
from wbc_suite.viewers.drivable import Drivable, LimbTraits
from wbc_suite.viewers.gizmos import GizmoMode, Gizmos
from wbc_suite.viewers.gripper_sliders import GripperSliders
from wbc_suite.viewers.history import History
from wbc_suite.viewers.palette import css
from wbc_suite.viewers.snapshot import LimbStatus, Snapshot
from wbc_suite.viewers.stage import VIEWS, look_from
from wbc_suite.viewers.words import explain

if TYPE_CHECKING:
    import viser

__all__ = ["TeleopPanel"]

PLOT_SECONDS = 10.0
PLOT_POINTS = 150
WINDOW = 300  # rows: PLOT_SECONDS at the rate at which the page is drawn, and more
RECORD_NOTE = (
    "This session was started without a file to record into. "
    "`wbc-suite teleop --record FILE` records."
)
BUTTON_HINT = (
    "Keys: P to pause, R to reset; C to record and to keep, Y to keep as a success, "
    "X to discard, U to take the last episode back"
)
RECORD_KEYS = {
    "C": (Wish.RECORD, "Record, or keep the episode"),
    "Y": (Wish.SUCCESS, "Keep the episode as a success"),
    "X": (Wish.DISCARD, "Discard the episode"),
    "U": (Wish.UNDO, "Take the last episode back"),
}


class TeleopPanel:
    """Status, buttons, limbs, grippers and plots.

    What all clients share is made once; what each has for itself (how its handles look)
    is made as it connects.

    Args:
        server: Server whose panel it is.
        session: Session that it shows and commands.
        gizmos: The clients' handles.
        colours: Colour of each limb.
        box: Two corners of the robot, which cameras look at.
    """

    def __init__(
        self,
        server: "viser.ViserServer",
        session: Drivable,
        gizmos: Gizmos,
        colours: Mapping[str, tuple[int, int, int]],
        box: tuple[Vector, Vector],
    ) -> None:
        self._server, self._session, self._gizmos = server, session, gizmos
        self._box = box
        self._colours = colours
        traits = self._traits = session.traits
        # Columns: wall time, solve time, then the position error of every limb.
        self._history, self._noted = History(2 + len(traits.limbs), WINDOW), -1
        self._adding = threading.Lock()
        self._status = server.gui.add_html("")
        self._shown = ""
        self._add_buttons()
        with server.gui.add_folder("Limbs"):
            self._limbs = server.gui.add_html("")
        self._handles = server.gui.add_folder("Handles")
        with server.gui.add_folder("Clutches", expand_by_default=False):
            for name, limb in traits.limbs.items():
                self._add_clutch(name, limb.title)
        self._grippers: dict[str, GripperSliders] = {}
        if traits.grippers:
            with server.gui.add_folder("Grippers"):
                self._grippers = {
                    name: GripperSliders(server, session, name)
                    for name in traits.grippers
                }
        with server.gui.add_folder("Tracking and timing"):
            self._error_plot = self._add_error_plot()
            self._time_plot = self._add_time_plot()
        self._limbs_shown = ""

    def add_client(self, client: "viser.ClientHandle") -> None:
        """Add the controls that a client has for itself."""
        from viser import Icon

        number = client.client_id
        with self._adding, self._handles:  # viser takes one thread at a time in it
            mode = client.gui.add_button_group(
                "Drag to",
                _marked(GizmoMode.MOVE),
                hint="Arrows move, arcs turn. Key: T",
            )
            recall = client.gui.add_button(
                "Bring handles to the limbs",
                icon=Icon.ARROWS_MINIMIZE,
                color="gray",
                hint="After a handle was moved alone, with its clutch out. Key: H",
            )
            view = client.gui.add_button_group("See from", tuple(VIEWS))
            with client.gui.add_folder("Show", expand_by_default=False):
                for name, limb in self._traits.limbs.items():
                    self._add_show(client, name, limb.title)
                _add_shadows(client)

        def set_mode(chosen: GizmoMode) -> None:
            self._gizmos.set_mode(number, chosen)
            mode.options = _marked(chosen)

        view.on_click(lambda _: look_from(client, *self._box, VIEWS[view.value]))
        mode.on_click(lambda _: set_mode(_unmarked(mode.value)))
        recall.on_click(lambda _: self._gizmos.recall(number))
        client.gui.add_command("Move or turn", hotkey="T").on_trigger(
            lambda _: set_mode(self._gizmos.mode(number).next())
        )
        client.gui.add_command("Bring handles to the limbs", hotkey="H").on_trigger(
            lambda _: self._gizmos.recall(number)
        )

    def update(self, snapshot: Snapshot) -> None:
        """Write down how things stand."""
        text = _status_html(snapshot, self._traits.limbs, self._colours)
        if text != self._shown:
            self._status.content = self._shown = text
        limbs = _limbs_html(snapshot, self._traits.limbs, self._colours)
        if limbs != self._limbs_shown:
            self._limbs.content = self._limbs_shown = limbs
        for name, sliders in self._grippers.items():
            sliders.update(snapshot.grippers[name])
        if self._buttons.options != (buttons := _buttons(snapshot)):
            self._buttons.options = buttons

    def note(self, snapshot: Snapshot) -> None:
        """Keep what the plots show, once per tick."""
        if snapshot.tick == self._noted:
            return
        self._noted = snapshot.tick
        errors = [status.position_error for status in snapshot.limbs.values()]
        row = [time.monotonic(), snapshot.solve_time, *errors]
        self._history.append(np.array(row))

    def update_plots(self) -> None:
        """Draw the last seconds of errors and solve times."""
        rows = np.asarray(self._history.rows(), dtype=np.float64)
        if len(rows) < 2:
            return
        ago = rows[:, 0] - rows[-1, 0]
        rows, ago = rows[ago > -PLOT_SECONDS], ago[ago > -PLOT_SECONDS]
        step = max(1, len(rows) // PLOT_POINTS)
        rows, ago = rows[::-step][::-1], ago[::-step][::-1]
        errors = [np.ascontiguousarray(column) for column in 1e3 * rows[:, 2:].T]
        self._error_plot.data = (ago, *errors)
        self._time_plot.data = (ago, 1e3 * rows[:, 1])

    def _add_buttons(self) -> None:
        gui = self._server.gui
        self._buttons = gui.add_button_group(
            "Session", _buttons(self._session.snapshot), hint=BUTTON_HINT
        )

        @self._buttons.on_click
        def _(event: "viser.GuiEvent[viser.GuiButtonGroupHandle]") -> None:
            match event.target.value:
                case "Reset":
                    self._session.reset()
                case "Record" | "Keep":
                    self._wish(Wish.RECORD, event.client)
                case "Discard":
                    self._wish(Wish.DISCARD, event.client)
                case _:
                    self._toggle()

        gui.add_command("Pause or go on", hotkey="P").on_trigger(
            lambda _: self._toggle()
        )
        gui.add_command("Reset", hotkey="R").on_trigger(lambda _: self._session.reset())

        for key, (wish, text) in RECORD_KEYS.items():
            command = gui.add_command(text, hotkey=key)  # type: ignore[arg-type]
            command.on_trigger(lambda event, w=wish: self._wish(w, event.client))

    def _wish(self, wish: Wish, client: "viser.ClientHandle | None") -> None:
        if self._traits.records:
            self._session.wish(wish)
        elif client is not None:
            client.add_notification("Record", RECORD_NOTE, auto_close_seconds=8.0)

    def _toggle(self) -> None:
        self._session.pause(not self._session.snapshot.paused)

    def _add_clutch(self, name: str, title: str) -> None:
        box = self._server.gui.add_checkbox(
            title,
            initial_value=True,
            hint="In: the limb follows its handle. Out: the handle moves alone.",
        )
        box.on_update(lambda _: self._session.enable(name, box.value))

    def _add_show(self, client: "viser.ClientHandle", name: str, title: str) -> None:
        box = client.gui.add_checkbox(title, initial_value=True)
        box.on_update(
            lambda _: self._gizmos.show(client.client_id, name, shown=box.value)
        )

    def _add_error_plot(self) -> "viser.GuiUplotHandle":
        limbs = self._traits.limbs
        return self._server.gui.add_uplot(
            data=tuple(np.zeros(2) for _ in range(1 + len(limbs))),
            series=(
                {"label": "s"},
                *(
                    {"label": limb.title, "stroke": css(self._colours[n]), "width": 2}
                    for n, limb in limbs.items()
                ),
            ),
            title="Distance to target [mm]",
            scales={"x": {"time": False}},
            legend={"show": False},
            height=150,
        )

    def _add_time_plot(self) -> "viser.GuiUplotHandle":
        return self._server.gui.add_uplot(
            data=(np.zeros(2), np.zeros(2)),
            series=(
                {"label": "s"},
                {"label": "solve", "stroke": "#4a6fa5", "width": 2},
            ),
            title="Solve time [ms]",
            scales={"x": {"time": False}},
            legend={"show": False},
            height=120,
        )


def _add_shadows(client: "viser.ClientHandle") -> None:
    box = client.gui.add_checkbox(
        "Shadows",
        initial_value=True,
        hint="Two thirds of the work where a browser draws without a graphics card.",
    )
    box.on_update(
        lambda _: client.scene.configure_default_lights(cast_shadow=box.value)
    )


def _buttons(snapshot: Snapshot) -> tuple[str, ...]:
    held = snapshot.recording is not None and snapshot.recording.recording
    last = ("Keep", "Discard") if held else ("Record",)
    return ("Go on" if snapshot.paused else "Pause", "Reset", *last)


def _marked(chosen: GizmoMode) -> tuple[str, ...]:
    """Return the modes' labels with the chosen one marked."""
    return tuple(f"• {mode} •" if mode is chosen else mode.value for mode in GizmoMode)


def _unmarked(label: str) -> GizmoMode:
    return GizmoMode(label.strip("• "))


def _status_html(
    snapshot: Snapshot,
    limbs: Mapping[str, LimbTraits],
    colours: Mapping[str, tuple[int, int, int]],
) -> str:
    state, dot = _state(snapshot)
    latency = _or_dash(1e3 * snapshot.latency, "ms")
    solve = _or_dash(1e3 * snapshot.solve_time, "ms", digits=1)
    speed = _or_dash(snapshot.speed, "x", digits=2)
    figures = (
        ("input to joint target", latency),
        ("solve time", solve),
        ("real time", speed),
    )
    cells = "".join(
        "<div style='flex:auto'><div style='font-size:1.05em;font-weight:600'>"
        f"{value}</div><div style='opacity:.6;font-size:.78em'>{label}</div></div>"
        for label, value in figures
    )
    return (
        "<div style='padding:.5em .7em .6em'>"
        "<div style='font-weight:600;margin-bottom:.5em'>"
        f"<span style='color:{dot}'>&#9679;</span> {html.escape(state)}</div>"
        f"<div style='display:flex;gap:.4em'>{cells}</div>"
        f"{_recording_html(snapshot)}{_why_html(snapshot, limbs, colours)}</div>"
    )


def _recording_html(snapshot: Snapshot) -> str:
    """Say how the recording stands; nothing before anybody asked for one."""
    told = snapshot.recording
    if told is None or not (told.said or told.recording):
        return ""
    if told.recording:
        words = f"Recording episode {told.kept + 1}: {told.length} actions"
    else:
        words = f"{told.said} {told.kept} episode{'s' * (told.kept != 1)} in the file."
    dot = "<span style='color:#c8553d'>&#9679;</span> " if told.recording else ""
    return f"<div style='margin-top:.5em'>{dot}{html.escape(words)}</div>"


def _state(snapshot: Snapshot) -> tuple[str, str]:
    if snapshot.message:
        return snapshot.message, "#c8553d"
    if snapshot.paused:
        return "Paused", "#b08a2e"
    if snapshot.device:
        return ", ".join(snapshot.device).capitalize(), "#b08a2e"
    if snapshot.success:
        return "Solved", "#3f8f5b"
    return f"Running, {snapshot.time:.0f} s", "#3f8f5b"


def _why_html(
    snapshot: Snapshot,
    limbs: Mapping[str, LimbTraits],
    colours: Mapping[str, tuple[int, int, int]],
) -> str:
    lines = [
        "<div style='margin-top:.6em;padding:.4em .6em;border-radius:.3em;"
        f"border-left:.25em solid {css(colours[name])};"
        "background:rgba(200,120,60,.10);font-size:.88em'>"
        f"<b>{html.escape(limbs[name].title)}</b>: {html.escape(why)}</div>"
        for name, status in snapshot.limbs.items()
        if (why := explain(status))
    ]
    return "".join(lines)


def _limbs_html(
    snapshot: Snapshot,
    limbs: Mapping[str, LimbTraits],
    colours: Mapping[str, tuple[int, int, int]],
) -> str:
    rows = "".join(
        _limb_row(
            limbs[name],
            css(colours[name]),
            status,
            switched_to=name == snapshot.switched_to,
        )
        for name, status in snapshot.limbs.items()
    )
    return f"<table style='width:100%;padding:.2em .7em;font-size:.88em'>{rows}</table>"


def _limb_row(
    limb: LimbTraits, colour: str, status: LimbStatus, *, switched_to: bool
) -> str:
    notes = ["switched to"] if switched_to else []
    if status.holder is not None:
        notes.append(f"held by viewer {status.holder + 1}")
    held = html.escape(", ".join([*notes, *status.acting]))
    if limb.kind is LimbKind.ORIENTATION:
        error = f"{np.rad2deg(status.orientation_error):.0f}°"
    else:
        error = f"{1e3 * status.position_error:.0f} mm"
    return (
        f"<tr><td><span style='color:{colour}'>&#9632;</span> "
        f"{html.escape(limb.title)}</td>"
        f"<td style='opacity:.65'>{held}</td>"
        f"<td style='text-align:right'>{error}</td></tr>"
    )


def _or_dash(value: float, unit: str, *, digits: int = 0) -> str:
    return "&ndash;" if np.isnan(value) else f"{value:.{digits}f} {unit}"
