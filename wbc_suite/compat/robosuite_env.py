"""robosuite's environment and `GymWrapper` around ours."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import gymnasium
import numpy as np

from wbc_suite.compat.robosuite_sim import RobotView, Sim
from wbc_suite.envs import RobotEnv
from wbc_suite.errors import ConfigError, DatasetError

Observation = dict[str, Any]


class RobosuiteEnv:
    """An environment with robosuite's calls.

    `seed` is that of the first episode; with `ignore_done`, steps after the end of an
    episode are allowed. `kwargs` are arguments of our environment.

    Attributes:
        env: Our environment; `render`, `close` and `horizon` are its own.
        sim: Model and state, under robosuite's names; `model` is its model.
        robots: The robots, likewise.
        control_freq: Actions per second, Hz.
        model_timestep: Duration of a physics step, s.
    """

    def __init__(
        self,
        env_name: str,
        *,
        ignore_done: bool = False,
        seed: int | None = None,
        **kwargs: Any,
    ) -> None:
        self.ignore_done, self._seed = bool(ignore_done), seed
        self.env = RobotEnv(env_name, **kwargs)
        self.name, self.unwrapped = env_name, self
        self.sim = Sim(self.env)
        self.viewer = SimpleNamespace(
            set_camera=lambda camera_id: None, update=lambda: None
        )
        self.model = self.sim.model
        self.robots = tuple(RobotView(*pair) for pair in self.env.simulation.pairs)
        self.action_dim = self.env.action_layout.size
        self.horizon, self.control_freq = self.env.horizon, self.env.config.control_freq
        self.model_timestep = self.env.simulation.timestep
        self.render, self.close = self.env.render, self.env.close
        self.timestep, self.done = 0, False
        self._ep_meta: dict[str, Any] = {}

    def reset(self) -> Observation:
        """Start an episode; return the observation."""
        observation, _ = self.env.reset(seed=self._seed)
        self._seed = None  # the first episode's only
        self.timestep, self.done = 0, False
        return self._in_their_form(observation)

    def step(self, action: Any) -> tuple[Observation, float, bool, dict[str, Any]]:
        """Advance one control period; raise ValueError if the episode is over."""
        if self.done:
            raise ValueError("executing action in terminated episode")
        observation, reward, terminated, truncated, info = self.env.step(action)
        self.timestep += 1
        self.done = (terminated or truncated) and not self.ignore_done
        return self._in_their_form(observation), reward, self.done, info

    def reward(self, action: Any = None) -> float:
        """Return the reward of the present state."""
        config = self.env.config
        given = self.env.benchmark.reward(shaped=config.reward_shaping)
        return given * config.reward_scale

    def seed(self, seed: int) -> None:
        """Seed the next episode."""
        self._seed = seed

    @property
    def action_spec(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest actions."""
        layout = self.env.action_layout
        return layout.low.copy(), layout.high.copy()

    @property
    def observation_names(self) -> set[str]:
        """Keys of all observations."""
        return {*self.env.observables.names, *self.env.cameras.space}

    def observation_spec(self) -> Observation:
        """Return an example of the observations."""
        return self._get_observations()

    def modify_observable(
        self, observable_name: str, attribute: str, modifier: Any
    ) -> None:
        """Change an observation; `corrupter` and `delayer` as in robosuite."""
        change = {attribute: modifier}
        if attribute == "corrupter":
            change = {"noise": modifier and (lambda values, rng: modifier(values))}
        elif attribute == "delayer":
            change = {"delay": modifier and (lambda rng: modifier())}
        self.env.observables.modify(observable_name, **change)

    def get_ep_meta(self) -> dict[str, Any]:
        """Return the value of `set_ep_meta`."""
        return dict(self._ep_meta)

    def set_ep_meta(self, meta: dict[str, Any]) -> None:
        """Store data of the episode."""
        self._ep_meta = dict(meta)

    def unset_ep_meta(self) -> None:
        """Delete the data of the episode."""
        self._ep_meta = {}

    def visualize(self, vis_settings: dict[str, bool]) -> None:
        """Do nothing: scenes have no visual marks; see `Indicators`."""

    def edit_model_xml(self, xml: str) -> str:
        """Return the text unchanged: it has no paths to edit."""
        return xml

    def reset_from_xml_string(self, xml: str) -> None:
        """Start an episode in a recording's scene; raise DatasetError for others."""
        if xml != self.sim.model.get_xml():
            raise DatasetError(
                "The recording's scene is not this environment's: states of other "
                "scenes do not fit. Actions do: play those."
            )
        self.reset()

    def _get_observations(self, force_update: bool = False) -> Observation:
        self.env.observables.update()
        return self._in_their_form(self.env.observation())

    def _check_success(self) -> bool:
        return self.env.benchmark.success()

    def _in_their_form(self, observation: Observation) -> Observation:
        """Flip pictures, and map depths to 0 to 1, as OpenGL has them."""
        for key in self.env.cameras.space:
            picture = observation[key][::-1]
            if key.endswith("_depth"):
                picture = self.sim.opengl_depth(picture).astype(np.float32)
            observation[key] = np.ascontiguousarray(picture)
        return observation


class GymWrapper(gymnasium.Env[Any, Any]):
    """Gymnasium's five-tuple around `RobosuiteEnv`.

    Observed are objects, pictures and robots, or the given keys, in this order: in one
    vector with `flatten_obs`, else in a dictionary.
    """

    metadata: dict[str, Any] = {"render_modes": []}

    def __init__(
        self,
        env: RobosuiteEnv,
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
        if flatten_obs:
            self.observation_space = _box(first)
        else:
            self.observation_space = gymnasium.spaces.Dict(
                {key: _box(values) for key, values in first.items()}
            )
        low, high = (limit.astype(np.float32) for limit in env.action_spec)
        self.action_space = gymnasium.spaces.Box(low, high, dtype=np.float32)
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
        """Advance one control period; the end of an episode is a truncation."""
        observation, reward, done, info = self.env.step(action)
        return self._chosen(observation), reward, False, done, info

    def close(self) -> None:
        """Close the environment."""
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
