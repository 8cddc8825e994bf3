"""Parts of a robot: their names, joints and hands."""

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass

from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.elements import Joint
from wbc_suite.robot.wheel_drive import WHEELS

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
"""Places of groups in the action; `""` stands for any other."""


def motors(robot: RobotDescription) -> tuple[str, ...]:
    """Return the joints that a torque motor drives; those of a planar root first."""
    given = {actuator.joint: actuator.kind for actuator in robot.actuators}
    drives = robot.root.kind == "planar" and robot.root.actuated
    driven = [
        joint.name
        for joint in robot.joints
        if given.get(joint.name) == "motor"
        or (joint.name not in given and _has_motor(joint))
    ]
    return (*(robot.root_joint_names if drives else ()), *driven)


def parts_of(robot: RobotDescription) -> dict[str, tuple[str, ...]]:
    """Return the parts that a robot has, with their driven joints.

    An arm is called by its side (`right_arm` is `right`), the joints of a planar root
    or the wheels of a free one are `base`, and any other group keeps its name. Arms
    come first, then torso, head, base, legs and all others. Grippers with synergies are
    no parts: they belong to their arms.
    """
    driven = set(motors(robot))
    groups = {k: v for k, v in robot.groups.items() if k not in robot.synergies}
    if robot.root.kind == "planar":
        groups = {"base": robot.root_joint_names} | groups
    wheels = groups.pop(WHEELS, ())
    if robot.root.kind == "free" and wheels:
        driven |= {*wheels}
        groups = {"base": wheels} | groups
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


@dataclass(frozen=True, kw_only=True, slots=True)
class RobotPart:
    """A part of a robot that one controller drives; its slice has the same name.

    Joints are the driven ones, from the root on; the hand is the frame of the hand at
    the part's end, None without one.
    """

    name: str
    joints: tuple[str, ...]
    hand: str | None = None


def robot_part(robot: RobotDescription, name: str) -> RobotPart:
    """Return a part of a robot by name; ConfigError if there is none."""
    known = parts_of(robot)
    if name not in known:
        raise ConfigError(str(UnknownNameError("part", name, known)))
    return RobotPart(name=name, joints=known[name], hand=hands_of(robot).get(name))


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
