"""robosuite's shape: change `import robosuite` into this module.

`docs/from_robosuite.md` maps every name. What is different stays different: robots,
controllers and scenes are ours, so states and XML of robosuite's own datasets do not
fit; actions, keys of observations, rewards and the calls around them do.
"""

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np

from wbc_suite.benchmark import benchmark_names
from wbc_suite.catalogue import Catalogue
from wbc_suite.compat.robosuite_gym import GymWrapper
from wbc_suite.compat.robosuite_robot import RobotView
from wbc_suite.compat.robosuite_sim import Model, Sim
from wbc_suite.control import load_composite_controller_config as _load_composite
from wbc_suite.control.composite import composite_names
from wbc_suite.control.composite.parts import part_models
from wbc_suite.envs import RobotEnv
from wbc_suite.errors import ConfigError, DatasetError, UnknownNameError

__all__ = [
    "ALL_COMPOSITE_CONTROLLERS",
    "ALL_ENVIRONMENTS",
    "ALL_GRIPPERS",  # noqa: F822  # pyright: ignore[reportUnsupportedDunderAll] - made when asked for
    "ALL_PART_CONTROLLERS",
    "ALL_ROBOTS",  # noqa: F822  # pyright: ignore[reportUnsupportedDunderAll] - made when asked for
    "GymWrapper",
    "RobosuiteEnv",
    "load_composite_controller_config",
    "load_part_controller_config",
    "make",
    "make_from_dataset",
    "make_from_env_args",
]

__version__ = "1.5.2"
"""The robosuite whose shape this is; scripts ask for it."""

Observation = dict[str, Any]

_MEANINGLESS = frozenset(
    {
        *("has_offscreen_renderer", "render_collision_mesh", "render_visual_mesh"),
        *("render_gpu_device_id", "hard_reset", "renderer", "renderer_config"),
        *("render_camera_size", "reward_normalised", "camera_renderer"),
    }
)
"""Arguments that ask for nothing here, and are taken without a word."""

RENDER_CAMERA = "frontview"

_RENAMED = {"damping": "damping_ratio", "damping_limits": "damping_ratio_limits"}
"""Keys of controllers that robosuite 1.5 calls otherwise."""

ALL_ENVIRONMENTS = benchmark_names()
ALL_COMPOSITE_CONTROLLERS = composite_names()
ALL_PART_CONTROLLERS = tuple(part_models())


def __getattr__(name: str) -> Any:
    if name == "ALL_ROBOTS":
        return Catalogue().called("robots")
    if name == "ALL_GRIPPERS":
        return (*Catalogue().called("robots/gripper"), None)
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")


def load_composite_controller_config(
    controller: str | Path | None = None, robot: str | None = None
) -> dict[str, Any]:
    """Return a composite controller's config; see `wbc_suite.control`'s.

    BASIC without a robot is one for all: of its parts, `make` leaves out what a robot
    does not have.
    """
    if robot is not None or str(controller).upper() != "BASIC":
        return _load_composite(controller, robot)
    arm = load_part_controller_config(default_controller="OSC_POSE")
    arm["gripper"] = {"type": "GRIP"}
    posture = {"type": "JOINT_POSITION"}
    return {
        "type": "BASIC",
        "body_parts": {
            "arms": {"right": arm, "left": copy.deepcopy(arm)},
            "torso": posture,
            "head": posture.copy(),
            "base": {"type": "JOINT_VELOCITY"},
        },
    }


def load_part_controller_config(
    custom_fpath: str | Path | None = None, default_controller: str | None = None
) -> dict[str, Any]:
    """Return the config of a part controller: a JSON file's, or a type's defaults.

    It goes into `body_parts` of a composite config.

    Raises:
        ConfigError: If neither is given, or the file cannot be read.
        UnknownNameError: If there is no such type.
    """
    if default_controller is not None:
        models = part_models()
        if default_controller not in models:
            raise UnknownNameError("part controller", default_controller, models)
        config = models[default_controller].model_validate({"type": default_controller})
        return config.model_dump(mode="json", exclude_none=True)
    if custom_fpath is None:
        raise ConfigError("load_part_controller_config: name a file or a type.")
    try:
        return json.loads(Path(custom_fpath).read_text())
    except (OSError, ValueError) as error:
        raise ConfigError(f"{custom_fpath}: no controller in it: {error}") from error


