"""The page of `wbc-suite replay`: recorded episodes with playback controls."""

import html
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wbc_suite.envs import RobotEnv
from wbc_suite.viewers.episode_player import SPEEDS, Clip, EpisodePlayer, PlayerStatus
from wbc_suite.viewers.model_scene import ModelScene, robot_box
from wbc_suite.viewers.page_server import PageServer
from wbc_suite.viewers.scene_setup import add_plot, add_views, set_camera, set_up_scene

if TYPE_CHECKING:
    import viser

PANEL_EVERY = 3  # updates
PLOT_POINTS = 200  # of a curve
EFFORT, REWARD, NOW = "#4a6fa5", "#3f8f5b", "#c8553d"
PLAY, PAUSE, PREVIOUS, NEXT = "Play", "Pause", "Previous", "Next"
SPEED_LABELS: dict[str, float] = dict(
    zip(("¼", "½", "1", "2", "4"), SPEEDS, strict=True)
)
KEYS: dict[str, tuple[str, Callable[[EpisodePlayer], None]]] = {
    "P": ("Play or pause", EpisodePlayer.toggle),
    "N": ("Next episode", lambda player: player.skip(1)),
    "B": ("Previous episode", lambda player: player.skip(-1)),
    "K": ("Step forward", lambda player: player.step_frames(1)),
    "J": ("Step back", lambda player: player.step_frames(-1)),
}
"""Text and command by key."""


class ReplayPage:
    """Serve a player of episodes; a thread of its own advances it and sends updates.

    States are displayed in `env`, until `site`, the server, is stopped.
    """

    def __init__(
        self, player: EpisodePlayer, env: RobotEnv, site: PageServer, *, label: str
    ) -> None:
        self.player, self.site, self._env = player, site, env
        self.server = site.server
        set_up_scene(site, label=label)
        self._clip: Clip | None = None
        self._shape = np.empty(0)
        self._status = self.server.gui.add_html("")
        self._add_controls()
        self._plot = add_plot(
            self.server.gui,
            "Norm of the action (blue), reward (green)",
            {"now": NOW, "action": EFFORT, "reward": REWARD},
        )
        self._display(player.advance())
        box = robot_box(env.simulation.model, env.simulation.data)
        set_camera(self.server, box)
        self.server.on_client_connect(lambda client: add_views(client, lambda: box))

    def start(self) -> None:
        """Start to play."""
        self.site.start_updates(
            lambda n: self._display(self.player.advance(), panel=n % PANEL_EVERY == 0)
        )

    def _display(self, status: PlayerStatus, *, panel: bool = True) -> None:
        """Display the state of the playback."""
        clip, simulation = status.clip, self._env.simulation
        if clip is not None:
            if clip is not self._clip:
                self._insert(clip)
            state = clip.states[status.frame]
            self._env.show_state(state)
            self._scene.update(simulation.data.xpos, simulation.data.xquat)
        if panel or clip is not self._clip:
            self._update_panel(status)

    def _insert(self, clip: Clip) -> None:
        """Display another episode, whose objects may have other sizes and colours."""
        model = self._env.simulation.model
        shape = np.concatenate([model.geom_size.ravel(), model.geom_rgba.ravel()])
        if not np.array_equal(shape, self._shape):
            self._shape = shape
            self._scene = ModelScene(self.server, model)
        self._clip = clip
        self._time.max = max(clip.length, 1e-3)
        self._episode.value = clip.name

    def _update_panel(self, status: PlayerStatus) -> None:
        self._status.content = _status_html(status, self.player.names)
        self._buttons.options = (PREVIOUS, PAUSE if status.playing else PLAY, NEXT)
        if status.clip is not None:
            self._time.value = status.position
            self._plot.data = _curves(status.clip, status.position)

    def _add_controls(self) -> None:
        gui, player = self.server.gui, self.player
        self._buttons = gui.add_button_group(
            "Playback",
            (PREVIOUS, PAUSE, NEXT),
            hint="Keys: P play or pause, N next episode, B previous episode, "
            "K step forward, J step back",
        )
        self._time = gui.add_slider(
            "Time [s]", min=0.0, max=1.0, step=0.01, initial_value=0.0
        )
        speed = gui.add_button_group(
            "Speed", tuple(SPEED_LABELS), hint="1 is as recorded"
        )
        self._episode = gui.add_dropdown(
            "Episode", player.names, initial_value=player.names[0]
        )
        clicks = {PREVIOUS: -1, NEXT: 1}

        @self._buttons.on_click
        def _(event: "viser.GuiEvent[viser.GuiButtonGroupHandle]") -> None:
            if event.target.value in clicks:
                player.skip(clicks[event.target.value])
            else:
                player.toggle()

        @self._time.on_update
        def _(event: "viser.GuiEvent[viser.GuiSliderHandle[float]]") -> None:
            if event.client is not None:  # moved by the user
                player.seek(event.target.value)

        @self._episode.on_update
        def _(event: "viser.GuiEvent[viser.GuiDropdownHandle[str]]") -> None:
            if event.client is not None:
                player.choose(event.target.value)

        speed.on_click(lambda _: player.set_speed(SPEED_LABELS[speed.value]))
        for key, (text, run) in KEYS.items():
            command = gui.add_command(text, hotkey=key)  # type: ignore[arg-type]
            command.on_trigger(lambda _, run=run: run(player))


def _curves(clip: Clip, position: float) -> tuple[NDArray[np.float64], ...]:
    """Return times, a peak at the position, norms of actions, and rewards."""
    every = max(1, len(clip.times) // PLOT_POINTS)
    times = np.array(clip.times[::every], dtype=np.float64)
    now = np.zeros(len(times))
    now[int(np.argmin(np.abs(times - position)))] = 1.0
    curves = (clip.effort[::every], clip.rewards[::every])
    return times, now, *(np.array(c, dtype=np.float64) for c in curves)


def _status_html(status: PlayerStatus, names: tuple[str, ...]) -> str:
    """Return the state of the playback as HTML."""
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
        f"{html.escape(clip.summary)}<br>"
        f'<span style="font-variant-numeric:tabular-nums">{status.position:.2f} of '
        f"{clip.length:.2f} s, step {status.frame} of {len(clip.times) - 1}</span>"
        "</div>"
    )
