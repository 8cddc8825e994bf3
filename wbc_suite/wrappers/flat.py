"""Observations and actions as one float32 vector each, for learning libraries."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from wbc_suite.errors import UnknownNameError

Flattened = NDArray[np.float32]


class Flat(gymnasium.Wrapper[Flattened, Flattened, Any, Any]):
    """Observations as one float32 vector, actions as float32 between -1 and 1.

    It passes the checker of Stable-Baselines3. Observed are the `keys` in this order,
    by default the vectors of robots and of objects (`robot0_proprio-state`,
    `object-state`); an unknown one raises UnknownNameError.
    """

    def __init__(
        self, env: gymnasium.Env[Any, Any], keys: Sequence[str] | None = None
    ) -> None:
        super().__init__(env)
        spaces = dict(env.observation_space.spaces)  # pyright: ignore[reportAttributeAccessIssue] - ours are Dict spaces
        if keys is None:
            keys = [k for k in spaces if k.endswith(("proprio-state", "object-state"))]
            keys = sorted(keys, reverse=True)  # robots first, as in datasets
        for key in keys:
            if key not in spaces:
                raise UnknownNameError("observation", key, tuple(spaces))
        self.keys = tuple(keys)
        low, high = (
            np.concatenate([getattr(spaces[key], end).ravel() for key in self.keys])
            for end in ("low", "high")
        )
        self.observation_space = gymnasium.spaces.Box(
            low.astype(np.float32), high.astype(np.float32), dtype=np.float32
        )
        space: Any = env.action_space
        low, high = np.float64(space.low), np.float64(space.high)
        self._middle, self._half = 0.5 * (high + low), 0.5 * (high - low)
        self.action_space = gymnasium.spaces.Box(
            -1.0, 1.0, space.shape, dtype=np.float32
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Flattened, dict[str, Any]]:
        """Start an episode."""
        observation, info = self.env.reset(seed=seed, options=options)
        return self.flatten(observation), info

    def step(self, action: Any) -> tuple[Flattened, float, bool, bool, dict[str, Any]]:
        """Advance one control period."""
        given: Any = self._middle + self._half * np.asarray(action, dtype=np.float64)
        observation, reward, terminated, truncated, info = self.env.step(given)
        return self.flatten(observation), float(reward), terminated, truncated, info

    def flatten(self, observation: Any) -> Flattened:
        """Return an observation as one vector."""
        parts = [np.ravel(observation[key]) for key in self.keys]
        return np.concatenate(parts).astype(np.float32)

    def scaled(self, action: Any) -> Flattened:
        """Return an action of the environment as one between -1 and 1.

        Rotations beyond a full turn are wrapped, as `step` of the environment does.
        """
        layout = getattr(self.env.unwrapped, "action_layout", None)
        if layout is not None:
            action, _ = layout.take(action)
        half = np.where(self._half > 0.0, self._half, 1.0)
        return ((np.asarray(action) - self._middle) / half).astype(np.float32)
