"""Spheres whose convex hull a shape is: its exact distance from a plane."""

import numpy as np
from scipy.spatial.transform import Rotation

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.shapes import Box, Capsule, Ellipsoid, Hull, Shape, Sphere
from wbc_suite.robot.surfaces import support_points
from wbc_suite.typing import Matrix

__all__ = ["spanning_spheres"]

_CORNERS = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T


def spanning_spheres(robot: RobotDescription) -> dict[str, Matrix]:
    """Return the spheres of all collision shapes by link.

    Rows are x, y, z in the link's frame and the radius, m, shape (n, 4). Links without
    shapes are left out.
    """
    return {
        link.name: np.concatenate([_in_link(shape) for shape in link.collision])
        for link in robot.links
        if link.collision
    }


def _in_link(shape: Shape) -> Matrix:
    spheres = _spheres(shape)
    turn = Rotation.from_quat(shape.quat, scalar_first=True).as_matrix()
    return np.column_stack([spheres[:, :3] @ turn.T + shape.pos, spheres[:, 3]])


def _spheres(shape: Shape) -> Matrix:
    match shape:
        case Sphere(radius=radius):
            return np.array([[0.0, 0.0, 0.0, radius]])
        case Capsule(start=start, end=end, radius=radius):
            return np.array([[*start, radius], [*end, radius]])
        case Hull(spheres=spheres):
            return np.asarray(spheres, dtype=np.float64)
        case Box(size=size, radius=radius):
            return _with_radius(_CORNERS * (np.asarray(size) - radius), radius)
        case Ellipsoid(size=size):
            # The box around it: larger by its corners, which no hand is made of.
            return _with_radius(_CORNERS * np.asarray(size), 0.0)
        case _:
            return _with_radius(support_points(shape), 0.0)


def _with_radius(points: Matrix, radius: float) -> Matrix:
    return np.column_stack([points, np.full(len(points), radius)])
