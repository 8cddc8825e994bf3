"""Playback of recorded episodes: play, pause, seek, speed, next and previous.

`ReplayPage` shows it in a page, `show_in_window` in MuJoCo's own window.
"""

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from wbc_suite.devices.mjgui import open_window
from wbc_suite.envs import RobotEnv
from wbc_suite.errors import DatasetError
from wbc_suite.recording import Dataset, Episode
from wbc_suite.recording.replaying import play_actions, start_as
from wbc_suite.typing import Matrix, Vector

SPEEDS = (0.25, 0.5, 1.0, 2.0, 4.0)  # recorded time per wall time
PAUSE = 1.0  # s, between the end of an episode and the next one
FRAME_PERIOD = 1.0 / 60.0  # s, of MuJoCo's window


@dataclass(frozen=True, kw_only=True, slots=True)
class Clip:
    """One episode, ready to be displayed.

    Attributes:
        states: Physics states, shape (n, size), n >= 1.
        times: Their times since the first, s, shape (n,).
        effort: Norm of the action at each state, scaled to 0 .. 1, shape (n,).
        rewards: Reward of each action, shape (n,).
        summary: Success, and how the states were obtained.
    """

    name: str
    states: Matrix
    times: Vector
    effort: Vector
    rewards: Vector
    summary: str

    @property
    def length(self) -> float:
        """Duration, s."""
        return float(self.times[-1])


@dataclass(frozen=True, slots=True)
class PlayerStatus:
    """State of the playback.

    Attributes:
        clip: The episode; None before the first `advance` and after an error.
        frame: Index of the displayed state.
        position: Time since the start of the episode, s.
        error: Why the chosen episode cannot be displayed; else empty.
    """

    clip: Clip | None
    frame: int
    position: float
    playing: bool
    error: str = ""


