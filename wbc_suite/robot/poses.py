"""Poses of description items as `pinocchio.SE3`, and back."""

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
import pinocchio as pin

from wbc_suite.robot.elements import Link, rigid_bodies
from wbc_suite.robot.shapes import Posed, ShapeFields
from wbc_suite.typing import Matrix, Vector

HasPose: TypeAlias = Posed | ShapeFields
"""An item of a description with a pose: a link, a frame, a shape, ..."""


def pose_at(pos: Any, quat: Any) -> pin.SE3:
    """Return the pose of a position and a quaternion w x y z."""
    return pin.SE3(pin.Quaternion(*quat).matrix(), np.array(pos))


def se3_of(posed: HasPose) -> pin.SE3:
    """Return the pose of an item."""
    return pose_at(posed.pos, posed.quat)


def rotation_matrix(posed: HasPose) -> Matrix:
    """Return the orientation of an item as a matrix, shape (3, 3)."""
    return pin.Quaternion(*posed.quat).matrix()


def pose_fields(pose: Any) -> dict[str, Any]:
    """Return `pos` and `quat` (w x y z) of a `pinocchio.SE3`."""
    x, y, z, w = pin.Quaternion(pose.rotation).normalized().coeffs().tolist()
    return {"pos": tuple(pose.translation.tolist()), "quat": (w, x, y, z)}


def compose(*items: HasPose) -> dict[str, Any]:
    """Return the fields of the product of poses.

    Identity poses are skipped, so that a single other pose keeps all its digits.
    """
    moved = [i for i in items if i.pos != (0, 0, 0) or i.quat != (1, 0, 0, 0)]
    if len(moved) == 1:
        return {"pos": moved[0].pos, "quat": moved[0].quat}
    pose = pin.SE3.Identity()
    for item in moved:
        pose = pose * se3_of(item)
    return pose_fields(pose)


def poses_in_rigid_bodies(links: Sequence[Link]) -> dict[str, Any]:
    """Return the pose of each link in the moving (or first) link it is fixed to."""
    owners = rigid_bodies(links)
    poses: dict[str, Any] = {}
    for link in links:
        if owners[link.name] == link.name:
            poses[link.name] = pin.SE3.Identity()
        else:
            poses[link.name] = poses[str(link.parent)] * se3_of(link)
    return poses


def joint_motion(axis: Vector, value: float, *, slide: bool) -> Any:
    """Return the displacement of a slide (m) or hinge (rad) with a unit axis (3,)."""
    if slide:
        return pin.SE3(np.eye(3), value * axis)
    return pin.SE3(pin.AngleAxis(value, axis).matrix(), np.zeros(3))
