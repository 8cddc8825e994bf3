"""Recorded episodes as a tape: played, paused, wound, faster and slower."""

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from wbc_suite.envs import RobotEnv
from wbc_suite.errors import DatasetError
from wbc_suite.recording import Dataset, Episode
from wbc_suite.recording.replaying import play_actions, start_as
from wbc_suite.typing import Matrix, Vector

__all__ = ["SPEEDS", "Clip", "Tape", "TapeStatus", "make_clip", "open_tape"]

SPEEDS = (0.25, 0.5, 1.0, 2.0, 4.0)
PAUSE = 1.0  # s, that the end of an episode is shown before the next one


@dataclass(frozen=True, kw_only=True, slots=True)
class Clip:
    """One episode, ready to be shown.

    Attributes:
        name: Of the episode.
        states: Physics states, shape (n, 1 + nq + nv), n >= 1.
        times: Of them, from 0 on, s, shape (n,).
        effort: Size of the action taken at each state, 0 to 1, shape (n,).
        rewards: Of it, shape (n,).
        told: What is known of the episode, in words.
    """

    name: str
    states: Matrix
    times: Vector
    effort: Vector
    rewards: Vector
    told: str

    @property
    def length(self) -> float:
        """Duration, s."""
        return float(self.times[-1])


@dataclass(frozen=True, kw_only=True, slots=True)
class TapeStatus:
    """Where a tape stands.

    Attributes:
        clip: What is in it; None before the first `turn`.
        frame: Which state is shown.
        position: Since the beginning of the clip, s.
        playing: Whether it runs.
        speed: How fast; 1 is as recorded.
        error: Why the episode that was chosen cannot be shown; else empty.
    """

    clip: Clip | None
    frame: int
    position: float
    playing: bool
    speed: float
    error: str = ""


class Tape:
    """Episodes one after the other; what people press may come from any thread.

    Args:
        names: Of the episodes.
        load: Makes a clip of one; called by the thread that calls `turn` only.
        clock: Source of time, s.
    """

    def __init__(
        self,
        names: Sequence[str],
        load: Callable[[str], Clip],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        if not names:
            raise DatasetError("There are no episodes to show.")
        self.names = tuple(names)
        self._load, self._clock, self._lock = load, clock, threading.Lock()
        self._clip: Clip | None = None
        self._loaded = self._wanted = 0
        self._position, self._speed, self._playing = 0.0, 1.0, True
        self._error, self._turned = "", clock()

    @property
    def status(self) -> TapeStatus:
        """Where the tape stands."""
        with self._lock:
            return self._status()

    def toggle(self) -> None:
        """Pause, or go on; at the end from the beginning."""
        with self._lock:
            self._playing = not self._playing
            if self._playing and self._clip and self._position >= self._clip.length:
                self._position = 0.0

    def seek(self, position: float) -> None:
        """Go to a time of the episode, s."""
        with self._lock:
            longest = self._clip.length if self._clip else 0.0
            self._position = float(np.clip(position, 0.0, longest))

    def nudge(self, frames: int) -> None:
        """Pause, and go so many states on, or back."""
        with self._lock:
            self._playing = False
            if self._clip is not None:
                last = len(self._clip.times) - 1
                at = int(np.clip(self._status().frame + frames, 0, last))
                self._position = float(self._clip.times[at])

    def choose(self, name: str) -> None:
        """Go to the beginning of an episode."""
        with self._lock:
            self._choose(self.names.index(name))

    def skip(self, episodes: int) -> None:
        """Go so many episodes on, or back; after the last comes the first."""
        with self._lock:
            self._choose((self._wanted + episodes) % len(self.names))

    def set_speed(self, speed: float) -> None:
        """Play slower or faster."""
        with self._lock:
            self._speed = speed

    def turn(self) -> TapeStatus:
        """Go on to now, with another episode where one was asked for or one ended."""
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
                self._turned = self._clock()
        with self._lock:
            now = self._clock()
            passed, self._turned = now - self._turned, now
            if self._clip is not None and self._playing:
                self._position += self._speed * passed
                if self._position > self._clip.length + PAUSE * self._speed:
                    self._choose((self._wanted + 1) % len(self.names))
            return self._status()

    def _choose(self, wanted: int) -> None:
        self._wanted, self._position, self._error = wanted, 0.0, ""

    def _status(self) -> TapeStatus:
        clip, frame, position = self._clip, 0, 0.0
        if clip is not None:
            position = min(self._position, clip.length)
            frame = int(np.searchsorted(clip.times, position + 1e-9, side="right")) - 1
        return TapeStatus(
            clip=clip,
            frame=frame,
            position=position,
            playing=self._playing,
            speed=self._speed,
            error=self._error,
        )


def open_tape(
    dataset: Dataset, names: Sequence[str], env: RobotEnv, *, by_states: bool
) -> Tape:
    """Make a tape of a dataset's episodes.

    Args:
        dataset: Open as long as the tape is used.
        names: Episodes of it.
        env: Where they are played, by the thread that turns the tape.
        by_states: Whether states are shown as recorded; else actions are taken.
    """
    return Tape(
        names, lambda name: make_clip(env, dataset.episode(name), by_states=by_states)
    )


def make_clip(env: RobotEnv, episode: Episode, *, by_states: bool) -> Clip:
    """Play an episode, and keep what is to be shown; the scene is then the episode's.

    Raises:
        DatasetError: If it cannot be played here.
    """
    start_as(env, episode)
    words = [{None: "", True: "success", False: "no success"}[episode.success]]
    if by_states:
        states = list(episode.columns["states"])
        if episode.final_state is not None:
            states.append(episode.final_state)
        words.append("states as recorded")
    else:
        states, worst = [env.physics_state], 0.0
        for _, difference, _ in play_actions(env, episode):
            states.append(env.physics_state)
            worst = max(worst, float(np.abs(difference).max()))
        exact = "bit by bit as recorded"
        words.append(exact if worst == 0.0 else f"actions, {worst:.1e} off at most")
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
        told=", ".join(word for word in words if word),
    )


def _fitted(values: Vector, count: int) -> Vector:
    """Repeat the last value, or cut, so that there is one for each state."""
    padded = np.concatenate([values, np.repeat(values[-1:], max(count, 1))])
    return np.asarray(padded[:count], dtype=np.float64)
