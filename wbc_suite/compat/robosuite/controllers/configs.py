"""robosuite's default configs, as dictionaries that scripts edit.

Numbers are those of robosuite 1.5.2's configs. A part's config is complete: it has all
keys of its type.
"""

import copy
from collections.abc import Collection
from pathlib import Path
from typing import Any

from wbc_suite.config_files import read_json
from wbc_suite.control import COMPOSITES
from wbc_suite.control import load_composite_controller_config as load_ours
from wbc_suite.control.composite.registry import default_composite
from wbc_suite.control.robot_parts import hands_of, parts_of
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.robot import RobotDescription, load_robot

PART_CONTROLLER_INFO = {
    "JOINT_VELOCITY": "Joint Velocity",
    "JOINT_TORQUE": "Joint Torque",
    "JOINT_POSITION": "Joint Position",
    "OSC_POSITION": "Operational Space Control (Position Only)",
    "OSC_POSE": "Operational Space Control (Position + Orientation)",
    "IK_POSE": "Inverse Kinematics Control (Position + Orientation)",
}
ALL_PART_CONTROLLERS = PART_CONTROLLER_INFO.keys()

_INPUT = {"input_max": 1, "input_min": -1}
_RAMP = {"interpolation": None, "ramp_ratio": 0.2}
_GAINS = {
    "damping_ratio": 1,
    "impedance_mode": "fixed",
    "kp_limits": [0, 300],
    "damping_ratio_limits": [0, 10],
}
_FRAME = {"input_type": "delta", "input_ref_frame": "base"}
_STEP = [0.05, 0.05, 0.05, 0.5, 0.5, 0.5]


def _moving(kp: float, output: Any, **more: Any) -> dict[str, Any]:
    """Return the keys of a part whose actions are steps of at most `output`."""
    low = [-x for x in output] if isinstance(output, list) else -output
    keys = {**_INPUT, "output_max": output, "output_min": low, "kp": kp}
    return keys | more | _RAMP


PARTS: dict[str, dict[str, Any]] = {
    "OSC_POSE": _moving(
        150,
        _STEP,
        **_GAINS,
        position_limits=None,
        orientation_limits=None,
        uncouple_pos_ori=True,
        **_FRAME,
    ),
    "OSC_POSITION": _moving(150, _STEP[:3], **_GAINS, position_limits=None, **_FRAME),
    "IK_POSE": {"ik_pos_limit": 0.02, "ik_ori_limit": 0.05, **_RAMP},
    "JOINT_POSITION": _moving(50, 0.05, **_GAINS, qpos_limits=None),
    "JOINT_VELOCITY": _moving(3.0, 0.5, velocity_limits=[-1, 1]),
    "JOINT_TORQUE": {
        **_INPUT,
        "output_max": 0.1,
        "output_min": -0.1,
        "torque_limits": None,
        **_RAMP,
    },
}
PARTS = {kind: {"type": kind, **keys} for kind, keys in PARTS.items()}
"""Default config of each part controller."""

BODY = {
    "type": "JOINT_POSITION",
    **_INPUT,
    "output_max": 0.5,
    "output_min": -0.5,
    "kd": 200,
    "kv": 200,
    "kp": 1000,
    "velocity_limits": [-1, 1],
    "kp_limits": [0, 1000],
    **_RAMP,
}
"""Default config of torso, head and legs."""

BASE = {"type": "JOINT_VELOCITY", "interpolation": "null"}


def load_part_controller_config(
    custom_fpath: str | Path | None = None, default_controller: str | None = None
) -> dict[str, Any]:
    """Return the config of a part controller: a JSON file's, or a type's defaults.

    Raises:
        ConfigError: If neither is given, or the file cannot be read.
        UnknownNameError: If there is no such type.
    """
    if default_controller is not None:
        kind = str(default_controller).upper()
        if kind not in PARTS:
            raise UnknownNameError("part controller", default_controller, PARTS)
        return copy.deepcopy(PARTS[kind])
    if custom_fpath is None:
        raise ConfigError("load_part_controller_config: name a file or a type.")
    return read_json(Path(custom_fpath))


def load_composite_controller_config(
    controller: str | Path | None = None, robot: str | RobotDescription | None = None
) -> dict[str, Any]:
    """Return a composite's config, complete, in robosuite's layout.

    A robot's default has its parts. BASIC and HYBRID_MOBILE_BASE have all that there
    are, and a robot takes those that it has. A whole-body controller's config is ours.
    """
    name = None if controller is None else str(controller)
    if name is not None and name.endswith(".json"):
        return read_json(Path(name))
    description = described(robot) if isinstance(robot, str) else robot
    if name is None and description is not None:
        name = default_composite(description)
    kind = str(name or "BASIC").upper()
    if kind in PARTS:
        return _composite("BASIC", description, kind)
    if kind in ("BASIC", "HYBRID_MOBILE_BASE"):
        own = description if controller is None else None
        return _composite(kind, own, "OSC_POSE")
    return load_ours(name, description)


def described(robot: str) -> RobotDescription | None:
    """Return the robot of a model's class, or of the catalogue, by name.

    None for another name, as robosuite has it: its scripts ask for `args.robots[0]`.
    """
    from wbc_suite.compat.robosuite.models.robots import REGISTERED_ROBOTS

    named = {name.casefold(): cls for name, cls in REGISTERED_ROBOTS.items()}
    cls = named.get(robot.casefold())
    try:
        return load_robot(robot) if cls is None else cls().description
    except UnknownNameError:
        return None


def is_part_controller_config(config: dict[str, Any]) -> bool:
    """Whether a config is that of a part alone."""
    return "body_parts" not in config and config.get("type") in PARTS


def refactor_composite_controller_config(
    controller_config: dict[str, Any], robot_type: str, arms: Collection[str]
) -> dict[str, Any]:
    """Return a robot's default config with the config of one part in its arms."""
    if not is_part_controller_config(controller_config):
        return controller_config
    config = load_composite_controller_config(robot=robot_type)
    for arm in arms:
        own = copy.deepcopy(controller_config) | {"gripper": {"type": "GRIP"}}
        config["body_parts"][arm] = own
    return config


def _composite(kind: str, robot: RobotDescription | None, arm: str) -> dict[str, Any]:
    """Return a composite with the same controller in all arms.

    Parts are those of a robot, or without one all that there are.
    """
    names: tuple[str, ...] = ("right", "left", "torso", "head", "base", "legs")
    hands: Collection[str] = ("right", "left")
    if robot is not None:
        names, hands = tuple(parts_of(robot)), hands_of(robot)
    parts: dict[str, Any] = {}
    for name in names:
        if name in hands:
            given = load_part_controller_config(default_controller=arm)
            parts[name] = given | {"gripper": {"type": "GRIP"}}
        else:
            parts[name] = copy.deepcopy(BASE if name == "base" else BODY)
    return {"type": kind, "body_parts": parts}


ALL_COMPOSITE_CONTROLLERS = COMPOSITES
