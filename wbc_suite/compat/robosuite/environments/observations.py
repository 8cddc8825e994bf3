"""Observations of robots, of our benchmarks' objects and of cameras."""

from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import mujoco
import numpy as np

from wbc_suite.compat.robosuite import macros
from wbc_suite.compat.robosuite.forwarding import does_nothing
from wbc_suite.compat.robosuite.utils.mjcf_utils import IMAGE_CONVENTION_MAPPING
from wbc_suite.compat.robosuite.utils.observables import MODIFIERS, Observable, sensor
from wbc_suite.compat.robosuite.utils.transform_utils import mat2quat
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.sensing.cameras import CameraRequest
from wbc_suite.sensing.proprioception import proprioception
from wbc_suite.sensing.reading import Reading, body_quat

Observation = OrderedDict[str, Any]


class Observing:
    """Samples the observations of an environment and hands them out."""

    env: Any
    control_freq: float
    model_timestep: float
    _observables: dict[str, Observable]

    def _reset_observables(self) -> None:
        for observable in self._observables.values():
            observable.reset()

    def _update_observables(self, force: bool = False) -> None:
        """Sample what is due after one physics step, or everything."""
        self._obs_cache = {}
        self.env.observables.forget_pictures()
        for observable in self._observables.values():
            observable.update(self.model_timestep, self._obs_cache, force)

    def follows_physics(self) -> bool:
        """Whether an observation is sampled otherwise than once in a control period."""
        return not all(
            observable.is_plain_at(self.control_freq)
            for observable in self._observables.values()
            if observable.is_enabled()
        )

    def _get_observations(self, force_update: bool = False) -> Observation:
        """Return what is enabled and active, and each modality in one vector."""
        if force_update or not self.follows_physics():
            self._update_observables(force=True)
        found: Observation = OrderedDict()
        groups: dict[str, list[Any]] = {}
        for name, observable in self._observables.items():
            if observable.is_enabled() and observable.is_active():
                found[name] = observable.obs
                if not observable.modality.startswith("image"):
                    parts = groups.setdefault(observable.modality, [])
                    parts.append(np.ravel(observable.obs))
        for modality, parts in groups.items():
            found[f"{modality}-state"] = np.concatenate(parts)
        return found

    def observation_spec(self) -> Observation:
        """Return an example of the observations."""
        return self._get_observations(force_update=True)

    def add_observable(self, observable: Observable) -> None:
        """Add an observation with a new name.

        Raises:
            ConfigError: If the name is taken.
        """
        if observable.name in self._observables:
            raise ConfigError(f"There is an observable '{observable.name}' already.")
        self._observables[observable.name] = observable

    def modify_observable(
        self, observable_name: str, attribute: str, modifier: Any
    ) -> None:
        """Change an observation: its sensor, corrupter, filter, delayer, ...

        Raises:
            UnknownNameError: If there is no such observation, or no such attribute.
        """
        if observable_name not in self._observables:
            known = self._observables
            raise UnknownNameError("observable", observable_name, known)
        if attribute not in MODIFIERS:
            raise UnknownNameError("attribute", attribute, MODIFIERS)
        getattr(self._observables[observable_name], f"set_{attribute}")(modifier)

    def _chosen(self, test: Callable[[Observable], bool]) -> set[str]:
        return {name for name, o in self._observables.items() if test(o)}

    observation_names = property(
        lambda self: {*self._observables}, doc="Names of all observations."
    )
    observation_modalities = property(
        lambda self: {o.modality for o in self._observables.values()},
        doc="Modalities of all observations.",
    )
    enabled_observables = property(
        lambda self: self._chosen(Observable.is_enabled),
        doc="Names of the observations that are sampled.",
    )
    active_observables = property(
        lambda self: self._chosen(Observable.is_active),
        doc="Names of the observations that are returned.",
    )


class PolledObservables:
    """Our observables, with those of robosuite's form sampled after physics steps."""

    def __init__(self, own: Any, env: Any) -> None:
        self._own, self._env = own, env
        self._pictures: dict[str, Any] = {}

    def __getattr__(self, name: str) -> Any:
        return getattr(self.__dict__["_own"], name)

    @property
    def follows_physics(self) -> bool:
        """Whether `sample` must be called after every physics step."""
        return self._env.follows_physics()

    def sample(self) -> None:
        """Sample what is due."""
        self._env._update_observables()

    start = does_nothing("the environment starts its own")
    update = does_nothing("the environment updates its own")

    def forget_pictures(self) -> None:
        """Draw pictures again when they are asked for."""
        self._pictures = {}

    def picture(self, key: str) -> Any:
        """Return one of the observed pictures as OpenGL has it, drawn once a state."""
        core = self._env.env
        if not self._pictures:
            self._pictures = core.cameras.observation()
        step = IMAGE_CONVENTION_MAPPING[macros.IMAGE_CONVENTION]
        picture = self._pictures[key][::-step]
        if key.endswith("_depth"):
            picture = self._env.sim.opengl_depth(picture).astype(np.float32)
        return np.ascontiguousarray(picture)


