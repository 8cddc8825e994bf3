"""Episodes that begin somewhere in a demonstration."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np

from wbc_suite.arguments import check_number
from wbc_suite.envs import RobotEnv
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Matrix

__all__ = ["DemoStart"]


class DemoStart(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Begins episodes at states of demonstrations.

    With `window`, they begin near the demonstrations' ends at first, and the window
    grows towards their beginnings: a curriculum.

    Args:
        env: One of our environments, unwrapped or wrapped.
        demonstrations: Physics states, one row each (time, qpos, qvel), for each
            demonstration, as datasets of this field have them.
        share: Of episodes that begin there; the others begin as usual.
        window: How many of the last states may be drawn at first; None for all.
        growth: By how many states the window grows with each episode.

    Raises:
        ConfigError: If there is no state, or one has a wrong size.
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
            raise ConfigError(f"DemoStart needs an environment of ours, not {inner}.")
        self._inner: RobotEnv = inner
        self._demonstrations = [np.array(d, dtype=np.float64) for d in demonstrations]
        size = inner.physics_state.size
        for states in self._demonstrations:
            if states.ndim != 2 or states.shape[1] != size or not len(states):
                raise ConfigError(
                    f"A demonstration has shape {states.shape}, and needs (n, {size})."
                )
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
