"""Soles: the shapes that feet touch the ground with, and level frames."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.robot.adopt.posed_robot import PosedRobot
from wbc_suite.robot.adopt.standing_posture import AT_FRAME, wheel_axis
from wbc_suite.robot.collision_capsules import collision_spheres
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import Frame, rigid_bodies
from wbc_suite.robot.poses import pose_fields, poses_in_rigid_bodies, se3_of
from wbc_suite.typing import Matrix

FLAT = 0.004
"""m; what lies at most so much higher than the lowest point belongs to the sole."""

UPRIGHT_COSINE, AHEAD_COSINE = 0.98, 0.7
"""Least cosines of z to up and of x to ahead of a sole that is taken as given."""
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
    spheres = _spheres(robot, frame)
    bottom = spheres[:, 2] - spheres[:, 3]
    if not len(spheres):
        return None
    flat = spheres[bottom < bottom.min() + FLAT]
    (heel, right), (toes, left) = flat[:, :2].min(axis=0), flat[:, :2].max(axis=0)
    if heel >= toes or right >= left:
        return None
    edges = (float(heel), float(toes), float(right), float(left))
    return Sole(edges, -float(bottom.min()))


def ball_radius(robot: RobotDescription, frame: str) -> float:
    """Return the radius of a foot that rolls about its frame, m; 0 for others.

    It is a ball, or a wheel on a hinge without limits through the frame.
    """
    spheres, axis = _spheres(robot, frame), wheel_axis(robot, frame)
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


def _spheres(robot: RobotDescription, name: str) -> Matrix:
    """Return the spheres of a foot's rigid body in the axes of its frame, (n, 4)."""
    frame = robot.frame(name)
    bodies, poses = rigid_bodies(robot.links), poses_in_rigid_bodies(robot.links)
    rows: list[Matrix] = [np.zeros((0, 4))]
    to_frame = (poses[frame.link] * se3_of(frame)).inverse()
    for link, found in collision_spheres(robot).items():
        if bodies[link] == bodies[frame.link]:
            pose = to_frame * poses[link]
            centres = found[:, :3] @ pose.rotation.T + pose.translation
            rows.append(np.column_stack([centres, found[:, 3]]))
    return np.concatenate(rows)
