"""What a robot feels of itself, under the keys that this field's datasets use."""

from wbc_suite.control import RobotState
from wbc_suite.sensing.hands import hands_of
from wbc_suite.sensing.reading import (
    Reading,
    body_position,
    body_quat,
    computed,
    joint_cosines,
    joint_positions,
    joint_sines,
    joint_velocities,
    site_position,
    site_quat,
)

__all__ = ["proprioception"]


def proprioception(state: RobotState) -> dict[str, Reading]:
    """Return the joint, base, hand and gripper readings of one robot.

    Keys begin with the robot's prefix. Joints are all but those of grippers, in the
    robot's order; with several hands their keys begin with `right_` and `left_`.
    Quaternions are x y z w, as in those datasets. Positions are in the world.

    Args:
        state: The robot in the simulation.
    """
    readings = _joints(state) | _base(state) | _hands(state) | _grippers(state)
    return {state.prefix + key: reading for key, reading in readings.items()}


def _joints(state: RobotState) -> dict[str, Reading]:
    fingers = {joint for joints in _gripper_groups(state).values() for joint in joints}
    q, v = state.joint_addresses(
        tuple(
            joint.name
            for joint in state.robot.joints
            if joint.name not in fingers and joint.mimic is None
        )
    )
    return {
        "joint_pos": joint_positions(q),
        "joint_pos_cos": joint_cosines(q),
        "joint_pos_sin": joint_sines(q),
        "joint_vel": joint_velocities(v),
    }


def _base(state: RobotState) -> dict[str, Reading]:
    kind = state.robot.root.kind
    if kind == "fixed":
        return {}
    size = 6 if kind == "free" else 3
    body = state.model.body(state.prefix + state.robot.links[0].name).id
    return {
        "base_pos": body_position(body),
        "base_quat": body_quat(body),
        "base_vel": computed(size, lambda: state.v[:size]),
    }


def _hands(state: RobotState) -> dict[str, Reading]:
    hands = hands_of(state)
    readings: dict[str, Reading] = {}
    for hand in hands:
        side = f"{hand.name}_" if len(hands) > 1 else ""
        readings[f"{side}eef_pos"] = site_position(hand.site)
        readings[f"{side}eef_quat"] = site_quat(hand.site)
    return readings


def _grippers(state: RobotState) -> dict[str, Reading]:
    grippers = _gripper_groups(state)
    readings: dict[str, Reading] = {}
    for name, joints in grippers.items():
        key = name if len(grippers) > 1 else "gripper"
        q, v = state.joint_addresses(joints)
        readings[f"{key}_qpos"] = joint_positions(q)
        readings[f"{key}_qvel"] = joint_velocities(v)
    return readings


def _gripper_groups(state: RobotState) -> dict[str, tuple[str, ...]]:
    return {
        name: tuple(joints)
        for name, joints in state.robot.groups.items()
        if name.endswith("gripper") and joints
    }
