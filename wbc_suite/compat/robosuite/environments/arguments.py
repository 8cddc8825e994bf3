"""robosuite's arguments of environments as ours, those of tasks as keys of files."""

import json
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from wbc_suite.benchmark import Benchmark, load_benchmark
from wbc_suite.benchmark.base import BenchmarkFile
from wbc_suite.catalogue import Catalogue
from wbc_suite.compat.robosuite.controllers.configs import (
    load_composite_controller_config,
)
from wbc_suite.control.part.registry import PART_CONTROLLERS
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.robot import RobotDescription

IGNORED = (
    *("has_offscreen_renderer", "render_collision_mesh", "render_visual_mesh"),
    *("render_gpu_device_id", "renderer", "renderer_config", "robot_configs"),
    *("render_camera_size", "reward_normalised", "camera_renderer", "env_version"),
)
"""Arguments without a meaning here."""

_CONFIGURATIONS = {"bimanual": "single-robot"}
"""Arrangements of robots that robosuite 1.5 renamed."""

_RENAMED = {"damping": "damping_ratio", "damping_limits": "damping_ratio_limits"}
"""Keys of controllers that robosuite 1.5 renamed."""

DEFAULT_WIPE_CONFIG: dict[str, Any] = {
    "arm_limit_collision_penalty": -10.0,
    "wipe_contact_reward": 0.01,
    "unit_wiped_reward": 50.0,
    "ee_accel_penalty": 0,
    "excess_force_penalty_mul": 0.05,
    "distance_multiplier": 5.0,
    "distance_th_multiplier": 5.0,
    "table_full_size": [0.5, 0.8, 0.05],
    "table_offset": [0.15, 0, 0.9],
    "table_friction": [0.03, 0.005, 0.0001],
    "table_friction_std": 0,
    "table_height": 0.0,
    "table_height_std": 0.0,
    "line_width": 0.04,
    "two_clusters": False,
    "coverage_factor": 0.6,
    "num_markers": 100,
    "contact_threshold": 1.0,
    "pressure_threshold": 0.5,
    "pressure_threshold_max": 60.0,
    "print_results": False,
    "get_info": False,
    "use_robot_obs": True,
    "use_contact_obs": True,
    "early_terminations": True,
    "use_condensed_obj_obs": True,
}
"""robosuite's default `task_config` of Wipe: lengths in m, forces in N."""

_KEYS = {
    "table_full_size": "table.size",
    "table_friction": "table.friction",
    "table_offset": "table.center",
    "use_latch": "latch",
    "bin1_pos": "source.center",
    "bin2_pos": "target.center",
    "z_rotation": "region.yaw",
    "peg_radius": "peg.radius",
    "peg_length": "peg.half_length",
    "bin_size": "bin.size",
}
"""Keys of our files for robosuite's arguments; the values are the same."""

_KEYS_OF_WIPE = _KEYS | {
    "coverage_factor": "stroke.coverage",
    "line_width": "stroke.width",
    "num_markers": "stroke.marks",
    "unit_wiped_reward": "reward.mark",
    "wipe_contact_reward": "reward.contact",
    "excess_force_penalty_mul": "reward.excess",
    "distance_multiplier": "reward.reach",
    "distance_th_multiplier": "reward.reach_scale",
    "pressure_threshold": "reward.least_force",
    "pressure_threshold_max": "reward.most_force",
}
"""The same for keys of `task_config`."""

_CONVERTED = ("nut_type", "object_type", "single_object_mode", "tables_boundary")
ARGUMENTS = frozenset({*_KEYS, *_CONVERTED, "task_config", "prehensile", "z_offset"})
"""Arguments of robosuite's tasks beside those of all environments."""

_READ_ELSEWHERE = ("table_height", "table_height_std")
_WITHOUT_EFFECT = ("contact_threshold", "print_results", "get_info")
"""Keys of `task_config` that our reward does not have."""


