"""Convert configs in the layout of robosuite 1.5's JSON files into ours.

    {"type": "BASIC",
     "composite_controller_specific_configs": {...},
     "body_parts": {"arms": {"right": {"type": "OSC_POSE", ..., "gripper": {...}}},
                    "torso": {...}, "head": {...}, "base": {...}, "legs": {...}}}

The config of one part alone, `{"type": "OSC_POSE", ...}`, applies to all arms.
Source of the keys: robosuite's documentation and its public default files.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from wbc_suite import logs
from wbc_suite.compat.robosuite.controllers.uncoupled_osc import UNCOUPLED
from wbc_suite.compat.robosuite.controllers.variable_impedance import VARIABLE_JOINTS
from wbc_suite.control.part.registry import PART_CONTROLLERS
from wbc_suite.control.robot_parts import hands_of, parts_of
from wbc_suite.errors import ConfigError, UnknownNameError, did_you_mean
from wbc_suite.robot import RobotDescription

log = logs.logger(__name__)

SPECIFIC = "composite_controller_specific_configs"
PARTS = ("right", "left", "torso", "head", "base", "legs")
KEYS = ("type", SPECIFIC, "body_parts", "body_part_ordering")

IGNORED_OF_PARTS = {
    *("lite_physics", "policy_freq", "damping_ratio_limits", "damping_limits"),
    "uncouple_pos_ori",
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

JOINTS = "JOINT_POSITION"
"""Its goals are not interpolated: our references move with a velocity, robosuite's
do not, so that steps from where the joints are would be twice as long."""

OTHER_UNITS = {"JOINT_VELOCITY": {"kp", "ki", "kd"}, "BASE_VELOCITY": {"kp", "kd"}}
"""Gains with other units in robosuite, or without effect there."""

DELTA = dict.fromkeys(("delta", "relative", "delta_pose"), "delta")
INPUTS = {
    "input_type": {"absolute": "absolute"} | DELTA,
    "input_ref_frame": {"world": "world", "base": "base", "mobilebase0_base": "base"},
}
"""Our values of the keys `ik_input_type` and `ik_input_ref_frame`."""
COSTS = {"ik_hand_pos_cost": "position_cost", "ik_hand_ori_cost": "orientation_cost"}

CONVERTED_OF_WHOLE_BODY = {
    *("ref_name", "actuation_part_names", "ik_input_type", "ik_input_ref_frame"),
    *("ik_input_rotation_repr", "ik_solve_freq", *COSTS),
}
IGNORED_OF_WHOLE_BODY = {
    *("nullspace_joint_weights", "ik_pseudo_inverse_damping", "ik_integration_dt"),
    *("ik_max_dq", "ik_max_dq_torso", "max_dq", "ik_verbose", "verbose"),
    *("skip_wbc_action", "interpolation", "ramp_ratio", "input_min", "input_max"),
    *("output_min", "output_max", "ik_posture_weights", "external_part_names"),
    *("base_transform_joint", "use_joint_angle_action_input", "body_part_ordering"),
    *("robot_name", "individual_part_names", "kp", "kd", "input_type"),
}

Config = Mapping[str, Any]
Named = Callable[[str], dict[str, Any]]


def convert(
    config: Config, robot: RobotDescription | None, source: str, named: Named
) -> dict[str, Any] | None:
    """Return the equivalent config in our layout, or None for one in our layout.

    One warning lists the ignored keys. `source` is the config's name in messages;
    `named` returns our own config of a composite of that name for the robot.

    Raises:
        ConfigError: If a key is neither robosuite's nor ours, or a value is wrong.
    """
    one_part = "body_parts" not in config and config.get("type") in PART_CONTROLLERS
    theirs = SPECIFIC in config or "body_parts" in config or one_part
    if "format" in config or "frame" in config or not theirs:
        return None
    if robot is None:
        raise ConfigError(f"{source}: name the robot: parts depend on it.")
    conversion = _Conversion(robot=robot, source=source)
    if one_part:
        ours = named("BASIC")
        arms = {arm: conversion.part(arm, config, "") for arm in hands_of(robot)}
        ours = ours | {"body_parts": ours["body_parts"] | arms}
    else:
        ours = conversion.composite(config, named)
    if conversion.ignored:
        ignored = ", ".join(dict.fromkeys(conversion.ignored))
        log.warning("%s: without effect here, ignored: %s.", source, ignored)
    return ours


@dataclass(frozen=True, kw_only=True, slots=True)
class _Conversion:
    """The conversion of one config, which collects the keys without effect."""

    robot: RobotDescription
    source: str
    ignored: list[str] = field(default_factory=list)

    def composite(self, config: Config, named: Named) -> dict[str, Any]:
        self._check_keys(config, KEYS, ())
        kind = config.get("type", "BASIC")
        specific = self._table(config.get(SPECIFIC) or {}, SPECIFIC)
        if isinstance(kind, str) and kind.upper().startswith("WHOLE_BODY"):
            if config.get("body_parts"):
                self.ignored.append("body_parts (gains are those of joint_law)")
            return self._whole_body(specific, named(kind))
        self.ignored.extend(f"{SPECIFIC}.{key}" for key in specific)
        return self._parts(config) | {"type": kind}

    def _parts(self, config: Config) -> dict[str, Any]:
        known, parts = parts_of(self.robot), {}
        for key, name, given in self._listed(config):
            if name not in known and name not in PARTS:
                unknown = UnknownNameError("part", name, known)
                raise self._error(f"key 'body_parts.{key}': {unknown}")
            if name not in known:
                self.ignored.append(f"body_parts.{key} ({self.robot.name} has none)")
                continue
            parts[name] = self.part(name, given, f"body_parts.{key}.")
        ours: dict[str, Any] = {"format": 1, "body_parts": parts}
        stands = any(part["type"] == "STANCE" for part in parts.values())
        if self.robot.root.kind == "free" and not stands:
            ours["may_fall"] = True
            log.warning(
                "%s: %s can fall, since no part in this config holds its root. "
                "{'type': 'STANCE'} for its legs does.",
                self.source,
                self.robot.name,
            )
        return ours

    def _listed(self, config: Config) -> Iterator[tuple[str, str, Config]]:
        """Yield key, name and config of each part, arms as they are listed."""
        parts = dict(self._table(config.get("body_parts") or {}, "body_parts"))
        arms = self._table(parts.pop("arms", None) or {}, "body_parts.arms")
        found = {name: (f"arms.{name}", given) for name, given in arms.items()}
        found |= {name: (name, given) for name, given in parts.items()}
        order = config.get("body_part_ordering") or ()
        if not isinstance(order, list | tuple) or not set(order) <= {*found}:
            raise self._error(
                f"key 'body_part_ordering' = {order!r:.80}: a list of some of "
                f"{', '.join(found)}."
            )
        for name in dict.fromkeys((*order, *found)):
            key, given = found[name]
            yield key, name, self._table(given, f"body_parts.{key}")

    def part(self, name: str, given: Config, where: str) -> dict[str, Any]:
        """Return the config of one part; nulls are defaults in robosuite."""
        kind = given.get("type")
        kind = PART_CONTROLLERS.spelled(kind) if kind in PART_CONTROLLERS else kind
        if name == "base" and kind in ("JOINT_VELOCITY", "JOINT_POSITION"):
            kind = "BASE_VELOCITY"
        if kind == "OSC_POSE" and given.get("control_ori") is False:
            kind = "OSC_POSITION"
        kind = self._check_name(
            "part controller", kind, PART_CONTROLLERS, f"{where}type"
        )
        kind, asked = UNCOUPLED.get(kind, kind), kind
        if kind == JOINTS and given.get("impedance_mode", "fixed") != "fixed":
            kind = VARIABLE_JOINTS
        fields = set(PART_CONTROLLERS[kind].config.model_fields)
        fields -= OTHER_UNITS.get(kind, set())
        own = fields | {"type"}
        self._check_keys(given, own, IGNORED_OF_PARTS, where)
        ours: dict[str, Any] = {"type": kind}
        for key, value in given.items():
            if key == "gripper":
                ours["gripper"] = self._gripper(value, where)
            elif key == "control_delta":
                ours["input_type"] = "delta" if value else "absolute"
            elif value is None or key in ("type", "control_ori"):
                continue
            elif key not in fields or (key, asked) == ("interpolation", JOINTS):
                self.ignored.append(where + key)
            elif value != "null":
                ours[key] = value
        return ours

    def _gripper(self, given: object, where: str) -> dict[str, Any] | None:
        """Return the config of a gripper; ours moves synergies instead of joints."""
        if given is None:
            return None
        table, where = self._table(given, f"{where}gripper"), f"{where}gripper."
        known = ("GRIP", "JOINT_POSITION")
        kind = table.get("type", "GRIP")
        self._check_name("gripper controller", kind, known, f"{where}type")
        self.ignored.extend(where + key for key in table if key != "type")
        return {"type": "GRIP"}

    def _whole_body(self, given: Config, default: dict[str, Any]) -> dict[str, Any]:
        """Return our config of the robot with a file's settings of WHOLE_BODY_IK."""
        self._check_keys(given, CONVERTED_OF_WHOLE_BODY, IGNORED_OF_WHOLE_BODY)
        self.ignored.extend(key for key in given if key in IGNORED_OF_WHOLE_BODY)
        config = default | self._input(given)
        frames = default["frame"]
        if "ref_name" in given:
            frames = self._frames(given["ref_name"], frames)
        costs = {ours: given[key] for key, ours in COSTS.items() if key in given}
        config["frame"] = [f | costs if self._side(f) else f for f in frames]
        if "actuation_part_names" in given:
            config["locked"] = self._locked(given["actuation_part_names"])
        return config

    def _input(self, given: Config) -> dict[str, Any]:
        """Return our settings of the input and of the rate of solving."""
        rotation = given.get("ik_input_rotation_repr", "axis_angle")
        if rotation != "axis_angle":
            raise self._error(
                f"key 'ik_input_rotation_repr' = {rotation!r:.80}: rotations are "
                "rotation vectors here ('axis_angle')."
            )
        ours: dict[str, Any] = {}
        for key, meanings in INPUTS.items():
            if (name := f"ik_{key}") in given:
                choice = self._check_name("choice", given[name], meanings, name)
                ours[key] = meanings[choice]
        if "ik_solve_freq" in given:
            ours["solve_hz"] = given["ik_solve_freq"]
        return ours

    def _frames(
        self, names: object, frames: list[dict[str, Any]]
    ) -> list[dict[str, Any]]:
        """Return the frames of the named hands, and those of the robot's root."""
        robot = self.robot
        asked: list[str] = []
        for name in self._names(names, "ref_name"):
            side = next((side for side in robot.hands if side in name), None)
            if side is None:
                unknown = UnknownNameError("hand", name, robot.hands)
                raise self._error(f"key 'ref_name': {unknown}")
            asked.append(side)
        hands = {self._side(frame): frame for frame in frames}
        others = [
            frame
            for frame in frames
            if not self._side(frame)
            and (robot.root.kind == "free" or frame.get("kind") == "base")
        ]
        new = {side: {"name": side, "frame": robot.hands[side]} for side in asked}
        return [hands.get(side, new[side]) for side in asked] + others

    def _side(self, frame: Config) -> str:
        """Return the side of the hand that a controlled frame moves, or nothing."""
        for side, hand in self.robot.hands.items():
            if frame.get("frame") == hand or frame["name"] == f"{side}_hand":
                return side
        return ""

    def _locked(self, given: object) -> list[str]:
        """Return the groups that stay locked when the given parts move."""
        groups, known = self.robot.groups, {*parts_of(self.robot), *PARTS}
        moved: set[str] = set()
        for name in self._names(given, "actuation_part_names"):
            self._check_name("part", name, known, "actuation_part_names")
            moved.add(f"{name}_arm" if f"{name}_arm" in groups else name)
        return [g for g in groups if g not in moved and g not in self.robot.synergies]

    def _check_keys(
        self,
        given: Config,
        converted: Collection[str],
        ignored: Collection[str],
        where: str = "",
    ) -> None:
        for key in given:
            if key not in converted and key not in ignored:
                hint = did_you_mean(key, {*converted, *ignored})
                known = ", ".join(sorted(converted))
                raise self._error(f"unknown key '{where}{key}'.{hint} Known: {known}.")

    def _check_name(
        self, kind: str, name: object, known: Collection[str], key: str
    ) -> str:
        if not isinstance(name, str) or name not in known:
            raise self._error(f"key '{key}': {UnknownNameError(kind, name, known)}")
        return name

    def _names(self, value: object, key: str) -> list[str]:
        found = [value] if isinstance(value, str) else value
        if isinstance(found, list | tuple):
            names = [name for name in found if isinstance(name, str)]
            if len(names) == len(found):
                return names
        raise self._error(f"{key} = {value!r:.80}: not a list of names.")

    def _table(self, value: object, key: str) -> Config:
        if not isinstance(value, Mapping):
            raise self._error(f"key '{key}' = {value!r:.80}: not a table {{...}}.")
        return value

    def _error(self, text: str) -> ConfigError:
        return ConfigError(f"{self.source}: {text}")
