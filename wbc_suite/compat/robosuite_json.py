"""Convert configs in the layout of robosuite 1.5's JSON files into ours.

    {"type": "BASIC",
     "composite_controller_specific_configs": {...},
     "body_parts": {"arms": {"right": {"type": "OSC_POSE", ..., "gripper": {...}}},
                    "torso": {...}, "head": {...}, "base": {...}, "legs": {...}}}

The config of one part alone, `{"type": "OSC_POSE", ...}`, applies to all arms.
Source of the keys: robosuite's documentation and its public default files.
"""

import logging
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from wbc_suite.compat.robosuite_whole_body_json import (
    check_keys,
    check_name,
    whole_body_config,
)
from wbc_suite.control.part.registry import is_part_controller, part_models
from wbc_suite.control.robot_parts import hands_of, parts_of
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.robot import RobotDescription

log = logging.getLogger(__name__)

SPECIFIC = "composite_controller_specific_configs"
PARTS = ("right", "left", "torso", "head", "base", "legs")

KEYS = ("type", SPECIFIC, "body_parts", "body_part_ordering")

IGNORED = {
    *("uncouple_pos_ori", "lite_physics", "policy_freq", "damping_ratio_limits"),
    *("control_ori", "ik_pos_limit", "ik_ori_limit", "ik_integration_dt", "ki", "kv"),
    *("ik_pseudo_inverse_damping", "ik_step_limit", "converge_steps", "ref_name"),
    *("use_action_scaling", "use_torque_compensation", "actuator_range", "eef_name"),
    *("joint_indexes", "naming_prefix", "part_name", "robot_name", "ndim", "load_urdf"),
    *("velocity_limits", "torque_limits", "position_limits", "orientation_limits"),
    *("qpos_limits", "kp", "kd", "damping_ratio", "kp_limits", "impedance_mode"),
    *("interpolation", "ramp_ratio", "input_type", "input_ref_frame", "control_delta"),
    *("input_min", "input_max", "output_min", "output_max", "gripper"),
}
"""Keys of robosuite's parts; a warning lists those that our controller lacks."""

OTHER_UNITS = {"JOINT_VELOCITY": {"kp", "ki", "kd"}, "BASE_VELOCITY": {"kp", "kd"}}
"""Gains with other units in robosuite, or without effect there."""

Named = Callable[[str], dict[str, Any]]


def convert(
    config: Mapping[str, Any],
    robot: RobotDescription | None,
    source: str,
    named: Named,
) -> dict[str, Any] | None:
    """Return the equivalent config in our layout, or None for one in our layout.

    One warning lists the ignored keys.

    Args:
        config: Any config.
        robot: The robot that it is for.
        source: The config's name in messages.
        named: Returns our own config of a composite of that name for the robot.

    Raises:
        ConfigError: If a key is neither robosuite's nor ours, or a value is wrong.
    """
    if not _is_robosuite(config):
        return None
    if robot is None:
        raise ConfigError(f"{source}: name the robot: parts depend on it.")
    dropped: list[str] = []
    if _is_part(config):
        ours = _of_one_part(config, robot, source, dropped, named("BASIC"))
    else:
        check_keys(config, KEYS, (), source, "")
        kind = config.get("type", "BASIC")
        specific = _table(config.get(SPECIFIC) or {}, source, SPECIFIC)
        if isinstance(kind, str) and kind.upper().startswith("WHOLE_BODY"):
            if config.get("body_parts"):
                dropped.append("body_parts (gains are those of joint_law)")
            ours = whole_body_config(specific, robot, source, dropped, named(kind))
        else:
            dropped.extend(f"{SPECIFIC}.{key}" for key in specific)
            ours = _of_parts(config, robot, source, dropped) | {"type": kind}
    if dropped:
        log.warning("%s: without effect here, ignored: %s.", source, ", ".join(dropped))
    return ours


def _of_one_part(
    config: Mapping[str, Any],
    robot: RobotDescription,
    source: str,
    dropped: list[str],
    default: dict[str, Any],
) -> dict[str, Any]:
    """Return BASIC with this controller in every arm, and defaults elsewhere."""
    parts = dict(default["body_parts"])
    for arm in hands_of(robot):
        parts[arm] = _part(arm, config, source, dropped, "")
    dropped[:] = dict.fromkeys(dropped)
    return default | {"body_parts": parts}


