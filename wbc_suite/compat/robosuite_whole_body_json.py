"""Convert the settings of WHOLE_BODY_IK in robosuite's JSON files into ours."""

from collections.abc import Collection, Mapping
from typing import Any

from wbc_suite.control.robot_parts import parts_of
from wbc_suite.errors import ConfigError, UnknownNameError, did_you_mean
from wbc_suite.robot import RobotDescription

INPUTS = {"absolute": "absolute"} | dict.fromkeys(
    ("delta", "relative", "delta_pose"), "delta"
)
FRAMES = {"world": "world", "base": "base", "mobilebase0_base": "base"}

IGNORED = {
    *("nullspace_joint_weights", "ik_pseudo_inverse_damping", "ik_integration_dt"),
    *("ik_max_dq", "ik_max_dq_torso", "max_dq", "ik_verbose", "verbose"),
    *("skip_wbc_action", "interpolation", "ramp_ratio", "input_min", "input_max"),
    *("output_min", "output_max", "ik_posture_weights", "external_part_names"),
    *("base_transform_joint", "use_joint_angle_action_input", "body_part_ordering"),
    *("robot_name", "individual_part_names", "kp", "kd", "input_type"),
}
CONVERTED = {
    *("ref_name", "actuation_part_names", "ik_input_type", "ik_input_ref_frame"),
    *("ik_input_rotation_repr", "ik_solve_freq", "ik_hand_pos_cost"),
    "ik_hand_ori_cost",
}


def whole_body_config(
    given: Mapping[str, Any],
    robot: RobotDescription,
    source: str,
    dropped: list[str],
    default: dict[str, Any],
) -> dict[str, Any]:
    """Return our config of the robot with the settings of a file.

    Args:
        given: The table `composite_controller_specific_configs`.
        robot: The robot.
        source: Name of the file in messages.
        dropped: Receives the names of ignored keys.
        default: Our config of the robot.

    Raises:
        ConfigError: If a key or a value is unknown to robosuite and to us.
    """
    check_keys(given, CONVERTED, IGNORED, source, "")
    dropped.extend(key for key in given if key in IGNORED)
    config = dict(default) | _input(given, source)
    if "ref_name" in given:
        config["frame"] = _frames(given["ref_name"], robot, source, default["frame"])
    costs = {
        ours: given[key]
        for key, ours in (
            ("ik_hand_pos_cost", "position_cost"),
            ("ik_hand_ori_cost", "orientation_cost"),
        )
        if key in given
    }
    config["frame"] = [
        frame | (costs if _side(frame, robot) else {}) for frame in config["frame"]
    ]
    if "actuation_part_names" in given:
        moved = _names(given["actuation_part_names"], f"{source}: actuation_part_names")
        config["locked"] = _locked(moved, robot, source)
    return config


def _input(given: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Return our settings of the input and of the rate of solving."""
    if given.get("ik_input_rotation_repr", "axis_angle") != "axis_angle":
        raise ConfigError(
            f"{source}: key 'ik_input_rotation_repr' = "
            f"{given['ik_input_rotation_repr']!r:.80}: rotations are rotation vectors "
            "here ('axis_angle')."
        )
    ours: dict[str, Any] = {}
    for key, own_key, meanings in (
        ("ik_input_type", "input_type", INPUTS),
        ("ik_input_ref_frame", "input_ref_frame", FRAMES),
    ):
        if key in given:
            where = f"{source}: key '{key}'"
            ours[own_key] = meanings[check_name("choice", given[key], meanings, where)]
    if "ik_solve_freq" in given:
        ours["solve_hz"] = given["ik_solve_freq"]
    return ours


def _frames(
    names: object,
    robot: RobotDescription,
    source: str,
    frames: list[dict[str, Any]],
) -> list[dict[str, Any]]:
    """Return the frames of the named hands, and those of the robot's root."""
    asked: list[str] = []
    for name in _names(names, f"{source}: ref_name"):
        sides = [side for side in robot.hands if side in name]
        if not sides:
            unknown = UnknownNameError("hand", name, robot.hands)
            raise ConfigError(f"{source}: key 'ref_name': {unknown}")
        asked.append(sides[0])
    hands = {_side(frame, robot): frame for frame in frames if _side(frame, robot)}
    others = [
        frame
        for frame in frames
        if not _side(frame, robot)
        and (robot.root.kind == "free" or frame.get("kind") == "base")
    ]
    new = {side: {"name": side, "frame": robot.hands[side]} for side in asked}
    return [hands.get(side, new[side]) for side in asked] + others


def _side(frame: Mapping[str, Any], robot: RobotDescription) -> str:
    """Return the side of the hand that a controlled frame moves, or nothing."""
    for side, hand in robot.hands.items():
        if frame.get("frame") == hand or frame["name"] == f"{side}_hand":
            return side
    return ""


def _locked(moved: list[str], robot: RobotDescription, source: str) -> list[str]:
    """Return the groups that stay locked."""
    parts = parts_of(robot)
    known = {*parts, "right", "left", "torso", "head", "base", "legs"}
    for name in moved:
        check_name("part", name, known, f"{source}: key 'actuation_part_names'")
    groups = {
        f"{part}_arm" if f"{part}_arm" in robot.groups else part for part in moved
    }
    return [
        group
        for group in robot.groups
        if group not in groups and group not in robot.synergies
    ]


def check_keys(
    given: Mapping[str, Any],
    converted: Collection[str],
    ignored: Collection[str],
    source: str,
    where: str,
) -> None:
    """Raise ConfigError for an unknown key."""
    for key in given:
        if key not in converted and key not in ignored:
            hint = did_you_mean(key, {*converted, *ignored})
            known = ", ".join(sorted(converted))
            raise ConfigError(
                f"{source}: unknown key '{where}{key}'.{hint} Known: {known}."
            )


def _names(value: object, where: str) -> list[str]:
    found = [value] if isinstance(value, str) else value
    if not isinstance(found, list | tuple) or not all(
        isinstance(name, str) for name in found
    ):
        raise ConfigError(f"{where} = {value!r:.80}: not a list of names.")
    return list(found)


def check_name(kind: str, name: object, known: Collection[str], where: str) -> str:
    """Return a name, or raise ConfigError for an unknown one."""
    if not isinstance(name, str) or name not in known:
        raise ConfigError(f"{where}: {UnknownNameError(kind, name, known)}")
    return name