def make(env_name: str, *args: Any, **kwargs: Any) -> "RobosuiteEnv":
    """Make an environment with robosuite's arguments and defaults.

    Raises:
        UnknownNameError: If benchmark, robot, controller or camera is unknown.
        ConfigError: If an argument is neither robosuite's nor ours.
    """
    if args:
        kwargs["robots"], *rest = args
        if rest:
            raise ConfigError("make: only env_name and robots may come without a name.")
    return RobosuiteEnv(env_name, **kwargs)


def make_from_env_args(env_args: str | dict[str, Any]) -> "RobosuiteEnv":
    """Make the environment that a dataset's `env_args` tell of, text or dictionary.

    Raises:
        DatasetError: If there is no `env_name` in it.
    """
    told = json.loads(env_args) if isinstance(env_args, str) else dict(env_args)
    if "env_name" not in told:
        raise DatasetError("env_args has no 'env_name'.")
    given = dict(told.get("env_kwargs", {}))
    given.pop("env_name", None)
    return make(told["env_name"], **given)


def make_from_dataset(path: str | Path) -> "RobosuiteEnv":
    """Make the environment of an HDF5 dataset, by its attribute `env_args`.

    Raises:
        DatasetError: If the file cannot be read or has no such attribute.
    """
    import h5py

    from wbc_suite.recording import hdf5

    with hdf5.open_safely(Path(path)) as file, hdf5.reading(Path(path)):
        data = hdf5.child(file, "data", h5py.Group)
        told = None if data is None else hdf5.attribute(data, "env_args")
    if told is None:
        raise DatasetError(f"{path}: no env_args in it.")
    return make_from_env_args(str(told))


class RobosuiteEnv:
    """An environment with robosuite's calls.

    Args:
        env_name: Name of the benchmark.
        kwargs: robosuite's arguments, and ours.

    Attributes:
        env: Our environment.
        sim: Model and state, under robosuite's names.
        robots: The robots, likewise.
        viewer: Takes what is told to a window, and does nothing.
        name: Name of the benchmark.
    """

    def __init__(self, env_name: str, **kwargs: Any) -> None:
        self.ignore_done = bool(kwargs.pop("ignore_done", False))
        self._seed = kwargs.pop("seed", None)
        self.env = RobotEnv(env_name, **_ours(kwargs))
        self.name = env_name
        self.sim, self.viewer = Sim(self.env), Viewer()
        simulation = self.env.simulation
        self.robots = tuple(
            RobotView(state, controller)
            for state, controller in zip(
                simulation.robots, simulation.controllers, strict=True
            )
        )
        self.timestep, self.done = 0, False
        self._ep_meta: dict[str, Any] = {}

    def reset(self) -> Observation:
        """Start an episode, and return what is seen."""
        observation, _ = self.env.reset(seed=self._seed)
        self._seed = None  # the first episode's only
        self.timestep, self.done = 0, False
        return self._as_theirs(observation)

    def step(self, action: Any) -> tuple[Observation, float, bool, dict[str, Any]]:
        """Advance one control period.

        Raises:
            ValueError: If the episode is over and `ignore_done` is not set.
        """
        if self.done:
            raise ValueError("executing action in terminated episode")
        observation, reward, terminated, truncated, info = self.env.step(action)
        self.timestep += 1
        self.done = (terminated or truncated) and not self.ignore_done
        return self._as_theirs(observation), reward, self.done, info

    def reward(self, action: Any = None) -> float:
        """Return the reward of the state as it is."""
        config = self.env.config
        given = self.env.benchmark.reward(shaped=config.reward_shaping)
        return given * config.reward_scale

    def render(self) -> None:
        """Show the scene on a page, where `has_renderer` was set."""
        self.env.render()

    def close(self) -> None:
        """Free what draws."""
        self.env.close()

    def seed(self, seed: int) -> None:
        """Seed the next episode."""
        self._seed = seed

    @property
    def action_spec(self) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest actions."""
        layout = self.env.action_layout
        return layout.low.copy(), layout.high.copy()

    @property
    def action_dim(self) -> int:
        """Length of an action."""
        return int(self.action_spec[0].size)

    @property
    def unwrapped(self) -> "RobosuiteEnv":
        """This environment."""
        return self

    @property
    def model(self) -> Model:
        """The scene."""
        return self.sim.model

    @property
    def model_timestep(self) -> float:
        """Duration of a physics step, s."""
        return self.env.simulation.timestep

    @property
    def horizon(self) -> int:
        """Actions in an episode."""
        return self.env.horizon

    @property
    def control_freq(self) -> float:
        """Actions a second."""
        return self.env.config.control_freq

    @property
    def observation_names(self) -> set[str]:
        """Keys of what can be observed."""
        return {*self.env.observables.names, *self.env.cameras.space}

    def observation_spec(self) -> Observation:
        """Return an observation, whose shapes are those of all."""
        return self._get_observations()

    def modify_observable(
        self, observable_name: str, attribute: str, modifier: Any
    ) -> None:
        """Change an observation; `corrupter` and `delayer` are functions as there."""
        if attribute == "corrupter" and modifier is not None:
            attribute, inner = "noise", modifier
            modifier = lambda values, rng: inner(values)  # noqa: E731
        elif attribute == "delayer" and modifier is not None:
            attribute, late = "delay", modifier
            modifier = lambda rng: late()  # noqa: E731
        attribute = {"corrupter": "noise", "delayer": "delay"}.get(attribute, attribute)
        self.env.observables.modify(observable_name, **{attribute: modifier})

    def get_ep_meta(self) -> dict[str, Any]:
        """Return what `set_ep_meta` was given."""
        return dict(self._ep_meta)

    def set_ep_meta(self, meta: dict[str, Any]) -> None:
        """Keep notes on the episode."""
        self._ep_meta = dict(meta)

    def unset_ep_meta(self) -> None:
        """Forget notes on the episode."""
        self._ep_meta = {}

    def visualize(self, vis_settings: dict[str, bool]) -> None:
        """Do nothing: scenes have no marks to show or hide; see `Indicators`."""

    def edit_model_xml(self, xml: str) -> str:
        """Return the text as it is: paths in it need no mending here."""
        return xml

    def reset_from_xml_string(self, xml: str) -> None:
        """Start an episode in the scene of a recording, which must be this one.

        Raises:
            DatasetError: If the text is another scene's, such as robosuite's own.
        """
        if xml != self.sim.model.get_xml():
            raise DatasetError(
                "The recording's scene is not this environment's: states of other "
                "scenes do not fit. Actions do: play those."
            )
        self.reset()

    def _get_observations(self, force_update: bool = False) -> Observation:
        """Return what is seen now."""
        return self._as_theirs(self.sim.look())

    def _check_success(self) -> bool:
        """Whether the benchmark is solved now."""
        return self.env.benchmark.success()

    def _as_theirs(self, observation: Observation) -> Observation:
        """Turn pictures upside down, and depths into 0 to 1, as OpenGL has them."""
        model = self.env.simulation.model
        near = model.vis.map.znear * model.stat.extent
        far = model.vis.map.zfar * model.stat.extent
        for key in self.env.cameras.space:
            picture = observation[key][::-1]
            if key.endswith("_depth"):
                picture = (1.0 - near / np.maximum(picture, near)) / (1.0 - near / far)
                picture = picture.astype(np.float32)
            observation[key] = np.ascontiguousarray(picture)
        return observation


class Viewer:
    """What scripts tell robosuite's window; here people turn the page themselves."""

    def set_camera(self, camera_id: int) -> None:
        """Do nothing."""

    def update(self) -> None:
        """Do nothing: a page follows every step."""


