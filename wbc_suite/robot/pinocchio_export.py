"""Build the Pinocchio model of a robot from its description."""

from typing import Any

import numpy as np
import pinocchio as pin

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Joint
from wbc_suite.robot.inertia import inertia_of
from wbc_suite.robot.poses import se3_of
from wbc_suite.typing import Vector

GRAVITY = np.array([0.0, 0.0, -9.81])  # m/s^2; the default of MuJoCo


def build_pinocchio(robot: RobotDescription) -> Any:
    """Build `pinocchio.Model`; see `RobotDescription.to_pinocchio`.

    Links are BODY frames, described frames OP_FRAMEs, keyframes reference
    configurations.
    """
    model = pin.Model()
    model.name = robot.name
    model.gravity.linear = GRAVITY
    joint_of: dict[str, int] = {}
    pose_in_joint: dict[str, Any] = {}
    for link in robot.links:
        if link.parent is None:
            joint, pose = _add_root(model, robot)
        else:
            joint = joint_of[link.parent]
            pose = pose_in_joint[link.parent] * se3_of(link)
        if link.joint is not None:
            joint = _add_joint(model, link.joint, joint, pose)
            pose = pin.SE3.Identity()
        joint_of[link.name], pose_in_joint[link.name] = joint, pose
        if link.mass > 0.0 or any(link.inertia):
            model.appendBodyToJoint(joint, inertia_of(link), pose)
        kind = pin.FrameType.JOINT
        parent = model.getFrameId(model.names[joint], kind) if joint else -1
        model.addBodyFrame(link.name, joint, pose, parent)
    for frame in robot.frames:
        pose = pose_in_joint[frame.link] * se3_of(frame)
        parent = model.getFrameId(frame.link, pin.FrameType.BODY)
        joint = joint_of[frame.link]
        model.addFrame(
            pin.Frame(frame.name, joint, parent, pose, pin.FrameType.OP_FRAME)
        )
    for name in robot.keyframes:
        model.referenceConfigurations[name] = _configuration(model, robot, name)
    return model


def _add_root(model: Any, robot: RobotDescription) -> tuple[int, Any]:
    """Add the root's joints; return the last one and the first link's pose in it."""
    joint, pose = 0, se3_of(robot.root)
    if robot.root.kind == "free":
        linear, angular = robot.root.velocity
        lower = np.array([-np.inf] * 3 + [-1.01] * 4)
        velocity = np.array([linear] * 3 + [angular] * 3)
        free = pin.JointModelFreeFlyer()
        effort = np.zeros(6)
        name = robot.root_joint_names[0]
        joint = model.addJoint(
            0, free, pin.SE3.Identity(), name, effort, velocity, lower, -lower
        )
        model.addJointFrame(joint)
        return joint, pin.SE3.Identity()
    for own in robot.root.joints:
        joint, pose = _add_joint(model, own, joint, pose), pin.SE3.Identity()
    return joint, pose


def _add_joint(model: Any, joint: Joint, parent: int, pose: Any) -> int:
    low, high = joint.range or (-np.inf, np.inf)
    index = model.addJoint(
        parent,
        _joint_model(joint),
        pose,
        joint.name,
        np.array([joint.effort or np.inf]),
        np.array([joint.velocity or np.inf]),
        np.array([low]),
        np.array([high]),
    )
    v = model.joints[index].idx_v
    model.armature[v] = joint.armature
    model.damping[v] = joint.damping
    model.friction[v] = joint.frictionloss
    model.addJointFrame(index)
    return index


def _joint_model(joint: Joint) -> Any:
    """Return the joint model; for an axis that is exactly x, y or z the faster one."""
    if joint.type == "hinge":
        aligned = (pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ)
        general = pin.JointModelRevoluteUnaligned
    else:
        aligned = (pin.JointModelPX, pin.JointModelPY, pin.JointModelPZ)
        general = pin.JointModelPrismaticUnaligned
    if sorted(joint.axis) == [0.0, 0.0, 1.0]:
        return aligned[joint.axis.index(1.0)]()
    return general(np.asarray(joint.axis))


def _configuration(model: Any, robot: RobotDescription, name: str) -> Vector:
    q = pin.neutral(model)
    if robot.root.kind == "free":
        w, x, y, z = robot.root.quat
        q[:7] = (*robot.root.pos, x, y, z, w)
    for joint, value in robot.keyframe(name).items():
        q[model.joints[model.getJointId(joint)].idx_q] = value
    return q
