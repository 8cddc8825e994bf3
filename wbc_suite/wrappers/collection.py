"""Data collection: what an environment does, stored episode by episode."""

import time
from pathlib import Path
from typing import Any

import gymnasium

from wbc_suite.recording.recorder import Recorder

__all__ = ["DataCollection"]


class DataCollection(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Records every episode, or those that somebody asks for.

    Args:
        env: One of our environments, wrapped or not.
        path: The file; episodes are added to those in it.
        automatic: Whether each episode is recorded from its reset on, and kept when it
            ends or the next one begins. Else `begin` and `keep` say so.
        next_obs, later: See `Recorder`.

    Attributes:
        recorder: Keeps, discards and takes back.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        path: str | Path,
        *,
        automatic: bool = True,
        next_obs: bool = False,
        later: bool = False,
    ) -> None:
        super().__init__(env)
        self.recorder = Recorder(env, path, next_obs=next_obs, later=later)
        self.automatic = automatic

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode; one that was in progress is kept if `automatic`."""
        if self.automatic:
            self.recorder.keep()
        else:
            self.recorder.discard()
        result = self.env.reset(seed=seed, options=options)
        if self.automatic:
            self.recorder.begin()
        return result

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Advance one control period, and store it."""
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
        """Keep what is in progress if `automatic`, and put all into one file."""
        if self.automatic:
            self.recorder.keep()
        self.recorder.close()
        super().close()
