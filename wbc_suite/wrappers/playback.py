"""Playback: an environment that does what was recorded, whatever it is told."""

from typing import Any

import gymnasium
import numpy as np

from wbc_suite.envs import RobotEnv
from wbc_suite.errors import DatasetError
from wbc_suite.recording import Dataset
from wbc_suite.recording.replaying import start_as

__all__ = ["Playback"]


class Playback(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Takes recorded actions in place of those it is given, episode after episode.

    Args:
        env: One of our environments, wrapped or not, as the recording's.
        dataset: The recording; after its last episode comes its first.

    Raises:
        DatasetError: If the recording has no episodes, or is of another environment.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], dataset: Dataset) -> None:
        super().__init__(env)
        inner = env.unwrapped
        if not isinstance(inner, RobotEnv) or not len(dataset):
            raise DatasetError("Playback needs one of our environments, and episodes.")
        self._inner: RobotEnv = inner
        self._dataset, self._next = dataset, 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start the next episode as it started; `info["playback"]` names it."""
        _, info = self.env.reset(seed=seed, options=options)
        name = self._dataset.names[self._next % len(self._dataset)]
        self._episode, self._taken = self._dataset.episode(name), 0
        self._next += 1
        start_as(self._inner, self._episode)
        return self._inner.observation(), info | {"playback": name}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Take the next recorded action; the end of the recording truncates.

        `info["playback_error"]` is the largest difference of a state's number from the
        recorded one.
        """
        k, columns = self._taken, self._episode.columns
        if k >= self._episode.length:
            raise DatasetError(f"'{self._episode.name}' is over: reset first.")
        seen, reward, terminated, truncated, info = self.env.step(columns["actions"][k])
        self._taken += 1
        over = self._taken == self._episode.length
        after = self._episode.final_state if over else columns["states"][k + 1]
        if after is not None:
            difference = np.abs(self._inner.physics_state - after).max()
            info = info | {"playback_error": float(difference)}
        return seen, float(reward), terminated, truncated or over, info
