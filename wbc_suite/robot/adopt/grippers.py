"""Infer how grippers of an imported robot open and close, and where they grasp."""

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.robot.adopt.posed_robot import PosedRobot
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Frame, Link, Synergy, rigid_bodies
from wbc_suite.robot.poses import pose_fields
from wbc_suite.robot.shape_geometry import bounds_of
from wbc_suite.typing import Matrix

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
    posed = PosedRobot(robot)

    def centres(values: dict[str, float]) -> Matrix:
        """Return the centres of the fingers' shapes in the world, shape (n, 3)."""
        posed.move(values)
        boxes = [bounds_of(link.collision or link.visual) for link in tips]
        middles = [(low + high) / 2.0 for low, high in boxes]
        pairs = zip(tips, middles, strict=True)
        return np.array([posed.pose(link.name).act(x) for link, x in pairs])

    def spread(values: dict[str, float]) -> float:
        """Return the mean distance of the fingers from their middle, twice, m."""
        places = centres(values)
        away = np.linalg.norm(places - places.mean(axis=0), axis=1)
        return 2.0 * float(away.mean())

    opened = {name: sum(limits) / 2.0 for name, limits in ranges.items()}
    closed = dict(opened)
    for name, limits in ranges.items():
        spreads = [spread(opened | {name: x}) for x in limits]
        wide, narrow = limits if spreads[0] > spreads[1] + APART else limits[::-1]
        opened[name], closed[name] = wide, narrow
    gaps = [1e3 * spread(values) for values in (opened, closed)]
    reason = (
        f"{len(tips)} fingers are {gaps[0]:.0f} mm apart when open, and "
        f"{gaps[1]:.0f} mm when closed"
    )
    synergy = Synergy(gripper=group, name="grasp", open=opened, closed=closed)
    side, name = group.removesuffix("gripper"), group.replace("gripper", "tcp")
    given = [frame.name for frame in robot.frames if frame.role == "tcp"]
    named = name in given or any(own.startswith(side) for own in given)
    first = next(x for x in robot.links if x.joint and x.joint.name in closed)
    palm = rigid_bodies(robot.links)[str(first.parent)]
    fingers = np.array([posed.pose(palm).actInv(x) for x in centres(closed)])
    return Gripper(synergy, None if named else _tcp(name, palm, fingers), reason)


def _tcp(name: str, palm: str, fingers: Matrix) -> Frame | None:
    """Return a frame between closed fingers at places in the palm's frame, m."""
    middle = fingers.mean(axis=0)
    z = middle / (np.linalg.norm(middle) or 1.0)
    y = fingers[1] - fingers[0]
    y -= (y @ z) * z
    if min(np.linalg.norm(middle), np.linalg.norm(y)) < APART:
        return None
    y /= np.linalg.norm(y)
    pose = pin.SE3(np.column_stack([np.cross(y, z), y, z]), middle)
    fields = {"name": name, "link": palm, "role": "tcp", **pose_fields(pose)}
    return Frame.model_validate(fields)


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
