"""The robot that inverse kinematics sees: grippers and locked groups are rigid."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from wbc_suite.control.state import RobotState
from wbc_suite.kinematics import Configuration
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.assembly_steps import locked
from wbc_suite.robot.wheel_drive import WHEELS
from wbc_suite.typing import Indices, Vector


def lock_groups(robot: RobotDescription, groups: Sequence[str]) -> RobotDescription:
    """Return the robot with some groups, grippers and wheels fixed at `ready`.

    Fewer joints make every solve cheaper, and the same description feeds both IK
    backends. UnknownNameError if the robot has no such group.
    """
    wheels = [WHEELS] if WHEELS in robot.groups else []
    fixed = tuple(dict.fromkeys((*groups, *gripper_groups(robot), *wheels)))
    given = {key: getattr(robot, key) for key in RobotDescription.model_fields}
    fields = locked(given, fixed) | {"connects": (), "sensors": (), "tendons": ()}
    return RobotDescription.model_validate(fields)


def gripper_groups(robot: RobotDescription) -> list[str]:
    """Return the names of the groups that grippers drive."""
    return [
        name
        for name in robot.groups
        if name in robot.synergies or name.endswith("gripper")
    ]


def moved_joints(robot: RobotDescription, state: RobotState) -> tuple[str, ...]:
    """Return the joints that the IK moves and a motor drives."""
    candidates = (*planar_joints(robot), *robot.joint_names)
    return tuple(name for name in candidates if name in state.actuators)


def planar_joints(robot: RobotDescription) -> tuple[str, ...]:
    """Return the joints of a planar root."""
    return robot.root_joint_names if robot.root.kind == "planar" else ()


def joint_indices(model: pin.Model, joints: tuple[str, ...]) -> tuple[Indices, Indices]:
    """Return the places of joints in q and in v."""
    found = [model.joints[model.getJointId(name)] for name in joints]
    q = np.array([joint.idx_q for joint in found], dtype=np.int64)
    v = np.array([joint.idx_v for joint in found], dtype=np.int64)
    return q, v


def keyframe_posture(
    robot: RobotDescription, configuration: Configuration, keyframe: str
) -> Vector:
    """Return a configuration at a keyframe, if there is one; the root stays."""
    model, q = configuration.model, configuration.q.copy()
    if keyframe in robot.keyframes:
        for joint, value in robot.keyframe(keyframe).items():
            q[model.joints[model.getJointId(joint)].idx_q] = value
    return q
