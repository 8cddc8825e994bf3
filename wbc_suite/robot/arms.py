"""Arms: the joints that move one hand alone, and what they leave free."""

from collections.abc import Iterator

import numpy as np

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Link
from wbc_suite.robot.poses import poses_in_rigid_bodies, se3_of

POSE_JOINTS = 6
"""Joints that every pose takes: position and orientation have three each."""
FEW_JOINTS = 0.02
"""[cost]/rad of the orientation of a hand with fewer, beside 1 [cost]/m: 1 rad that
remains moves a hand 0.2 m from its joints by 0.02^2 / 0.2 = 2 mm."""


def arm_of(robot: RobotDescription, frame: str) -> tuple[Link, ...]:
    """Return the links from a frame to its shoulder, the frame's own first.

    They carry no other hand, no foot and no head; empty if the frame's own link does.
    One hand that this link carries is the arm's own, as that beyond a wrist.
    """
    ends = {f.name for f in robot.frames if f.role in ("foot", "head")}
    own_link, hands = robot.link_of(frame), set(robot.hands.values())
    beyond = {x for x in hands if any(k.name == own_link for k in _chain(robot, x))}
    others = (ends | hands) - {frame} - (beyond if len(beyond) == 1 else set())
    carrying = {link.name for x in others for link in _chain(robot, x)}
    own: list[Link] = []
    for link in _chain(robot, frame):
        if link.name in carrying or link.parent is None:
            break
        own.append(link)
    return tuple(own)


def has_few_joints(robot: RobotDescription, frame: str) -> bool:
    """Whether a frame is a hand, and its arm has too few joints for every pose."""
    joints = [x.joint for x in arm_of(robot, frame) if x.joint and x.joint.independent]
    return frame in robot.hands.values() and 0 < len(joints) < POSE_JOINTS


def arm_length(robot: RobotDescription, frame: str) -> float:
    """Return the sum of the distances from joint to joint and to the hand, m."""
    inner = poses_in_rigid_bodies(robot.links)
    links = arm_of(robot, frame)
    if not links:
        return 0.0
    end = inner[links[0].name]
    if any(f.name == frame for f in robot.frames):
        end = end * se3_of(robot.frame(frame))
    length = 0.0
    for link in links:
        if link.joint is not None:
            length += float(np.linalg.norm(end.translation))
            end = inner[str(link.parent)] * se3_of(link)
    return length


def _chain(robot: RobotDescription, frame: str) -> Iterator[Link]:
    """Yield the link of a frame and those above it."""
    link = robot.link(robot.link_of(frame))
    while True:
        yield link
        if link.parent is None:
            return
        link = robot.link(link.parent)
