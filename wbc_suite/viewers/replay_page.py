"""The replay page: recorded episodes in the browser, to be played and wound."""

import html
import logging
import threading
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wbc_suite.envs import RobotEnv
from wbc_suite.envs.states import write_physics
from wbc_suite.viewers.scene_mirror import SceneMirror, robot_box
from wbc_suite.viewers.site import Site
from wbc_suite.viewers.stage import VIEWS, look_from, set_camera, set_stage
from wbc_suite.viewers.tape import SPEEDS, Clip, Tape, TapeStatus

if TYPE_CHECKING:
    import viser

__all__ = ["ReplayPage"]

log = logging.getLogger(__name__)

PUSH_RATE = 25.0  # Hz
PANEL_EVERY = 3  # pushes
PLOT_POINTS = 200
EFFORT, REWARD, NOW = "#4a6fa5", "#3f8f5b", "#c8553d"
PLAY, PAUSE, BACK, ON = "Play", "Pause", "Before", "Next"
SPEED_LABELS: dict[str, float] = dict(
    zip(("¼", "½", "1", "2", "4"), SPEEDS, strict=True)
)


class ReplayPage:
    """Serve a tape; it is turned, and everything is sent, by a thread of its own.

    Args:
        tape: Its clips are of `env`.
        env: Environment that clips put their states into.
        site: Where the page is served; the page closes it when it stops.
        label: What the panel is called.
    """

    def __init__(self, tape: Tape, env: RobotEnv, site: Site, *, label: str) -> None:
        self.tape, self.site, self._env = tape, site, env
        self.server = site.server
        set_stage(self.server, label=label)
        self._clip: Clip | None = None
        self._shape = np.empty(0)
        self._status = self.server.gui.add_html("")
        self._shown = ""
        self._add_controls()
        self._plot = self._add_plot()
        self._turn(tape.turn())
        data = env.simulation.data
        self._box = robot_box(env.simulation.model, data.xpos, data.xquat)
        set_camera(self.server, *self._box)
        self.server.on_client_connect(self._connect)
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="replay", daemon=True)

    def start(self) -> None:
        """Begin to play."""
        self._thread.start()

    def stop(self) -> None:
        """Stop, and close the server."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join()
        self.site.stop()

    def _run(self) -> None:
        count = 0
        while not self._stopping.wait(1.0 / PUSH_RATE):
            status = self.tape.turn()
            try:
                self._turn(status, panel=count % PANEL_EVERY == 0)
            except RuntimeError:
                # A client came or went while viser woke all of them; the next push
                # sends what is missing.
                log.debug("The page missed a push", exc_info=True)
            count += 1

    def _turn(self, status: TapeStatus, *, panel: bool = True) -> None:
        """Show where the tape stands."""
        clip, simulation = status.clip, self._env.simulation
        if clip is not None:
            if clip is not self._clip:
                self._insert(clip)
            state = clip.states[status.frame]
            write_physics(simulation.model, simulation.data, state)
            simulation.forward()
            self._mirror.update(simulation.data.xpos, simulation.data.xquat)
        if panel or clip is not self._clip:
            self._update_panel(status)

    def _insert(self, clip: Clip) -> None:
        """Take an episode in: its objects may have other sizes and colours."""
        model = self._env.simulation.model
        shape = np.concatenate([model.geom_size.ravel(), model.geom_rgba.ravel()])
        if not np.array_equal(shape, self._shape):
            self._shape = shape
            self._mirror = SceneMirror(self.server, model)
        self._clip = clip
        self._time.max = max(clip.length, 1e-3)
        self._episode.value = clip.name

    def _update_panel(self, status: TapeStatus) -> None:
        text = _status_html(status, self.tape.names)
        if text != self._shown:
            self._status.content = self._shown = text
        wanted = (BACK, PAUSE if status.playing else PLAY, ON)
        if self._buttons.options != wanted:
            self._buttons.options = wanted
        if status.clip is not None:
            if abs(self._time.value - status.position) > 1e-3:
                self._time.value = status.position
            self._plot.data = _curves(status.clip, status.position)

    def _add_controls(self) -> None:
        gui, tape = self.server.gui, self.tape
        self._buttons = gui.add_button_group(
            "Tape",
            (BACK, PAUSE, ON),
            hint="Keys: P plays and pauses; N and B: next episode, and the one before; "
            "K and J: one step on, and back",
        )
        self._time = gui.add_slider(
            "Time [s]", min=0.0, max=1.0, step=0.01, initial_value=0.0
        )
        speed = gui.add_button_group(
            "Speed", tuple(SPEED_LABELS), hint="Times as fast as recorded"
        )
        self._episode = gui.add_dropdown(
            "Episode", tape.names, initial_value=tape.names[0]
        )

        @self._buttons.on_click
        def _(event: "viser.GuiEvent[viser.GuiButtonGroupHandle]") -> None:
            match event.target.value:
                case value if value == BACK:
                    tape.skip(-1)
                case value if value == ON:
                    tape.skip(1)
                case _:
                    tape.toggle()

        @self._time.on_update
        def _(event: "viser.GuiEvent[viser.GuiSliderHandle[float]]") -> None:
            if event.client is not None:  # a person, not the tape
                tape.seek(event.target.value)

        @self._episode.on_update
        def _(event: "viser.GuiEvent[viser.GuiDropdownHandle[str]]") -> None:
            if event.client is not None:
                tape.choose(event.target.value)

        speed.on_click(lambda _: tape.set_speed(SPEED_LABELS[speed.value]))
        gui.add_command("Play or pause", hotkey="P").on_trigger(lambda _: tape.toggle())
        gui.add_command("Next episode", hotkey="N").on_trigger(lambda _: tape.skip(1))
        gui.add_command("Episode before", hotkey="B").on_trigger(
            lambda _: tape.skip(-1)
        )
        gui.add_command("One step on", hotkey="K").on_trigger(lambda _: tape.nudge(1))
        gui.add_command("One step back", hotkey="J").on_trigger(
            lambda _: tape.nudge(-1)
        )

    def _add_plot(self) -> "viser.GuiUplotHandle":
        return self.server.gui.add_uplot(
            data=tuple(np.zeros(2) for _ in range(4)),
            series=(
                {"label": "s"},
                {"label": "now", "stroke": NOW, "width": 1},
                {"label": "action", "stroke": EFFORT, "width": 2},
                {"label": "reward", "stroke": REWARD, "width": 2},
            ),
            title="Size of the action (blue), reward (green)",
            scales={"x": {"time": False}},
            legend={"show": False},
            height=150,
        )

    def _connect(self, client: "viser.ClientHandle") -> None:
        view = client.gui.add_button_group("See from", tuple(VIEWS))
        view.on_click(lambda _: look_from(client, *self._box, VIEWS[view.value]))


def _curves(clip: Clip, position: float) -> tuple[NDArray[np.float64], ...]:
    """Return times, a peak at the position, sizes of actions, and rewards."""
    every = max(1, len(clip.times) // PLOT_POINTS)
    times = np.array(clip.times[::every], dtype=np.float64)
    now = np.zeros(len(times))
    now[int(np.argmin(np.abs(times - position)))] = 1.0
    curves = (clip.effort[::every], clip.rewards[::every])
    return times, now, *(np.array(c, dtype=np.float64) for c in curves)


def _status_html(status: TapeStatus, names: tuple[str, ...]) -> str:
    """Write what is shown, and of what."""
    if status.clip is None:
        return (
            '<div style="padding:0.4em 0.9em;color:#c8553d">'
            f"{html.escape(status.error) or 'Loading …'}</div>"
        )
    clip = status.clip
    number = names.index(clip.name) + 1
    return (
        '<div style="padding:0.4em 0.9em;line-height:1.5">'
        f"<b>{html.escape(clip.name)}</b> "
        f'<span style="color:#6b7787">{number} of {len(names)}</span><br>'
        f"{html.escape(clip.told)}<br>"
        f'<span style="font-variant-numeric:tabular-nums">{status.position:.2f} of '
        f"{clip.length:.2f} s, step {status.frame} of {len(clip.times) - 1}</span>"
        "</div>"
    )
