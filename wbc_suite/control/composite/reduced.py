"""The robot that inverse kinematics sees: grippers and locked groups are rigid."""

from collections.abc import Sequence
from typing import Any

from wbc_suite.robot import RobotDescription
from wbc_suite.robot.placing import locked

__all__ = ["gripper_groups", "lock_groups"]


def lock_groups(robot: RobotDescription, groups: Sequence[str]) -> RobotDescription:
    """Return the robot with some groups, and all its grippers, fixed at `ready`.

    Fewer joints make every solve cheaper, and the same description feeds both IK
    backends.

    Raises:
        UnknownNameError: If the robot has no such group.
    """
    fixed = tuple(dict.fromkeys((*groups, *gripper_groups(robot))))
    fields: dict[str, Any] = {
        key: getattr(robot, key) for key in type(robot).model_fields
    }
    fields = locked(fields, fixed) | {"connects": (), "sensors": ()}
    return RobotDescription.model_validate(fields)


def gripper_groups(robot: RobotDescription) -> list[str]:
    """Return the names of the groups that grippers drive."""
    return [
        name
        for name in robot.groups
        if name in robot.synergies or name.endswith("gripper")
    ]