def ours(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return our arguments for robosuite's."""
    kwargs = {"use_camera_obs": True} | {
        key: value for key, value in given.items() if key not in IGNORED
    }
    if kwargs.pop("has_renderer", False):
        kwargs["render_mode"] = "human"
    camera = kwargs.get("render_camera")
    if isinstance(camera, list | tuple):
        camera = camera[0]
    kwargs["render_camera"] = "frontview" if camera in (None, "free") else camera
    configuration = str(kwargs.get("env_configuration") or "default")
    configuration = configuration.removeprefix("single-arm-")
    kwargs["env_configuration"] = _CONFIGURATIONS.get(configuration, configuration)
    for key in ("env_name", "type"):
        kwargs.pop(key, None)
    return kwargs


def controller_of(config: Any, robot: RobotDescription) -> Any:
    """Return the controller of one robot: the given one, or robosuite's default."""
    if config is None:
        return load_composite_controller_config(robot=robot)
    return updated(config) if isinstance(config, dict) else config


def updated(config: dict[str, Any]) -> dict[str, Any]:
    """Return a config of robosuite 1.2 to 1.4, of one arm, in the form of 1.5."""
    if config.get("type") not in PART_CONTROLLERS:
        return config
    if "control_delta" not in config:
        return config
    new = {_RENAMED.get(key, key): value for key, value in config.items()}
    new["input_type"] = "delta" if new.pop("control_delta") else "absolute"
    return {"input_ref_frame": "world"} | new


def one_each(given: Any, count: int, kind: str) -> list[Any]:
    """Return one value for each robot, of one for all or a list."""
    if not isinstance(given, list | tuple):
        return [given] * count
    if len(given) == 1:
        return list(given) * count
    if len(given) != count:
        raise UnknownNameError(kind, given, (f"{count} values, or one for all",))
    return list(given)


def changed_task(
    name: str, arguments: Mapping[str, Any]
) -> Callable[[], Benchmark] | str:
    """Return our benchmark with robosuite's arguments, or its name if there are none.

    Raises:
        ConfigError: If an argument is not of this task, or cannot be had here.
    """
    given = {key: arguments[key] for key in ARGUMENTS if key in arguments}
    changes = dict(_changes(name, given))
    if not changes:
        return name
    data = _data(name)
    known = data.keys() | ({"pick_one"} if {"objects", "nuts"} & data.keys() else set())
    for key in changes:
        if key.partition(".")[0] not in known:
            raise ConfigError(f"{name} does not have all of: {', '.join(given)}.")
    lines = (_flat(data) | changes).items()
    text = "".join(f"{key} = {json.dumps(value)}\n" for key, value in lines)

    def make() -> Benchmark:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "task.toml"
            file.write_text(text, encoding="utf-8")
            return load_benchmark(file)

    return make


def _changes(name: str, given: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield keys of our file and their new values."""
    for key, value in given.items():
        if key == "task_config":
            yield from _of_wipe({} if value is None else value)
        elif key in ("prehensile", "z_offset"):
            if value != {"prehensile": True, "z_offset": 0.0}[key]:
                raise ConfigError(f"{name}: {key} = {value!r} is not supported.")
        elif key in _CONVERTED:
            yield from _converted(key, value, given)
        elif key == "table_full_size" and name.startswith(("PickPlace", "TwoArmHand")):
            yield from _size_of_other_tables(name, value)
        elif value is not None:
            yield _KEYS[key], _plain(value)


def _converted(
    key: str, value: Any, given: Mapping[str, Any]
) -> Iterator[tuple[str, Any]]:
    if key == "tables_boundary":
        length, width, thickness = map(float, value)
        yield "table.size", [length, width / 4, thickness]
        yield "table.center", [0.0, 3 / 8 * width, 0.8]
    elif key == "single_object_mode":
        if value == 1:
            yield "pick_one", True
    elif given.get("single_object_mode", 2) == 2 and value is not None:
        if key == "nut_type":
            yield "nuts", [f"{value.capitalize()}Nut"]
        else:
            yield "objects", [value.capitalize()]


def _size_of_other_tables(name: str, size: Any) -> Iterator[tuple[str, Any]]:
    """Yield where objects lie in a bin of a size, or the size of a table of a half."""
    length, width, thickness = map(float, size)
    if name.startswith("PickPlace"):
        for axis, whole in (("x", length), ("y", width)):
            half = round(whole / 2 - 0.05, 9)
            yield f"region.{axis}", [-half, half]
    else:
        yield "table.size", [length, width / 4, thickness]
        yield "table.center", [0.0, -3 / 8 * width, 0.8]


def _of_wipe(config: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for key, value in config.items():
        default = DEFAULT_WIPE_CONFIG.get(key)
        if value == default or key in (*_WITHOUT_EFFECT, *_READ_ELSEWHERE):
            continue
        if key == "arm_limit_collision_penalty":
            yield "reward.collision", -float(value)
        elif key in _KEYS_OF_WIPE:
            yield _KEYS_OF_WIPE[key], _plain(value)
        else:
            raise ConfigError(f"Wipe: task_config: {key} = {value!r} is not supported.")


def _plain(value: Any) -> Any:
    """Return a value without arrays, as TOML and JSON write it."""
    return np.asarray(value).tolist()


def _data(name: str) -> Mapping[str, Any]:
    """Return the file of a task of the catalogue, with that which it extends."""
    path = Catalogue().find("tasks", name, kind="benchmark file")
    return BenchmarkFile.read(path).data


def _flat(data: Mapping[str, Any], start: str = "") -> dict[str, Any]:
    """Return nested tables as one of dotted keys."""
    found: dict[str, Any] = {}
    for key, value in data.items():
        if isinstance(value, Mapping):
            found |= _flat(value, f"{start}{key}.")
        else:
            found[start + key] = value
    return found
