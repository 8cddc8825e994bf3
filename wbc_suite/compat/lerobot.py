"""LeRobot: our benchmarks as its environments.

`make_env` has the signature that LeRobot asks of an `env.py`. Environments observe
`agent_pos` (robots), `environment_state` (objects) and, with cameras, `pixels`: the
names that LeRobot maps to those of `wbc-suite convert --to lerobot`.

Sources: LeRobot 0.6.1, `lerobot.envs.factory`; its documentation of environments from
the Hub.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import (
    AsyncVectorEnv,
    AutoresetMode,
    SyncVectorEnv,
    VectorEnv,
)

from wbc_suite.envs import RobotEnv, make
from wbc_suite.errors import UnknownNameError
from wbc_suite.registration import WITH_ID

SUITE = "wbc_suite"
NEW_ROLLOUT = "lerobot_new_rollout"  # option of `reset` that LeRobot gives


class LeRobotEnv(gymnasium.Env[dict[str, Any], Any]):
    """One of our environments with the names and attributes that LeRobot reads.

    Args:
        benchmark: Name of the benchmark.
        cameras: Cameras that are observed as `pixels`.
        size: Width and height of their pictures.
        arguments: Further arguments of `make`.
    """

    def __init__(
        self,
        benchmark: str,
        cameras: Sequence[str] = (),
        size: int = 256,
        **arguments: Any,
    ) -> None:
        if cameras:
            arguments |= {"use_camera_obs": True, "camera_names": tuple(cameras)}
            arguments |= {"camera_heights": size, "camera_widths": size}
        arguments = {"render_mode": "rgb_array"} | arguments
        self.env: RobotEnv = make(benchmark, **arguments)
        self.metadata, self.render_mode = self.env.metadata, self.env.render_mode
        self._max_episode_steps = self.env.horizon
        self._cameras = tuple(cameras)
        keys = [k for k in self.env.observation_space if k.endswith("proprio-state")]
        self._robots = sorted(keys)
        seen = self._view(self.env.reset(seed=0)[0])
        self.observation_space = _space_of(seen)
        self.action_space = self.env.action_space

    @property
    def task(self) -> str:
        """The instruction of the episode, as in converted recordings."""
        return self.env.instruction

    task_description = task

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start an episode."""
        rest = {k: v for k, v in (options or {}).items() if k != NEW_ROLLOUT}
        observation, info = self.env.reset(seed=seed, options=rest or None)
        return self._view(observation), info

    def step(
        self, action: Any
    ) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Advance one control period; success ends the episode."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        info = {"is_success": info["is_success"], "success": info["success"]}
        over = terminated or bool(info["is_success"])
        return self._view(observation), reward, over, truncated, info

    def render(self) -> Any:
        """Return a picture."""
        return self.env.render()

    def close(self) -> None:
        """Free renderers."""
        self.env.close()

    def _view(self, observation: Mapping[str, Any]) -> dict[str, Any]:
        robots = np.concatenate([observation[key] for key in self._robots])
        seen: dict[str, Any] = {"agent_pos": robots.astype(np.float32)}
        if "object-state" in observation:
            objects = np.asarray(observation["object-state"], dtype=np.float32)
            seen["environment_state"] = objects
        if self._cameras:
            names = self._cameras
            seen["pixels"] = {name: observation[f"{name}_image"] for name in names}
        return seen


class LazyVectorEnv(VectorEnv[Any, Any, Any]):
    """A vector environment that exists from its first use on, until it is closed.

    So all benchmarks cost nothing until each is evaluated. Attributes are those of
    Gymnasium's vector environments.
    """

    def __init__(
        self, make_one: Callable[[], gymnasium.Env[Any, Any]], count: int, *, many: bool
    ) -> None:
        kind = AsyncVectorEnv if many else SyncVectorEnv
        self._make = partial(
            kind, [make_one] * count, autoreset_mode=AutoresetMode.SAME_STEP
        )
        self._made: VectorEnv[Any, Any, Any] | None = None
        self.num_envs = count
        self.metadata = {**RobotEnv.metadata, "autoreset_mode": AutoresetMode.SAME_STEP}

    def __getattr__(self, name: str) -> Any:
        """Spaces, `call`, `get_attr` and others are those of the environment."""
        if name.startswith("_"):
            raise AttributeError(name)
        return getattr(self._env(), name)

    def reset(self, **given: Any) -> Any:
        """Start episodes."""
        return self._env().reset(**given)

    def step(self, actions: Any) -> Any:
        """Advance every environment."""
        return self._env().step(actions)

    def render(self) -> Any:
        """Return a picture of each."""
        return self._env().render()

    def close(self, **kwargs: Any) -> None:
        """Close the environment; the next use makes it again."""
        if self._made is not None:
            self._made.close(**kwargs)
            self._made = None

    def _env(self) -> VectorEnv[Any, Any, Any]:
        if self._made is None:
            self._made = self._make()
            self.metadata = self._made.metadata  # with the rate
        return self._made


def make_env(
    n_envs: int = 1, use_async_envs: bool = False, cfg: Any = None, **arguments: Any
) -> dict[str, dict[int, LazyVectorEnv]]:
    """Return `{"wbc_suite": {task_id: vector environment}}`, as LeRobot expects.

    Args:
        n_envs: Number of environments of each benchmark.
        use_async_envs: Whether each runs in a process of its own.
        cfg: LeRobot's configuration; its `task`, one benchmark or several separated by
            commas, is the choice. All benchmarks by default.
        arguments: Of `LeRobotEnv`, such as `robots`, `controller_configs`, `cameras`.

    Raises:
        UnknownNameError: If there is no such benchmark.
    """
    chosen = getattr(cfg, "task", None)
    names = [name.strip() for name in chosen.split(",")] if chosen else WITH_ID
    for name in names:
        if name not in WITH_ID:
            raise UnknownNameError("benchmark", name, WITH_ID)
    made = {
        WITH_ID.index(name): LazyVectorEnv(
            partial(LeRobotEnv, name, **arguments), n_envs, many=use_async_envs
        )
        for name in names
    }
    return {SUITE: made}


def _space_of(seen: Any) -> gymnasium.Space[Any]:
    """Return the space of what is observed."""
    if isinstance(seen, Mapping):
        parts = {key: _space_of(value) for key, value in seen.items()}
        return gymnasium.spaces.Dict(parts)
    if seen.dtype == np.uint8:
        return gymnasium.spaces.Box(0, 255, seen.shape, dtype=np.uint8)
    return gymnasium.spaces.Box(-np.inf, np.inf, seen.shape, dtype=np.float32)
