"""Parts of a robot: their names, joints and hands, and who controls them."""

from collections import Counter
from collections.abc import Collection
from typing import Annotated, TypeAlias, get_args

from pydantic import Field

from wbc_suite.control.composite.standing import (
    StanceConfig,
    StanceController,
    held_frames,
)
from wbc_suite.control.part.base import BaseVelocityConfig, BaseVelocityController
from wbc_suite.control.part.controller import PartController
from wbc_suite.control.part.ik_pose import IkPoseConfig, IkPoseController
from wbc_suite.control.part.joint_controller import (
    JointPositionConfig,
    JointPositionController,
)
from wbc_suite.control.part.joint_torque import (
    JointTorqueConfig,
    JointTorqueController,
)
from wbc_suite.control.part.joint_velocity import (
    JointVelocityConfig,
    JointVelocityController,
)
from wbc_suite.control.part.osc_controller import OscConfig, OscController
from wbc_suite.control.state import RobotState
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.parts import Joint
from wbc_suite.tomlfile import FrozenModel

__all__ = [
    "PartConfig",
    "check_part",
    "hands_of",
    "make_part",
    "motors",
    "part_models",
    "parts_of",
]

PartConfig: TypeAlias = Annotated[
    OscConfig
    | IkPoseConfig
    | JointPositionConfig
    | JointVelocityConfig
    | JointTorqueConfig
    | BaseVelocityConfig
    | StanceConfig,
    Field(discriminator="type"),
]
"""Config of the controller of one part."""


def part_models() -> dict[str, type[FrozenModel]]:
    """Return the config model of each type of part controller."""
    models = get_args(get_args(PartConfig)[0])
    return {
        name: model
        for model in models
        for name in get_args(model.model_fields["type"].annotation)
    }


_ORDER = (
    "right_arm",
    "left_arm",
    "arm",
    "torso",
    "head",
    "base",
    "legs",
    "",
    "gripper",
)


def motors(robot: RobotDescription) -> tuple[str, ...]:
    """Return the joints that a torque motor drives; those of a planar root first."""
    given = {actuator.joint: actuator.kind for actuator in robot.actuators}
    moving = robot.root_joint_names if robot.root.kind == "planar" else ()
    driven = [
        joint.name
        for joint in robot.joints
        if given.get(joint.name) == "motor"
        or (joint.name not in given and _has_motor(joint))
    ]
    return (*(moving if robot.root.actuated else ()), *driven)


def parts_of(robot: RobotDescription) -> dict[str, tuple[str, ...]]:
    """Return the parts that a robot has, with their driven joints.

    An arm is called by its side (`right_arm` is `right`), the joints of a planar root
    are `base`, and any other group keeps its name. Arms come first, then torso, head,
    base, legs and all others. Grippers with synergies are no parts: they belong to
    their arms.
    """
    driven = set(motors(robot))
    groups = {k: v for k, v in robot.groups.items() if k not in robot.synergies}
    if robot.root.kind == "planar":
        groups = {"base": robot.root_joint_names} | groups
    found: dict[str, tuple[str, ...]] = {}
    for group in sorted(groups, key=_rank):
        joints = tuple(joint for joint in groups[group] if joint in driven)
        name = group.removesuffix("_arm")
        if joints:
            found[group if name in groups else name] = joints
    return found


def hands_of(robot: RobotDescription) -> dict[str, str]:
    """Return the frame of the hand at the end of each part that ends in just one."""
    owners = {
        joint: part for part, joints in parts_of(robot).items() for joint in joints
    }
    ends = [
        (owners[joint], frame)
        for frame in robot.hands.values()
        if (joint := _last_joint(frame, owners, robot)) is not None
    ]
    count = Counter(part for part, _ in ends)
    return {part: frame for part, frame in ends if count[part] == 1}


def check_part(part: str, config: PartConfig, robot: RobotDescription) -> None:
    """Raise ConfigError if a robot has no such part, or not what it needs."""
    known = parts_of(robot)
    if part not in known:
        raise ConfigError(str(UnknownNameError("part", part, known)))
    hands = hands_of(robot)
    if isinstance(config, OscConfig | IkPoseConfig) and part not in hands:
        raise ConfigError(
            f"{config.type} needs a hand, and {robot.name}'s '{part}' does not end in "
            f"one. Parts that do: {', '.join(hands) or 'none'}."
        )
    if isinstance(config, BaseVelocityConfig) and part != "base":
        raise ConfigError(f"{config.type} drives the part 'base', not '{part}'.")
    if known[part] == robot.root_joint_names and config.type != "BASE_VELOCITY":
        raise ConfigError(f"a base is driven by BASE_VELOCITY, not by {config.type}.")
    if isinstance(config, StanceConfig):
        sites = {frame.name for frame in robot.frames}
        for held in held_frames(config, robot):
            if held.frame not in sites:
                raise ConfigError(str(UnknownNameError("frame", held.frame, sites)))


def make_part(part: str, config: PartConfig, state: RobotState) -> PartController:
    """Make the controller of a part that `check_part` has accepted."""
    robot = state.robot
    joints = parts_of(robot)[part]
    match config:
        case OscConfig():
            return OscController(part, config, state, joints, hands_of(robot)[part])
        case IkPoseConfig():
            return IkPoseController(part, config, state, joints, hands_of(robot)[part])
        case StanceConfig():
            return StanceController(config, state, joints, motors(robot))
        case JointPositionConfig():
            return JointPositionController(part, config, state, joints)
        case JointVelocityConfig():
            return JointVelocityController(part, config, state, joints)
        case JointTorqueConfig():
            return JointTorqueController(part, config, state, joints)
        case BaseVelocityConfig():
            return BaseVelocityController(part, config, state)


def _has_motor(joint: Joint) -> bool:
    return bool(joint.effort) and not joint.passive and joint.mimic is None


def _rank(group: str) -> int:
    """Return the place of a group in the action."""
    if group in _ORDER:
        return _ORDER.index(group)
    ending = group.rpartition("_")[2]
    return _ORDER.index(ending if ending in ("arm", "gripper") else "")


def _last_joint(
    frame: str, joints: Collection[str], robot: RobotDescription
) -> str | None:
    """Return the last of some joints between the root and a frame."""
    link = robot.link(robot.frame(frame).link)
    while link.joint is None or link.joint.name not in joints:
        if link.parent is None:
            return None
        link = robot.link(link.parent)
    return link.joint.name
