"""Robots composed of an arm, a base and grippers, under a name of their own."""

from collections.abc import Sequence

from wbc_suite.compat.robosuite.models.robots import (
    REGISTERED_ROBOTS,
    ManipulatorModel,
)
from wbc_suite.compat.robosuite.robots import ROBOT_CLASS_MAPPING, target_type_mapping
from wbc_suite.errors import UnknownNameError
from wbc_suite.robot import load_robot

BASE_TARGET_MAPPING = {
    "RethinkMount": "FixedBaseRobot",
    "RethinkMinimalMount": "FixedBaseRobot",
    "NullMount": "FixedBaseRobot",
    "OmronMobileBase": "WheeledRobot",
    "NullMobileBase": "WheeledRobot",
    "NoActuationBase": "LeggedRobot",
    "FloatingLeggedBase": "LeggedRobot",
}


def get_target_type(base: str) -> type:
    """Return the class of robots on a base."""
    return target_type_mapping[BASE_TARGET_MAPPING.get(base, "FixedBaseRobot")]


def check_bimanual(robot_name: str) -> bool:
    """Whether a robot has two arms."""
    return REGISTERED_ROBOTS[robot_name]().arm_type == "bimanual"


def create_composite_robot(
    name: str,
    robot: str,
    base: str | None = None,
    grippers: str | Sequence[str] | None = None,
) -> type[ManipulatorModel]:
    """Make a robot of an arm, a base and grippers known by a name.

    Raises:
        UnknownNameError: If there is no such robot, base or gripper.
    """
    if robot not in REGISTERED_ROBOTS:
        raise UnknownNameError("robot", robot, REGISTERED_ROBOTS)
    chosen = REGISTERED_ROBOTS[robot]()
    names = [grippers] if isinstance(grippers, str) else list(grippers or ())
    gripper = None
    if names:
        sides = list(chosen.description.hands)
        given = names * len(sides) if len(names) == 1 else names
        gripper = chosen._choice(dict(zip(sides, given, strict=False)))
    description = load_robot(robot, gripper=gripper, base=base)

    def __init__(self: ManipulatorModel, idn: int = 0) -> None:
        ManipulatorModel.__init__(self, robot, idn=idn)
        self.description = description

    body = {"robot": "", "__init__": __init__, "__module__": __name__}
    made = type(name, (ManipulatorModel,), body)
    kind = ROBOT_CLASS_MAPPING[robot] if base is None else get_target_type(base)
    ROBOT_CLASS_MAPPING[name] = kind
    return made
