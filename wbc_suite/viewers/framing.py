"""Placement of a camera so that a picture contains the whole subject."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import mujoco
import numpy as np

from wbc_suite.typing import Matrix

ViewName: TypeAlias = Literal["three_quarter", "front", "side", "back"]


@dataclass(frozen=True, kw_only=True, slots=True)
class View:
    """The direction of a camera; its distance follows from the subject.

    Attributes:
        azimuth: Viewing direction about the world's z axis, degrees; 180 is along -x,
            into the face of a robot that faces +x.
        elevation: Viewing direction above the horizon, degrees; negative looks down.
        fov: Vertical field of view, degrees.
        margin: Size of the picture over that of the subject.
    """

    azimuth: float
    elevation: float
    fov: float = 28.0
    margin: float = 1.08


VIEWS: dict[ViewName, View] = {
    "three_quarter": View(azimuth=145.0, elevation=-14.0),
    "front": View(azimuth=180.0, elevation=-6.0),
    "side": View(azimuth=90.0, elevation=-6.0),
    "back": View(azimuth=0.0, elevation=-6.0),
}


def fit_camera(view: View, points: Matrix, *, aspect: float) -> mujoco.MjvCamera:
    """Return a free camera that has all points, m, shape (n, 3), in its picture.

    In camera axes a point at offset (r, u, f) to the right, up and forward of the
    look-at point is inside when ``|u| <= (d + f) tan(fov / 2)`` and ``|r| <= aspect
    (d + f) tan(fov / 2)``; d is the smallest distance at which all are. `aspect` is the
    width of the picture over its height.
    """
    azimuth, elevation = np.radians([view.azimuth, view.elevation])
    right = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
    level = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    forward = np.append(np.cos(elevation) * level[:2], np.sin(elevation))
    axes = np.array([right, np.cross(right, forward), forward])
    local = points @ axes.T
    middle = (local.min(axis=0) + local.max(axis=0)) / 2.0
    offset = local - middle
    tangent = np.tan(np.radians(view.fov) / 2.0) / view.margin
    reach = np.maximum(np.abs(offset[:, 1]), np.abs(offset[:, 0]) / aspect)
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = middle @ axes
    camera.azimuth, camera.elevation = view.azimuth, view.elevation
    camera.distance = float(np.max(reach / tangent - offset[:, 2]))
    return camera


def subject_corners(
    model: mujoco.MjModel, data: mujoco.MjData, subject: str = ""
) -> Matrix:
    """Return the corners of all geoms' boxes in the world, shape (n, 3); no planes.

    Only bodies whose names start with the subject count.
    """
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
    names = [model.body(body).name for body in model.geom_bodyid]
    seen = np.array([name.startswith(subject) for name in names])
    seen &= model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE
    seen &= model.geom_group < 3  # others are hidden by default in MuJoCo's viewers
    centre, half = model.geom_aabb[seen, :3], model.geom_aabb[seen, 3:]
    local = centre[:, None] + signs * half[:, None]
    rotation = data.geom_xmat[seen].reshape(-1, 3, 3)
    world = data.geom_xpos[seen, None] + local @ rotation.transpose(0, 2, 1)
    return world.reshape(-1, 3)
