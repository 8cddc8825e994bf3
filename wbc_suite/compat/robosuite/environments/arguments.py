"""robosuite's arguments of environments, as ours."""

from collections.abc import Mapping
from typing import Any

from wbc_suite.compat.robosuite.controllers.configs import (
    load_composite_controller_config,
)
from wbc_suite.control.part.registry import PART_CONTROLLERS
from wbc_suite.errors import UnknownNameError
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
