"""robosuite's interface: replace `import robosuite` by this module.

`docs/from_robosuite.md` maps every name. Robots, controllers and scenes are ours, so
states and XML of robosuite's own datasets do not fit; actions, keys of observations,
rewards and calls do.
"""

import copy
import json
from pathlib import Path
from typing import Any

from wbc_suite.benchmark import benchmark_names
from wbc_suite.catalogue import Catalogue
from wbc_suite.compat.robosuite_env import GymWrapper, RobosuiteEnv
from wbc_suite.control import composite_names
from wbc_suite.control import load_composite_controller_config as _load_composite
from wbc_suite.control.part import registry
from wbc_suite.errors import ConfigError, DatasetError

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

__version__ = "1.5.2"  # the robosuite version of this interface

_IGNORED = (
    *("has_offscreen_renderer", "render_collision_mesh", "render_visual_mesh"),
    *("render_gpu_device_id", "hard_reset", "renderer", "renderer_config"),
    *("render_camera_size", "reward_normalised", "camera_renderer"),
)
"""Arguments without a meaning here."""

_RENAMED = {"damping": "damping_ratio", "damping_limits": "damping_ratio_limits"}
"""Keys of controllers that robosuite 1.5 renamed."""

ALL_ENVIRONMENTS = benchmark_names()
ALL_COMPOSITE_CONTROLLERS = composite_names()
ALL_PART_CONTROLLERS = tuple(registry.part_models())


def __getattr__(name: str) -> Any:
    if name == "ALL_ROBOTS":
        return Catalogue().called("robots")
    if name == "ALL_GRIPPERS":
        return (*Catalogue().called("robots/gripper"), None)
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'")


def load_composite_controller_config(
    controller: str | Path | None = None, robot: str | None = None
) -> dict[str, Any]:
    """Return a composite's config; BASIC without a robot has all parts there are."""
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

    Raises:
        ConfigError: If neither is given, or the file cannot be read.
        UnknownNameError: If there is no such type.
    """
    if default_controller is not None:
        return registry.load_part_controller_config(default_controller)
    if custom_fpath is None:
        raise ConfigError("load_part_controller_config: name a file or a type.")
    try:
        return json.loads(Path(custom_fpath).read_text())
    except (OSError, ValueError) as error:
        raise ConfigError(f"{custom_fpath}: no controller in it: {error}") from error


def make(env_name: str, robots: Any = None, **kwargs: Any) -> RobosuiteEnv:
    """Make an environment with robosuite's arguments and defaults.

    Raises:
        UnknownNameError: If benchmark, robot, controller or camera is unknown.
        ConfigError: If an argument is neither robosuite's nor ours.
    """
    given = kwargs if robots is None else kwargs | {"robots": robots}
    return RobosuiteEnv(env_name, **_ours(given))


def make_from_env_args(env_args: str | dict[str, Any]) -> RobosuiteEnv:
    """Make the environment of a dataset's `env_args`, JSON text or a dictionary."""
    data = json.loads(env_args) if isinstance(env_args, str) else env_args
    if "env_name" not in data:
        raise DatasetError("env_args has no 'env_name'.")
    return make(**{**data.get("env_kwargs", {}), "env_name": data["env_name"]})


def make_from_dataset(path: str | Path) -> RobosuiteEnv:
    """Make the environment of an HDF5 dataset, by its attribute `env_args`."""
    import h5py

    from wbc_suite.recording import hdf5_reader
    from wbc_suite.recording.hdf5_check import open_safely

    with open_safely(Path(path)) as file, hdf5_reader.reading(Path(path)):
        data = hdf5_reader.child(file, "data", h5py.Group)
        env_args = None if data is None else hdf5_reader.attribute(data, "env_args")
    if env_args is None:
        raise DatasetError(f"{path}: no env_args in it.")
    return make_from_env_args(str(env_args))


def _ours(kwargs: dict[str, Any]) -> dict[str, Any]:
    """Return our arguments for robosuite's."""
    given = {"use_camera_obs": True, "horizon": 1000} | {
        key: value for key, value in kwargs.items() if key not in _IGNORED
    }
    if given.pop("has_renderer", False):
        given["render_mode"] = "human"
    given.setdefault("render_camera", "frontview")
    for key in ("env_name", "type", "env_version"):
        given.pop(key, None)
    for key in ("robots", "gripper_types", "base_types", "controller_configs"):
        value = given.get(key)
        if isinstance(value, list | tuple) and len(value) == 1:
            given[key] = value[0]
    if isinstance(given.get("controller_configs"), dict):
        given["controller_configs"] = _updated(given["controller_configs"])
    if given.get("gripper_types", "") is None:  # robosuite's value for no gripper
        given["gripper_types"] = "none"
    return given


def _updated(config: dict[str, Any]) -> dict[str, Any]:
    """Return a config of robosuite 1.2 to 1.4, of one arm, in the form of 1.5."""
    if not registry.is_part_controller(config.get("type")):
        return config
    if "control_delta" not in config:
        return config
    new = {_RENAMED.get(key, key): value for key, value in config.items()}
    new["input_type"] = "delta" if new.pop("control_delta") else "absolute"
    return {"input_ref_frame": "world"} | new