def robot_observables(
    robot: Any, rate: float, *, as_there: bool = True
) -> list[Observable]:
    """Return the observables of one robot; modality `{prefix}proprio`.

    In robosuite `eef_quat` is that of the last body, in ours that of the grip site.
    """
    state, prefix = robot._state, robot.robot_model.naming_prefix
    data: mujoco.MjData = state.data
    v = robot._ref_joint_vel_indexes
    made: dict[str, Callable[[], Any]] = {}
    for name, reading in proprioception(state).items():
        made[name.removeprefix(prefix)] = reading.bind(data)
        if name == f"{prefix}joint_vel":
            made["joint_acc"] = lambda: data.qacc[v]
        if name.endswith("eef_quat"):
            key = f"{name.removeprefix(prefix)}_site"
            made[key] = reading.bind(data)
    several = len(robot.arms) > 1
    for arm, name in robot.robot_model.eef_name.items() if as_there else ():
        body = robot.sim.model.index("body", name)
        key = f"{arm}_eef_quat" if several else "eef_quat"
        made[key] = body_quat(body).bind(data)
    for arm in robot.arms:
        key = f"{arm}_gripper" if several else "gripper"
        made |= _gripper(robot, arm, key)
        if robot.is_mobile:
            made |= _base_to_hand(robot, arm, f"{arm}_" if several else "")
    modality = f"{prefix}proprio"
    return [_observable(prefix + k, read, modality, rate) for k, read in made.items()]


def _gripper(robot: Any, arm: str, key: str) -> dict[str, Callable[[], Any]]:
    data = robot._state.data
    q = robot._ref_gripper_joint_pos_indexes[arm]
    v = robot._ref_gripper_joint_vel_indexes[arm]
    if not q:
        return {}
    return {f"{key}_qpos": lambda: data.qpos[q], f"{key}_qvel": lambda: data.qvel[v]}


def _base_to_hand(robot: Any, arm: str, side: str) -> dict[str, Callable[[], Any]]:
    data, site = robot._state.data, robot.eef_site_id[arm]

    def position() -> Any:
        pose = robot._state.root_pose
        return pose.rotation.T @ (data.site_xpos[site] - pose.translation)

    def quat() -> Any:
        R = robot._state.root_pose.rotation
        return mat2quat(R.T @ data.site_xmat[site].reshape(3, 3))

    return {
        f"base_to_{side}eef_pos": position,
        f"base_to_{side}eef_quat": quat,
        f"base_to_{side}eef_quat_site": quat,
    }


def object_observables(
    readings: Mapping[str, Reading], data: mujoco.MjData, rate: float
) -> list[Observable]:
    """Return the observables of our benchmark's objects; modality `object`."""
    return [
        _observable(name, reading.bind(data), "object", rate)
        for name, reading in readings.items()
    ]


def picture_keys(requests: Iterable[CameraRequest]) -> dict[str, str]:
    """Return robosuite's keys of the observed pictures, and ours."""
    found: dict[str, str] = {}
    for request in requests:
        found[f"{request.name}_image"] = f"{request.name}_image"
        if request.depth:
            found[f"{request.name}_depth"] = f"{request.name}_depth"
        for level in request.segmentations:
            theirs = f"{request.name}_segmentation_{level}"
            found[theirs] = request.segmentation_key(level)
    return found


def camera_observables(
    keys: Iterable[str], picture: Callable[[str], Any], rate: float
) -> list[Observable]:
    """Return the observables of cameras; modality `image`."""
    found = []
    for key in keys:
        function = sensor("image")(lambda cache, key=key: picture(key))
        found.append(Observable(key, function, sampling_rate=rate))
    return found


def _observable(
    name: str, read: Callable[[], Any], modality: str, rate: float
) -> Observable:
    @sensor(modality)
    def observe(cache: dict[str, Any]) -> Any:
        values = np.array(read(), dtype=np.float64)
        return values[0] if values.shape == (1,) and modality == "object" else values

    observe.__name__ = name
    return Observable(name, observe, sampling_rate=rate)
