"""Wrappers that record, replay and start from recorded episodes."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from wbc_suite.arguments import check_number
from wbc_suite.envs import RobotEnv
from wbc_suite.envs.states import motion_size
from wbc_suite.errors import ConfigError, DatasetError
from wbc_suite.recording import Dataset
from wbc_suite.recording.recorder import Recorder
from wbc_suite.recording.replaying import start_as
from wbc_suite.typing import Matrix


class DataCollection(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Records every episode of one of our environments, or chosen ones.

    With `automatic`, each episode is recorded from its reset on, and kept when it ends
    or the next one begins. Otherwise call `recorder.begin` and `keep`. For `path` and
    `next_obs` see `Recorder`.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        path: str | Path,
        *,
        automatic: bool = True,
        next_obs: bool = False,
    ) -> None:
        super().__init__(env)
        self.recorder = Recorder(env, path, next_obs=next_obs)
        self.automatic = automatic

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode; one that was in progress is kept if `automatic`."""
        if not self.automatic:
            self.recorder.discard()
            return self.env.reset(seed=seed, options=options)
        self.recorder.keep()
        result = self.env.reset(seed=seed, options=options)
        self.recorder.begin()
        return result

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Advance one control period and record it."""
        begun = time.perf_counter()
        observation, reward, terminated, truncated, info = self.env.step(action)
        if self.recorder.recording:
            self.recorder.add(
                action,
                observation,
                float(reward),
                done=terminated or truncated,
                info=info,
                step_time=time.perf_counter() - begun,
            )
            if self.automatic and (terminated or truncated):
                self.recorder.keep()
        return observation, float(reward), terminated, truncated, info

    def close(self) -> None:
        """Keep the episode in progress if `automatic`, and close the file."""
        if self.automatic:
            self.recorder.keep()
        self.recorder.close()
        super().close()


class Playback(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Replaces the given actions by recorded ones, episode after episode, cyclically.

    Raises DatasetError if the recording has no episodes, or is not of the wrapped
    environment.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], dataset: Dataset) -> None:
        super().__init__(env)
        inner = env.unwrapped
        if not isinstance(inner, RobotEnv) or not len(dataset):
            raise DatasetError("Playback needs a RobotEnv and at least one episode.")
        self._inner: RobotEnv = inner
        self._dataset, self._next = dataset, 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start the next recorded episode; `info["playback"]` names it."""
        _, info = self.env.reset(seed=seed, options=options)
        name = self._dataset.names[self._next % len(self._dataset)]
        self._episode, self._taken = self._dataset.episode(name), 0
        self._next += 1
        start_as(self._inner, self._episode)
        return self._inner.observation(), info | {"playback": name}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Take the next recorded action; the end of the recording truncates.

        `info["playback_error"]` is the largest difference of a state variable from the
        recorded one.
        """
        k, columns = self._taken, self._episode.columns
        if k >= self._episode.length:
            raise DatasetError(f"'{self._episode.name}' is over: call reset first.")
        action = columns["actions"][k]
        observation, reward, terminated, truncated, info = self.env.step(action)
        self._taken += 1
        over = self._taken == self._episode.length
        after = self._episode.final_state if over else columns["states"][k + 1]
        if after is not None:
            size = motion_size(self._inner.simulation.model)
            difference = np.abs((self._inner.physics_state - after)[:size]).max()
            info = info | {"playback_error": float(difference)}
        return observation, float(reward), terminated, truncated or over, info


class DemoStart(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Starts episodes at states of demonstrations.

    Args:
        env: One of our environments, unwrapped or wrapped.
        demonstrations: Physics states of each demonstration, shape (n, size), such as
            the column `states` of a dataset: the world of an episode is that of its
            state. States of time, qpos and qvel alone keep the scene that was drawn.
        share: Share of episodes that start there; the others start as usual.
        window: Number of last states to draw from at first; None for all.
        growth: Number of states that the window grows by with each episode, towards the
            beginnings of demonstrations: a curriculum.

    Raises:
        ConfigError: If there is no state, or one is of another scene.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        demonstrations: Sequence[Matrix],
        *,
        share: float = 0.9,
        window: int | None = None,
        growth: int = 0,
    ) -> None:
        super().__init__(env)
        inner = env.unwrapped
        if not isinstance(inner, RobotEnv):
            raise ConfigError(f"DemoStart needs a RobotEnv, not {inner}.")
        self._inner: RobotEnv = inner
        self._demonstrations = [np.array(d, dtype=np.float64) for d in demonstrations]
        for states in self._demonstrations:
            try:
                inner.check_state(states[0] if states.ndim == 2 else np.zeros(0))
            except (ConfigError, IndexError) as error:
                raise ConfigError(
                    f"A demonstration has shape {states.shape}, and needs (n, "
                    f"{inner.physics_state.size}): {error}"
                ) from error
        if not self._demonstrations:
            raise ConfigError("DemoStart needs a demonstration.")
        self._share = check_number("DemoStart: share", share, least=0.0, most=1.0)
        self._window, self._growth = window, growth

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode; `info["demo_start"]` names demonstration and state."""
        observation, info = self.env.reset(seed=seed, options=options)
        rng = self._inner.np_random
        if rng.uniform() >= self._share:
            return observation, info
        demonstration = int(rng.integers(len(self._demonstrations)))
        states = self._demonstrations[demonstration]
        first = 0 if self._window is None else max(0, len(states) - self._window)
        at = int(rng.integers(first, len(states)))
        if self._window is not None:
            self._window += self._growth
        observation = self._inner.reset_to(states[at])
        return observation, info | {"demo_start": (demonstration, at)}
