"""Environments: the base of all classes, their registry, and `make`."""

from collections import OrderedDict
from collections.abc import Callable, KeysView, Mapping
from typing import Any

import numpy as np

from wbc_suite.compat.robosuite.environments.observations import (
    Observation,
    Observing,
    PolledObservables,
)
from wbc_suite.compat.robosuite.environments.scene_text import (
    load_scene,
    scene_as_it_is,
)
from wbc_suite.compat.robosuite.forwarding import does_nothing
from wbc_suite.compat.robosuite.renderers import Viewer, load_renderer_config
from wbc_suite.compat.robosuite.utils.binding_utils import (
    MjSim,
)
from wbc_suite.compat.robosuite.utils.observables import Observable
from wbc_suite.compat.robosuite.utils.sim_utils import (
    check_contact,
    get_contacts,
)
from wbc_suite.envs import RobotEnv as Core
from wbc_suite.errors import UnknownNameError
from wbc_suite.typing import Vector

REGISTERED_ENVS: dict[str, type["MujocoEnv"]] = {}
"""Classes of environments by name."""
ALL_ENVIRONMENTS: KeysView[str] = REGISTERED_ENVS.keys()

_BASES = ("MujocoEnv", "RobotEnv", "ManipulationEnv", "TwoArmEnv")
OURS_ALONE: dict[str, type["MujocoEnv"]] = {}
"""Our tasks that robosuite does not have; `make` knows them, listings do not."""
_OURS_ALONE = ("Carry", "LocoLift", "Reach", "Stand", "WalkTo")


def register_env(target_class: type["MujocoEnv"]) -> None:
    """Make a class known to `make` by its name; subclasses are known by themselves."""
    name = target_class.__name__
    own = name in _OURS_ALONE and target_class.benchmark == name
    (OURS_ALONE if own else REGISTERED_ENVS)[name] = target_class


def make(env_name: str, *args: Any, **kwargs: Any) -> Any:
    """Make an environment with robosuite's arguments and defaults.

    Raises:
        UnknownNameError: If benchmark, robot, controller or camera is unknown.
        ConfigError: If an argument is neither robosuite's nor ours.
    """
    known = OURS_ALONE | REGISTERED_ENVS
    if env_name not in known:
        raise UnknownNameError("environment", env_name, known)
    return known[env_name](*args, **kwargs)


