"""Collision shapes of feet, and the side that they stand on."""

import importlib
from typing import Any

import numpy as np

from wbc_suite.robot.collision_capsules import collision_spheres
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import rigid_bodies
from wbc_suite.robot.poses import poses_in_rigid_bodies, se3_of
from wbc_suite.typing import Matrix, Vector

SAME_SIDE = 0.998  # cosine, 3.6 degrees; sides of a hull that are turned less are one
MOST_TILT = 0.9  # cosine, 26 degrees; a side that is turned more is no sole


def foot_spheres(robot: RobotDescription, name: str) -> Matrix:
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


def sole_normal(robot: RobotDescription, name: str, down: Vector) -> Vector | None:
    """Return the outward normal of the largest side that a foot turns down, or None.

    Both directions are in the axes of the foot's frame, shape (3,).
    """
    points = np.unique(foot_spheres(robot, name)[:, :3].round(6), axis=0)
    if len(points) < 4 or np.linalg.matrix_rank(points - points[0], tol=1e-3) < 3:
        return None
    trimesh: Any = importlib.import_module("trimesh")  # 0.3 s, and without types
    hull = trimesh.convex.convex_hull(points)
    normals, areas = np.asarray(hull.face_normals), np.asarray(hull.area_faces)
    below = normals @ down > MOST_TILT
    if not below.any():
        return None
    normals, areas = normals[below], areas[below]
    together = (normals @ normals.T > SAME_SIDE) * areas
    best = together[int(np.argmax(together.sum(axis=1)))] @ normals
    return best / np.linalg.norm(best)