def _of_parts(
    config: Mapping[str, Any],
    robot: RobotDescription,
    source: str,
    dropped: list[str],
) -> dict[str, Any]:
    """Return BASIC with the parts that the robot has."""
    known, parts = parts_of(robot), {}
    for key, name, given in _listed(config, source):
        if name not in known and name not in PARTS:
            unknown = UnknownNameError("part", name, known)
            raise ConfigError(f"{source}: key 'body_parts.{key}': {unknown}")
        if name not in known:
            dropped.append(f"body_parts.{key} ({robot.name} has none)")
            continue
        parts[name] = _part(name, given, source, dropped, f"body_parts.{key}.")
    ours: dict[str, Any] = {"format": 1, "body_parts": parts}
    stands = any(part["type"] == "STANCE" for part in parts.values())
    if robot.root.kind == "free" and not stands:
        ours["may_fall"] = True
        log.warning(
            "%s: %s can fall, since no part in this config holds its root. "
            "{'type': 'STANCE'} for its legs does.",
            source,
            robot.name,
        )
    return ours


def _listed(
    config: Mapping[str, Any], source: str
) -> Iterator[tuple[str, str, Mapping[str, Any]]]:
    """Yield key, name and config of each part, arms as they are listed."""
    parts = dict(_table(config.get("body_parts") or {}, source, "body_parts"))
    arms = _table(parts.pop("arms", None) or {}, source, "body_parts.arms")
    found = {name: (f"arms.{name}", given) for name, given in arms.items()}
    found |= {name: (name, given) for name, given in parts.items()}
    order = config.get("body_part_ordering") or ()
    if not isinstance(order, list | tuple) or not set(order) <= {*found}:
        raise ConfigError(
            f"{source}: key 'body_part_ordering' = {order!r:.80}: a list of some of "
            f"{', '.join(found)}."
        )
    for name in dict.fromkeys((*order, *found)):
        key, given = found[name]
        yield key, name, _table(given, source, f"body_parts.{key}")


def _part(
    name: str,
    given: Mapping[str, Any],
    source: str,
    dropped: list[str],
    where: str,
) -> dict[str, Any]:
    """Return the config of one part."""
    models = part_models()
    kind = given.get("type")
    if name == "base" and kind in ("JOINT_VELOCITY", "JOINT_POSITION"):
        kind = "BASE_VELOCITY"
    if kind == "OSC_POSE" and given.get("control_ori") is False:
        kind = "OSC_POSITION"
    kind = check_name("part controller", kind, models, f"{source}: key '{where}type'")
    fields = set(models[kind].model_fields) - OTHER_UNITS.get(kind, set())
    check_keys(given, fields | {"type"}, IGNORED, source, where)
    ours: dict[str, Any] = {"type": kind}
    for key, value in given.items():
        if key == "gripper":
            ours["gripper"] = _gripper(value, source, where, dropped)
        elif key == "control_delta":
            ours["input_type"] = "delta" if value else "absolute"
        elif key in fields and key != "type":
            ours[key] = None if value == "null" else value
        elif key not in ("type", "control_ori") and value is not None:
            dropped.append(where + key)
    return _without_nulls(ours)


def _gripper(
    given: object, source: str, where: str, dropped: list[str]
) -> dict[str, Any] | None:
    """Return the config of a gripper; ours moves synergies instead of joints."""
    if given is None:
        return None
    table = _table(given, source, f"{where}gripper")
    kind, where = table.get("type", "GRIP"), f"{where}gripper."
    known = ("GRIP", "JOINT_POSITION")
    check_name("gripper controller", kind, known, f"{source}: key '{where}type'")
    dropped.extend(where + key for key in table if key != "type")
    return {"type": "GRIP"}


def _without_nulls(part: dict[str, Any]) -> dict[str, Any]:
    """Drop nulls, which are defaults in robosuite; `gripper: null` is no gripper."""
    return {k: v for k, v in part.items() if v is not None or k == "gripper"}


def _is_robosuite(config: Mapping[str, Any]) -> bool:
    """Whether a config has robosuite's layout; ours has `format`, or frames."""
    if "format" in config or "frame" in config:
        return False
    return SPECIFIC in config or "body_parts" in config or _is_part(config)


def _is_part(config: Mapping[str, Any]) -> bool:
    return "body_parts" not in config and is_part_controller(config.get("type"))


def _table(value: object, source: str, key: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise ConfigError(
            f"{source}: key '{key}' = {value!r:.80}: not a table {{...}}."
        )
    return value
