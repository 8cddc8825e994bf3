"""robosuite's `GymWrapper`: Gymnasium's five-tuple around its shape."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np

from wbc_suite.errors import ConfigError

if TYPE_CHECKING:
    from wbc_suite.compat.robosuite import RobosuiteEnv

__all__ = ["GymWrapper"]

Observation = dict[str, Any]


class GymWrapper(gymnasium.Env[Any, Any]):
    """Gymnasium's five-tuple around `RobosuiteEnv`; observations in one vector.

    Args:
        env: The environment.
        keys: What is observed; by default objects, pictures and robots, in this order.
        flatten_obs: Whether they are one vector; else a dictionary.
    """

    metadata: dict[str, Any] = {"render_modes": []}

    def __init__(
        self,
        env: "RobosuiteEnv",
        keys: Sequence[str] | None = None,
        flatten_obs: bool = True,
    ) -> None:
        self.env, self.flatten_obs = env, flatten_obs
        seen = env.observation_spec()
        if keys is None:
            keys = [key for key in ("object-state",) if key in seen]
            keys += [key for key in seen if key.endswith("_image")]
            keys += [key for key in seen if key.endswith("proprio-state")]
        self.keys = list(keys)
        first = self._chosen(seen)
        self.observation_space = (
            _box(first)
            if flatten_obs
            else gymnasium.spaces.Dict({k: _box(v) for k, v in first.items()})
        )
        low, high = env.action_spec
        self.action_space = gymnasium.spaces.Box(
            np.float32(low), np.float32(high), dtype=np.float32
        )
        self.name = f"{'_'.join(r.name for r in env.robots)}_{env.name}"

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode."""
        if options:
            raise ConfigError(f"reset: there are no options, got {options!r:.60}.")
        if seed is not None:
            self.env.seed(seed)
        return self._chosen(self.env.reset()), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Advance one control period; an episode that is over was cut off."""
        observation, reward, done, info = self.env.step(action)
        return self._chosen(observation), reward, False, done, info

    def close(self) -> None:
        """Free what draws."""
        self.env.close()

    def compute_reward(
        self, achieved_goal: Any, desired_goal: Any, info: dict[str, Any]
    ) -> float:
        """Return the reward, under the name that goal-based learners call."""
        return self.env.reward()

    def _chosen(self, observation: Observation) -> Any:
        if not self.flatten_obs:
            return {key: observation[key] for key in self.keys}
        return np.concatenate([np.ravel(observation[key]) for key in self.keys])


def _box(values: Any) -> gymnasium.spaces.Box:
    if values.dtype == np.uint8:
        return gymnasium.spaces.Box(0, 255, values.shape, np.uint8)
    return gymnasium.spaces.Box(-np.inf, np.inf, values.shape, values.dtype)
