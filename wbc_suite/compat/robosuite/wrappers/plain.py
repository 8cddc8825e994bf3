"""The base of wrappers, and those that change looks, physics or starts."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.randomisation import Randomisation
from wbc_suite.recording.hdf5_check import open_safely

_OF_CAMERAS = ("camera_position", "camera_rotation", "camera_fovy")
_OF_LIGHTS = ("light_position", "light_brightness")
_OF_DYNAMICS = ("mass", "inertia", "friction", "damping", "armature", "gains")


class Wrapper:
    """An environment with some calls changed; all others are the environment's own."""

    def __init__(self, env: Any) -> None:
        self.env = env
        inner = env
        while isinstance(inner, Wrapper):
            if type(inner) is type(self):
                raise ConfigError(
                    f"The environment is a {type(self).__name__} already."
                )
            inner = inner.env

    @classmethod
    def class_name(cls) -> str:
        """Return the name of the class."""
        return cls.__name__

    def step(self, action: Any) -> Any:
        """Advance one control period."""
        return self.env.step(action)

    def reset(self) -> Any:
        """Start an episode."""
        return self.env.reset()

    def render(self, **kwargs: Any) -> Any:
        """Show the environment."""
        return self.env.render(**kwargs)

    def observation_spec(self) -> Any:
        """Return an example of the observations."""
        return self.env.observation_spec()

    def __getattr__(self, attr: str) -> Any:
        if attr == "env" or attr.startswith("__"):
            raise AttributeError(attr)
        return getattr(self.env, attr)


class VisualizationWrapper(Wrapper):
    """The environment; `indicator_configs` name marks, which are not drawn.

    They are one name or dictionary with a `name`, or a list of these. Marks are where
    `set_indicator_pos` puts them, in `indicator_places`. `wbc_suite.wrappers` has
    `Indicators`, which draws such.
    """

    def __init__(self, env: Any, indicator_configs: Any = None) -> None:
        super().__init__(env)
        self._settings = dict.fromkeys(env._visualizations, True)
        given = indicator_configs or []
        given = given if isinstance(given, list | tuple) else [given]
        names = [c if isinstance(c, str) else c.get("name") for c in given]
        self.indicator_places = {
            name or f"indicator{k}": np.zeros(3) for k, name in enumerate(names)
        }

    def get_indicator_names(self) -> list[str]:
        """Return the names of the marks."""
        return list(self.indicator_places)

    def set_indicator_pos(self, indicator: str, pos: Any) -> None:
        """Move a mark to a place in the world, m; raises for an unknown name."""
        if indicator not in self.indicator_places:
            raise UnknownNameError("indicator", indicator, self.indicator_places)
        self.indicator_places[indicator] = np.array(pos, np.float64)

    def get_visualization_settings(self) -> set[str]:
        """Return what can be shown or hidden."""
        return set(self._settings)

    def set_visualization_setting(self, setting: str, visible: bool) -> None:
        """Show or hide something."""
        if setting not in self._settings:
            raise ConfigError(f"{setting!r}: one of {', '.join(self._settings)}.")
        self._settings[setting] = visible


class DomainRandomizationWrapper(Wrapper):
    """Draws colours, cameras, lights and dynamics anew at each reset, and in between.

    Ranges are those of `Randomisation`; the dictionaries of arguments have no effect.
    """

    def __init__(
        self,
        env: Any,
        seed: int | None = None,
        randomize_color: bool = True,
        randomize_camera: bool = True,
        randomize_lighting: bool = True,
        randomize_dynamics: bool = True,
        color_randomization_args: Mapping[str, Any] | None = None,
        camera_randomization_args: Mapping[str, Any] | None = None,
        lighting_randomization_args: Mapping[str, Any] | None = None,
        dynamics_randomization_args: Mapping[str, Any] | None = None,
        randomize_on_reset: bool = True,
        randomize_every_n_steps: int = 1,
    ) -> None:
        super().__init__(env)
        self._rng = np.random.default_rng(seed)
        self.randomize_on_reset = randomize_on_reset
        self.randomize_every_n_steps, self.step_counter = randomize_every_n_steps, 0
        off: dict[str, Any] = {}
        if not randomize_color:
            off |= {"color": 0.0, "texture": False}
        if not randomize_camera:
            off |= dict.fromkeys(_OF_CAMERAS, 0.0)
        if not randomize_lighting:
            off |= dict.fromkeys(_OF_LIGHTS, 0.0)
        if not randomize_dynamics:
            off |= dict.fromkeys(_OF_DYNAMICS, 0.0)
        self._bound = Randomisation(**off).bind(env.unwrapped.env)

    def reset(self) -> Any:
        """Start an episode with new values."""
        self.step_counter = 0
        observation = self.env.reset()
        if self.randomize_on_reset:
            self.randomize_domain()
            observation = self.env._get_observations(force_update=True)
        return observation

    def step(self, action: Any) -> Any:
        """Advance one control period; draw new values before if they are due."""
        n = self.randomize_every_n_steps
        if n > 0 and self.step_counter % n == 0:
            self.randomize_domain()
        self.step_counter += 1
        return self.env.step(action)

    def randomize_domain(self) -> None:
        """Draw new values."""
        self._bound.restore()
        self._bound.apply(self._rng)

    def restore_default_domain(self) -> None:
        """Write the nominal values."""
        self._bound.restore()


class DemoSamplerWrapper(Wrapper):
    """Starts a share of the episodes from states of recorded demonstrations.

    Schemes: `random` is the environment's own reset, `uniform` any state, `forward` a
    state of a window that grows from the begin, `reverse` from the end.
    """

    def __init__(
        self,
        env: Any,
        demo_path: str,
        need_xml: bool = False,
        num_traj: int = -1,
        sampling_schemes: Sequence[str] = ("uniform", "random"),
        scheme_ratios: Sequence[float] = (0.9, 0.1),
        open_loop_increment_freq: int = 100,
        open_loop_initial_window_width: int = 25,
        open_loop_window_increment: int = 25,
    ) -> None:
        super().__init__(env)
        if abs(sum(scheme_ratios) - 1.0) > 1e-9:
            raise ConfigError("scheme_ratios: they must sum to 1.")
        self._schemes, self._ratios = list(sampling_schemes), list(scheme_ratios)
        self._rng, self._window = env.rng, open_loop_initial_window_width
        self._every, self._more = open_loop_increment_freq, open_loop_window_increment
        self._resets = 0
        with open_safely(Path(demo_path)) as file:
            data: Any = file["data"]
            names = list(data)[: None if num_traj < 0 else num_traj]
            self._states = [np.array(data[name]["states"]) for name in names]

    def reset(self) -> Any:
        """Start an episode."""
        observation = self.env.reset()
        state = self.sample()
        if state is None:
            return observation
        self.env.sim.set_state_from_flattened(state)
        self.env.sim.forward()
        return self.env._get_observations(force_update=True)

    def sample(self) -> Any:
        """Return a state to start from, or None for the environment's own."""
        scheme = self._rng.choice(self._schemes, p=self._ratios)
        self._resets += 1
        if self._resets % self._every == 0:
            self._window += self._more
        if scheme == "random":
            return None
        states = self._states[self._rng.integers(len(self._states))]
        width = min(self._window, len(states))
        if scheme == "forward":
            states = states[:width]
        elif scheme == "reverse":
            states = states[-width:]
        return states[self._rng.integers(len(states))]