def _ours(kwargs: dict[str, Any]) -> dict[str, Any]:
    """Return our arguments for robosuite's."""
    given = {"use_camera_obs": True, "horizon": 1000} | {
        key: value for key, value in kwargs.items() if key not in _MEANINGLESS
    }
    if given.pop("has_renderer", False):
        given["render_mode"] = "human"
    given.setdefault("render_camera", RENDER_CAMERA)
    for key in ("env_name", "type", "env_version"):
        given.pop(key, None)
    if given.get("robots") is not None and isinstance(given["robots"], list | tuple):
        robots = list(given["robots"])
        given["robots"] = robots[0] if len(robots) == 1 else robots
    for key in ("gripper_types", "base_types", "controller_configs"):
        value = given.get(key)
        if isinstance(value, list | tuple) and len(value) == 1:
            given[key] = value[0]
    if isinstance(given.get("controller_configs"), dict):
        given["controller_configs"] = _renewed(given["controller_configs"])
    if given.get("gripper_types", "") is None:  # theirs for a hand without one
        given["gripper_types"] = "none"
    return given


def _renewed(config: dict[str, Any]) -> dict[str, Any]:
    """Return a config of robosuite 1.2 to 1.4 as one of 1.5; others as they are.

    Those are of one arm's controller, and their goals are in the world's axes.
    """
    if config.get("type") not in part_models() or "control_delta" not in config:
        return config
    new = {_RENAMED.get(key, key): value for key, value in config.items()}
    new["input_type"] = "delta" if new.pop("control_delta") else "absolute"
    return {"input_ref_frame": "world"} | new