class EpisodePlayer:
    """Play episodes one after the other; commands may come from any thread.

    `load` loads one by its name, in the thread that calls `advance`.
    """

    def __init__(
        self,
        names: Sequence[str],
        load: Callable[[str], Clip],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        if not names:
            raise DatasetError("There are no episodes to play.")
        self.names = tuple(names)
        self._load, self._clock, self._lock = load, clock, threading.RLock()
        self._clip: Clip | None = None
        self._loaded = self._wanted = 0
        self._position, self._speed, self._playing = 0.0, 1.0, True
        self._error, self._advanced = "", clock()

    @property
    def status(self) -> PlayerStatus:
        """State of the playback."""
        with self._lock:
            clip, frame, position = self._clip, 0, 0.0
            if clip is not None:
                position = min(self._position, clip.length)
                after = np.searchsorted(clip.times, position + 1e-9, side="right")
                frame = int(after) - 1
            return PlayerStatus(clip, frame, position, self._playing, self._error)

    def toggle(self) -> None:
        """Pause or resume; at the end, play from the start."""
        with self._lock:
            self._playing = not self._playing
            if self._playing and self._clip and self._position >= self._clip.length:
                self._position = 0.0

    def seek(self, position: float) -> None:
        """Go to a time of the episode, s."""
        with self._lock:
            longest = self._clip.length if self._clip else 0.0
            self._position = float(np.clip(position, 0.0, longest))

    def step_frames(self, frames: int) -> None:
        """Pause, and move by a number of states, forward or back."""
        with self._lock:
            self._playing = False
            if self._clip is not None:
                last = len(self._clip.times) - 1
                at = int(np.clip(self.status.frame + frames, 0, last))
                self._position = float(self._clip.times[at])

    def choose(self, name: str) -> None:
        """Go to the start of an episode."""
        self._go_to(self.names.index(name))

    def skip(self, episodes: int) -> None:
        """Move by a number of episodes; the first follows the last."""
        with self._lock:
            self._go_to((self._wanted + episodes) % len(self.names))

    def set_speed(self, speed: float) -> None:
        """Set the playback speed."""
        with self._lock:
            self._speed = speed

    def advance(self) -> PlayerStatus:
        """Advance to the current time; load the next or the chosen episode."""
        with self._lock:
            wanted = self._wanted
            missing = self._clip is None or wanted != self._loaded
        if missing and not self._error:
            try:
                clip, error = self._load(self.names[wanted]), ""
            except DatasetError as failure:
                clip, error = None, str(failure)
            with self._lock:
                self._clip, self._loaded, self._error = clip, wanted, error
                self._advanced = self._clock()
        with self._lock:
            now = self._clock()
            elapsed, self._advanced = now - self._advanced, now
            if self._clip is not None and self._playing:
                self._position += self._speed * elapsed
                if self._position > self._clip.length + PAUSE * self._speed:
                    self.skip(1)
            return self.status

    def _go_to(self, wanted: int) -> None:
        with self._lock:
            self._wanted, self._position, self._error = wanted, 0.0, ""


def open_player(
    dataset: Dataset, names: Sequence[str], env: RobotEnv, *, by_states: bool
) -> EpisodePlayer:
    """Return a player of episodes of a dataset, which must stay open.

    They are loaded in `env`, by the thread of `advance`. With `by_states` recorded
    states are displayed; else actions are replayed.
    """
    return EpisodePlayer(
        names, lambda name: load_clip(env, dataset.episode(name), by_states=by_states)
    )


def load_clip(env: RobotEnv, episode: Episode, *, by_states: bool) -> Clip:
    """Return an episode's states; the scene of `env` is then the episode's.

    Raises:
        DatasetError: If it cannot be replayed in this environment.
    """
    start_as(env, episode)
    words = [{None: "", True: "success", False: "no success"}[episode.success]]
    if by_states:
        states = list(episode.columns["states"])
        if episode.final_state is not None:
            states.append(episode.final_state)
        words.append("recorded states")
    else:
        states, worst = [env.physics_state], 0.0
        for _, difference, _ in play_actions(env, episode):
            states.append(env.physics_state)
            worst = max(worst, float(np.abs(difference).max()))
        inexact = f"replayed actions, largest difference {worst:.1e}"
        words.append("bit for bit as recorded" if worst == 0.0 else inexact)
    count = len(states)
    stacked = np.array(states)
    passed = stacked[:, 0] - stacked[0, 0]
    if not (np.diff(passed) > 0.0).all():
        passed = np.arange(count) / env.config.control_freq
    size = np.linalg.norm(episode.columns["actions"], axis=1)
    rewards = episode.columns.get("rewards", np.zeros(episode.length))
    return Clip(
        name=episode.name,
        states=stacked,
        times=passed,
        effort=_fitted(size / max(float(size.max(initial=0.0)), 1e-9), count),
        rewards=_fitted(rewards, count),
        summary=", ".join(word for word in words if word),
    )


def _fitted(values: Vector, count: int) -> Vector:
    """Return one value for each state: cut, or padded with the last one."""
    padded = np.concatenate([values, np.repeat(values[-1:], max(count, 1))])
    return np.asarray(padded[:count], dtype=np.float64)


WINDOW_KEYS: dict[int, Callable[[EpisodePlayer], None]] = {
    32: EpisodePlayer.toggle,  # space
    262: lambda player: player.step_frames(1),  # right
    263: lambda player: player.step_frames(-1),  # left
    264: lambda player: player.skip(1),  # down
    265: lambda player: player.skip(-1),  # up
}
"""Commands by GLFW key code."""


def show_in_window(
    player: EpisodePlayer, env: RobotEnv, launch: Callable[..., Any] | None = None
) -> None:
    """Play episodes until the window is closed.

    Space pauses and resumes; left and right step by a state, up and down by an episode.
    `launch` opens a window, MuJoCo's passive viewer by default.

    Raises:
        DeviceError: If there is no display.
    """
    model, data = env.simulation.model, env.simulation.data

    def press(key: int) -> None:
        if key in WINDOW_KEYS:
            WINDOW_KEYS[key](player)

    player.advance()
    hidden = {"show_left_ui": False, "show_right_ui": False}
    with (launch or open_window)(model, data, key_callback=press, **hidden) as window:
        while window.is_running():
            due = time.monotonic() + FRAME_PERIOD
            with window.lock():
                status = player.advance()
                if status.clip is not None:
                    env.show_state(status.clip.states[status.frame])
            window.sync()
            time.sleep(max(0.0, due - time.monotonic()))
