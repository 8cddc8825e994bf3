"""Soles: the shapes that feet touch the ground with, and level frames."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.robot.adopt.foot_shapes import foot_spheres
from wbc_suite.robot.adopt.posed_robot import PosedRobot
from wbc_suite.robot.adopt.standing_posture import AT_FRAME, wheel_axis
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Frame
from wbc_suite.robot.poses import pose_fields, se3_of

FLAT = 0.004
"""m; what lies at most so much higher than the lowest point belongs to the sole."""

UPRIGHT_COSINE, AHEAD_COSINE = 0.98, 0.7
"""Least cosines of z to up and of x to ahead of a sole that is taken as given."""
LEAST_SOLE, BESIDE = 0.025, 0.02
"""m; least length and width of a sole, and greatest distance of a foot's frame beside
it: NAO's is 40 mm narrow where it is narrowest, H2's ankle at the edge of its sole."""
BIPED = 2  # feet at most; those of others are points


class Sole(NamedTuple):
    """A rectangle under a foot.

    Attributes:
        edges: Heel, toes, right, left in the axes of the foot's frame, m.
        height: Of the frame over the sole, m.
    """

    edges: tuple[float, float, float, float]
    height: float


def guess_sole(robot: RobotDescription, frame: str) -> Sole | None:
    """Return the rectangle of the lowest collision points; None without an area."""
    spheres = foot_spheres(robot, frame)
    bottom = spheres[:, 2] - spheres[:, 3]
    if not len(spheres):
        return None
    flat = spheres[bottom < bottom.min() + FLAT]
    (heel, right), (toes, left) = flat[:, :2].min(axis=0), flat[:, :2].max(axis=0)
    if heel >= toes or right >= left:
        return None
    edges = (float(heel), float(toes), float(right), float(left))
    return Sole(edges, -float(bottom.min()))


def sole_fault(left: Sole | None, right: Sole | None) -> str:
    """Return why two rectangles are no soles to stand on; empty if they are.

    Soles have a length and width, about the same below both feet, and the ankles are
    above them.
    """
    if left is None or right is None:
        return "no area of its collision shapes lies below one of them"
    for heel, toes, outer, inner in (left.edges, right.edges):
        if toes - heel < LEAST_SOLE or inner - outer < LEAST_SOLE:
            return f"a sole of {toes - heel:.3f} by {inner - outer:.3f} m is narrow"
        beside = max(heel, outer, -toes, -inner)
        if beside > BESIDE:
            return f"one is {beside:.3f} m beside its sole"
    sizes = [np.diff(np.reshape(x.edges, (2, 2))).ravel() for x in (left, right)]
    if np.abs(sizes[0] - sizes[1]).max() > 0.1 * np.max(sizes):
        return "their soles differ in size"
    return ""


def ball_radius(robot: RobotDescription, frame: str) -> float:
    """Return the radius of a foot that rolls about its frame, m; 0 for others.

    It is a ball, or a wheel on a hinge without limits through the frame.
    """
    spheres, axis = foot_spheres(robot, frame), wheel_axis(robot, frame)
    if axis is not None and len(spheres):
        across = np.cross(se3_of(robot.frame(frame)).rotation.T @ axis, spheres[:, :3])
        return float((np.linalg.norm(across, axis=1) + spheres[:, 3]).max())
    for x, y, z, radius in spheres:
        if radius > 0.0 and np.linalg.norm((x, y, z)) < AT_FRAME:
            return float(radius)
    return 0.0


def level_soles(
    robot: RobotDescription, given: Sequence[Frame], take: Callable[[str, str], str]
) -> RobotDescription:
    """Return a biped whose frames of feet have z up and x ahead in `ready`.

    Ahead is x of the first link. A given frame that is turned stays, and loses its role
    to one beside it, with a name that `take` makes unique.
    """
    feet = [frame for frame in robot.frames if frame.role == "foot"]
    if len(feet) > BIPED:
        return robot
    posed = PosedRobot(robot)
    root = posed.pose(robot.links[0].name).rotation
    to_world = pin.Quaternion(*robot.root.quat).matrix() @ root.T
    frames = {frame.name: frame for frame in robot.frames}
    for frame in feet:
        rotation = to_world @ posed.pose(frame.name).rotation
        if rotation[2, 2] > UPRIGHT_COSINE and rotation[0, 0] > AHEAD_COSINE:
            continue
        fields = pose_fields(se3_of(frame) * pin.SE3(rotation.T, np.zeros(3)))
        name = frame.name
        if any(frame.name == own.name for own in given):
            frames[name] = frame.model_copy(update={"role": "other"})
            name = take(f"{name}_sole", "frame")
        frames[name] = frame.model_copy(update={"name": name, **fields})
    return robot.model_copy(update={"frames": tuple(frames.values())})
