"""Gymnasium's five-tuple around an environment of robosuite's."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np

from wbc_suite.errors import ConfigError


class GymWrapper(gymnasium.Env[Any, Any]):
    """Gymnasium's five-tuple around an environment.

    Observed are objects, pictures and robots, or the given keys, in this order: in one
    vector with `flatten_obs`, else in a dictionary.
    """

    metadata: dict[str, Any] = {"render_modes": []}

    def __init__(
        self,
        env: Any,
        keys: Sequence[str] | None = None,
        flatten_obs: bool = True,
    ) -> None:
        self.env, self.flatten_obs = env, flatten_obs
        example = env.observation_spec()
        if keys is None:
            kinds = "object-state", "_image", "proprio-state"
            keys = [key for kind in kinds for key in example if key.endswith(kind)]
        self.keys = list(keys)
        first = self._chosen(example)
        self.modality_dims = {key: np.shape(example[key]) for key in self.keys}
        self.obs_dim = sum(np.size(example[key]) for key in self.keys)
        self.reward_range = (0, env.reward_scale)
        if flatten_obs:
            self.observation_space = _box(first)
        else:
            self.observation_space = gymnasium.spaces.Dict(
                {key: _box(values) for key, values in first.items()}
            )
        low, high = (limit.astype(np.float32) for limit in env.action_spec)
        self.action_space = gymnasium.spaces.Box(low, high, dtype=np.float32)
        self.name = f"{''.join(robot.name for robot in env.robots)}_{env.name}"

    def __getattr__(self, name: str) -> Any:
        if name == "env" or name.startswith("__"):
            raise AttributeError(name)
        return getattr(self.env, name)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode."""
        if options:
            raise ConfigError(f"reset takes no options, but got {options!r:.60}.")
        if seed is not None:
            self.env.unwrapped.seed_of_next = seed
        return self._chosen(self.env.reset()), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Advance one control period; the end of an episode is a truncation."""
        observation, reward, done, info = self.env.step(action)
        return self._chosen(observation), reward, False, done, info

    def render(self) -> Any:
        """Show the environment."""
        return self.env.render()

    def close(self) -> None:
        """Close the environment."""
        self.env.close()

    def compute_reward(
        self, achieved_goal: Any, desired_goal: Any, info: dict[str, Any]
    ) -> float:
        """Return the reward, under the name that goal-based learners call."""
        return self.env.reward()

    def _chosen(self, observation: Any) -> Any:
        if not self.flatten_obs:
            return {key: observation[key] for key in self.keys}
        return np.concatenate([np.ravel(observation[key]) for key in self.keys])


def _box(values: Any) -> gymnasium.spaces.Box:
    if values.dtype == np.uint8:
        return gymnasium.spaces.Box(0, 255, values.shape, np.uint8)
    return gymnasium.spaces.Box(-np.inf, np.inf, values.shape, values.dtype)
