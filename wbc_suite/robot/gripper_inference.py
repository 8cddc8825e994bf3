"""Infer how grippers of an imported robot open and close, and where they grasp."""

from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Frame, Link, Synergy, rigid_bodies
from wbc_suite.robot.poses import pose_fields
from wbc_suite.robot.shape_geometry import shape_bounds
from wbc_suite.typing import Matrix, Vector

APART = 1e-3  # m; a motion that changes the distance of fingers less neither closes


class Gripper(NamedTuple):
    """What is inferred about one gripper.

    Attributes:
        synergy: Joint values open and closed.
        tcp: A frame between the fingers, if the robot has none; z points from the palm
            to the fingers, y from one finger to the next.
        reason: Why, as a sentence.
    """

    synergy: Synergy
    tcp: Frame | None
    reason: str


def infer_grippers(robot: RobotDescription) -> dict[str, Gripper]:
    """Return what is found about groups whose name has the word `gripper`, by group.

    Each joint is open at the end of its range at which the fingers are farther apart.
    """
    found: dict[str, Gripper] = {}
    for group, joints in robot.groups.items():
        ranges = {name: robot.joint(name).range for name in joints}
        limited = {name: limits for name, limits in ranges.items() if limits}
        tips = _tips(robot, group)
        if "gripper" in group and limited and len(tips) > 1:
            found[group] = _infer(robot, group, limited, tips)
    return found


def _infer(
    robot: RobotDescription,
    group: str,
    ranges: dict[str, tuple[float, float]],
    tips: list[Link],
) -> Gripper:
    model = robot.to_pinocchio()
    opened = {name: sum(limits) / 2.0 for name, limits in ranges.items()}
    closed = dict(opened)
    for name, limits in ranges.items():
        spreads = [_spread(robot, model, tips, opened | {name: x}) for x in limits]
        wide, narrow = limits if spreads[0] > spreads[1] + APART else limits[::-1]
        opened[name], closed[name] = wide, narrow
    gaps = [_spread(robot, model, tips, values) for values in (opened, closed)]
    reason = (
        f"{len(tips)} fingers are {1e3 * gaps[0]:.0f} mm apart when open, and "
        f"{1e3 * gaps[1]:.0f} mm when closed"
    )
    synergy = Synergy(gripper=group, name="grasp", open=opened, closed=closed)
    side, name = group.removesuffix("gripper"), group.replace("gripper", "tcp")
    given = [frame.name for frame in robot.frames if frame.role == "tcp"]
    named = name in given or any(own.startswith(side) for own in given)
    tcp = None if named else _tcp(robot, model, group, tips, closed)
    return Gripper(synergy, tcp, reason)


def _tips(robot: RobotDescription, group: str) -> list[Link]:
    """Return the outermost moving links of a gripper that have shapes."""
    joints = {*robot.group(group)}
    followers = {j.name for j in robot.joints if j.mimic and j.mimic.joint in joints}
    rigid = rigid_bodies(robot.links)
    parents = {rigid[x.parent] for x in robot.links if x.joint and x.parent}
    return [
        link
        for link in robot.links
        if link.joint is not None
        and link.joint.name in joints | followers
        and link.name not in parents
        and (link.visual or link.collision)
    ]


def _poses(
    robot: RobotDescription, model: pin.Model, values: dict[str, float]
) -> tuple[pin.Data, dict[str, int]]:
    data, q = model.createData(), pin.neutral(model)
    for name, value in _followed(robot, values).items():
        q[model.joints[model.getJointId(name)].idx_q] = value
    pin.framesForwardKinematics(model, data, q)
    return data, {link.name: model.getFrameId(link.name) for link in robot.links}


def _followed(robot: RobotDescription, values: dict[str, float]) -> dict[str, float]:
    """Return a posture with followers at their places."""
    all_values = dict.fromkeys(robot.joint_names, 0.0) | values
    for joint in robot.joints:
        if joint.mimic is not None:
            leader = all_values[joint.mimic.joint]
            all_values[joint.name] = joint.mimic.ratio * leader + joint.mimic.offset
    return all_values


def _centres(
    robot: RobotDescription, model: pin.Model, tips: list[Link], values: dict[str, Any]
) -> Matrix:
    """Return the centres of the fingers' shapes in the world, shape (n, 3)."""
    data, ids = _poses(robot, model, values)
    places: list[Vector] = []
    for link in tips:
        bounds = np.array([shape_bounds(s) for s in link.collision or link.visual])
        middle = (bounds[:, 0].min(axis=0) + bounds[:, 1].max(axis=0)) / 2.0
        places.append(data.oMf[ids[link.name]].act(middle))
    return np.array(places)


def _spread(
    robot: RobotDescription, model: pin.Model, tips: list[Link], values: dict[str, Any]
) -> float:
    """Return the mean distance of the fingers from their middle, twice, m."""
    centres = _centres(robot, model, tips, values)
    away = np.linalg.norm(centres - centres.mean(axis=0), axis=1)
    return 2.0 * float(away.mean())


def _tcp(
    robot: RobotDescription,
    model: pin.Model,
    group: str,
    tips: list[Link],
    closed: dict[str, float],
) -> Frame | None:
    """Return a frame between the fingers on the link that carries them."""
    rigid = rigid_bodies(robot.links)
    first = next(x for x in robot.links if x.joint and x.joint.name in closed)
    palm = rigid[str(first.parent)]
    data, ids = _poses(robot, model, closed)
    T_palm = data.oMf[ids[palm]]
    centres = np.array([T_palm.actInv(c) for c in _centres(robot, model, tips, closed)])
    middle = centres.mean(axis=0)
    z = middle / (np.linalg.norm(middle) or 1.0)
    y = centres[1] - centres[0]
    y -= (y @ z) * z
    if min(np.linalg.norm(middle), np.linalg.norm(y)) < APART:
        return None
    y /= np.linalg.norm(y)
    pose = pin.SE3(np.column_stack([np.cross(y, z), y, z]), middle)
    name = group.replace("gripper", "tcp")
    return Frame.model_validate(
        {"name": name, "link": palm, "role": "tcp", **pose_fields(pose)}
    )