class MujocoEnv(Observing):
    """A simulation with robosuite's calls around one of our environments.

    A subclass builds its scene in `_load_model`, looks elements up in
    `_setup_references`, returns observations from `_setup_observables`, places objects
    in `_reset_internal`, and defines `reward` and `_check_success`.

    Attributes:
        env: Our environment.
        sim: Model and state, under robosuite's names.
        robots: The robots.
        model: The scene: a `Task`, or the model of `sim`.
        rng: The generator that samplers of a subclass may use.
    """

    benchmark: str | None = None
    """Name of our benchmark; None for the scene of `_load_model`."""
    env: Core

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if cls.__name__ not in _BASES:
            register_env(cls)

    def __init__(
        self,
        *,
        control_freq: float = 20,
        horizon: int | None = 1000,
        ignore_done: bool = False,
        hard_reset: bool = True,
        reward_scale: float = 1.0,
        seed: int | None = None,
        **arguments: Any,
    ) -> None:
        self.control_freq, self.horizon = control_freq, horizon
        self.ignore_done, self.hard_reset = bool(ignore_done), hard_reset
        self.reward_scale, self.seed_of_next = reward_scale, seed
        self.rng, self.seed = np.random.default_rng(seed), seed
        self.has_renderer = bool(arguments.get("has_renderer", False))
        self.has_offscreen_renderer = arguments.get("has_offscreen_renderer", True)
        self.render_camera = arguments.get("render_camera", "frontview")
        self.control_timestep = 1.0 / control_freq
        self.arguments = arguments
        self.name, self.unwrapped = type(self).__name__, self
        self.renderer = str(arguments.get("renderer", "mjviewer"))
        load_renderer_config(self.renderer)  # raises for unknown ones
        self.viewer = Viewer()
        self.timestep, self.done, self.deterministic_reset = 0, False, False
        self._stepping = False
        self._ep_meta: dict[str, Any] = {}
        self._xml_processor: Callable[[str], str] | None = None
        self.model: Any = None
        self._build()

    # Building.

    def _build(self) -> None:
        """Load the scene and compile it."""
        self._load_model()
        self.env = self._make_core()
        self.fresh = True
        self._adopt()

    def _make_core(self) -> Core:
        raise NotImplementedError

    def _adopt(self) -> None:
        """Take over model, robots and observations of our environment."""
        core = self.env
        self.sim = self._make_sim(core)
        self.model_timestep = core.simulation.timestep
        self.render, self._close_core = core.render, core.close
        if self.model is None or self.benchmark is not None:
            self.model = self.sim.model
        self._setup_references()
        self._observables: dict[str, Observable] = self._setup_observables()
        polled: Any = PolledObservables(core.observables, self)
        core.observables = polled

    def _make_sim(self, core: Core) -> MjSim:
        return MjSim(
            core.simulation.model,
            core.simulation.data,
            write_xml=lambda: scene_as_it_is(core),
            cameras=core.cameras,
            start=core.simulation.start,
            read=lambda: core.physics_state,
            restore=core.restore,
        )

    def _load_model(self) -> None:
        """Build the scene: a subclass sets `self.model` to a `ManipulationTask`."""

    def _setup_references(self) -> None:
        """Look up elements of the compiled scene."""

    def _setup_observables(self) -> dict[str, Observable]:
        """Return the observations by name."""
        return OrderedDict()

    def _reset_internal(self) -> None:
        """Place what is in the scene."""

    # Episodes.

    def reset(self) -> Observation:
        """Start an episode; return the observation.

        With `hard_reset` a scene of a subclass is built again, so that its sizes are
        drawn again.
        """
        if self.hard_reset and self.benchmark is None and not self.fresh:
            active = self._observables
            self._build()
            for name, old in active.items():
                if name in self._observables:
                    self._observables[name].set_active(old.is_active())
        self.env.begin(self.seed_of_next)
        self.seed_of_next = None  # the first episode's only
        self._reset_internal()
        self.env.simulation.start()
        return self._begin()

    def _begin(self) -> Observation:
        self.timestep, self.done, self.fresh = 0, False, False
        self.sim.whole_states = True
        self._reset_observables()
        return self._get_observations(force_update=True)

    def step(self, action: Any) -> tuple[Observation, float, bool, dict[str, Any]]:
        """Advance one control period, of a first episode if none has begun.

        Raises:
            ValueError: If the episode is over.
        """
        if self.fresh:
            self.reset()
        if self.done:
            raise ValueError("executing action in terminated episode")
        self.timestep += 1
        self._stepping = True
        try:
            self._pre_action(action, True)
        finally:
            self._stepping = False
        self._last_info = self.env.advance(self._of_enabled_parts(action))[3]
        reward, done, info = self._post_action(action)
        if "physics_error" in self._last_info:
            done = self.done = True
        return self._get_observations(), reward, done, self._last_info | info

    def _of_enabled_parts(self, action: Any) -> Any:
        """Return the action without that of parts that are switched off."""
        return action

    def _post_action(self, action: Any) -> tuple[float, bool, dict[str, Any]]:
        """Return reward, whether the episode is over, and more for `info`."""
        reward = self.reward(action)
        late = self.horizon is not None and self.timestep >= self.horizon
        self.done = late and not self.ignore_done
        return reward, self.done, {}

    def reward(self, action: Any = None) -> float:
        """Return the reward of the present state."""
        raise NotImplementedError

    def _check_success(self) -> bool:
        """Whether the task is solved now."""
        return False

    @property
    def cur_time(self) -> float:
        """Time since the begin of the episode, s; writing it has no effect."""
        return self.timestep * self.control_timestep

    @cur_time.setter
    def cur_time(self, value: float) -> None:
        """Do nothing: loops of scripts add to it beside `timestep`."""

    @property
    def action_spec(self) -> tuple[Vector, Vector]:
        """Least and greatest actions."""
        layout = self.env.action_layout
        return layout.low.copy(), layout.high.copy()

    @property
    def action_dim(self) -> int:
        """Number of action values."""
        return self.env.action_layout.size

    # Contacts and scenes.

    def check_contact(self, geoms_1: Any, geoms_2: Any = None) -> bool:
        """Whether geoms, or a model's, touch others, or anything."""
        return check_contact(self.sim, geoms_1, geoms_2)

    def get_contacts(self, model: Any) -> set[str]:
        """Return the names of the geoms that touch a model."""
        return get_contacts(self.sim, model)

    def clear_objects(self, object_names: Any) -> None:
        """Move objects far away."""
        names = [object_names] if isinstance(object_names, str) else object_names
        for name in names:
            self.sim.data.set_joint_qpos(f"{name}_joint0", (10, 10, 10, 1, 0, 0, 0))

    def set_xml_processor(self, processor: Callable[[str], str] | None) -> None:
        """Change the text of scenes before `reset_from_xml_string` reads them."""
        self._xml_processor = processor

    def edit_model_xml(self, xml_str: str) -> str:
        """Return the text unchanged: it has no paths to edit."""
        return xml_str

    def reset_from_xml_string(self, xml_string: str) -> None:
        """Start an episode in the scene of a text, of `sim.model.get_xml()`.

        Raises:
            DatasetError: If its elements are not those of this environment.
        """
        if self._xml_processor is not None:
            xml_string = self._xml_processor(xml_string)
        scene = load_scene(xml_string, self.sim.model._model)
        scene.begin(self.env)
        scene.write(self.sim.model._model)
        self.env.simulation.start()
        self.env.cameras.close()
        self._begin()

    def get_ep_meta(self) -> dict[str, Any]:
        """Return the value of `set_ep_meta`."""
        return dict(self._ep_meta)

    def set_ep_meta(self, meta: Mapping[str, Any]) -> None:
        """Store data of the episode."""
        self._ep_meta = dict(meta)

    def unset_ep_meta(self) -> None:
        """Delete the data of the episode."""
        self._ep_meta = {}

    visualize = does_nothing("scenes have no visual marks; see `Indicators`")
    update_state = does_nothing("values are read when they are asked for")
    initialize_renderer = does_nothing("renderers are made when they are needed")
    _pre_action = does_nothing("a subclass may, before each control period")

    @property
    def _visualizations(self) -> set[str]:
        return {"env", "robots", "grippers"}

    def close(self) -> None:
        """Free renderers and pages."""
        self._close_core()

    close_renderer = close
