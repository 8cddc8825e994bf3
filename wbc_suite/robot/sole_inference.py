"""What a foot touches the ground with, by the collision shapes of its rigid body."""

from typing import NamedTuple

import numpy as np

from wbc_suite.robot.collision_capsules import collision_spheres
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import rigid_bodies
from wbc_suite.robot.poses import poses_in_rigid_bodies, se3_of
from wbc_suite.typing import Matrix

FLAT = 0.004
"""m; what lies at most so much higher than the lowest point belongs to the sole."""

AT_FRAME = 0.01
"""m; greatest distance of a ball's centre from the frame of the foot."""


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
    """Return the radius of a foot that is a ball about its frame, m; 0 for others."""
    for x, y, z, radius in _spheres(robot, frame):
        if radius > 0.0 and np.linalg.norm((x, y, z)) < AT_FRAME:
            return float(radius)
    return 0.0


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
