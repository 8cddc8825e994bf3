"""Projections between the world and pictures: intrinsics, extrinsics, normals."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from wbc_suite.errors import UnknownNameError
from wbc_suite.typing import Array, Matrix, Vector

FLIP = np.diag([1.0, -1.0, -1.0])
"""From the camera axes of OpenGL and MuJoCo (y up, z back) to those of OpenCV."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Projection:
    """A pinhole camera at one time.

    The camera's axes are OpenCV's: x right, y down, z forward. Pixels are (u, v),
    columns before rows; whole numbers are the middles of pixels, (0, 0) is the upper
    left one.

    Attributes:
        K: Intrinsics, pixels, shape (3, 3): (u, v, 1) ~ K (x, y, z).
        T_wc: Extrinsics: pose of the camera in the world, shape (4, 4).
    """

    K: Matrix
    T_wc: Matrix
    width: int
    height: int

    @classmethod
    def of(
        cls,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        camera: int,
        *,
        width: int,
        height: int,
    ) -> "Projection":
        """Return the present projection of a camera of the scene."""
        mujoco.mj_camlight(model, data)  # a step leaves cameras one step behind
        T_wc = np.eye(4)
        T_wc[:3, :3] = data.cam_xmat[camera].reshape(3, 3) @ FLIP
        T_wc[:3, 3] = data.cam_xpos[camera]
        K = _intrinsics(model, camera, width, height)
        K.flags.writeable = T_wc.flags.writeable = False
        return cls(K=K, T_wc=T_wc, width=width, height=height)

    def to_pixels(self, points: ArrayLike) -> tuple[Array, Array]:
        """Project points of the world, m, shape (..., 3).

        Returns:
            Pixels, shape (..., 2), and depths along the camera's axis, m, shape (...).
            Points with a depth <= 0 are behind the camera; their pixels are invalid.
        """
        offset = np.asarray(points, dtype=np.float64) - self.T_wc[:3, 3]
        local = offset @ self.T_wc[:3, :3]
        depth = local[..., 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            pixels = (local @ self.K.T)[..., :2] / depth[..., None]
        return pixels, depth

    def to_world(self, pixels: ArrayLike, depth: ArrayLike) -> Array:
        """Return the points of the world at pixels (u, v), shape (..., 2).

        `depth` is the distance along the camera's axis, m, shape (...).
        """
        rays = np.asarray(pixels, dtype=np.float64) - self.K[:2, 2]
        rays = np.concatenate(
            [rays / self.K.diagonal()[:2], np.ones((*rays.shape[:-1], 1))], axis=-1
        )
        points = rays * np.asarray(depth, dtype=np.float64)[..., None]
        return points @ self.T_wc[:3, :3].T + self.T_wc[:3, 3]

    def point_cloud(self, depth: ArrayLike) -> Array:
        """Return the point of the world at each pixel, shape (height, width, 3), m.

        `depth` is in m, shape (height, width) or (height, width, 1).
        """
        flat = np.reshape(depth, (self.height, self.width))
        columns, rows = np.meshgrid(np.arange(self.width), np.arange(self.height))
        return self.to_world(np.stack([columns, rows], axis=-1), flat)

    def normals(self, depth: ArrayLike) -> Array:
        """Return surface normals in the world, towards the camera, (height, width, 3).

        Normals are computed from differences of neighbouring points, so they are wrong
        along edges. `depth` is as `point_cloud` takes it.
        """
        points = self.point_cloud(depth)
        down, right = np.gradient(points, axis=(0, 1))
        normals = np.cross(down, right)
        length = np.linalg.norm(normals, axis=-1, keepdims=True)
        normals /= np.where(length > 0.0, length, 1.0)
        away = np.sum(normals * (points - self.T_wc[:3, 3]), axis=-1) > 0.0
        normals[away] *= -1.0
        return normals


def camera_id(model: mujoco.MjModel, name: str) -> int:
    """Return the index of a camera.

    `robot0_right_eye_in_hand` of a robot with one hand may also be called
    `robot0_eye_in_hand`, as in existing datasets.

    Raises:
        UnknownNameError: If there is no such camera.
    """
    known = [model.camera(i).name for i in range(model.ncam)]
    if name in known:
        return known.index(name)
    prefix, hand, rest = str(name).partition("eye_in_hand")
    sides = [f"{prefix}{side}_{hand}{rest}" for side in ("right", "left")]
    there = [known.index(side) for side in sides if hand and side in known]
    if len(there) == 1:
        return there[0]
    raise UnknownNameError("camera", name, known)


def _intrinsics(model: mujoco.MjModel, camera: int, width: int, height: int) -> Matrix:
    """Return K from the camera's sensor, or from its field of view without one."""
    sensor = model.cam_sensorsize[camera]
    K = np.eye(3)
    if sensor[1] > 0.0:
        scale: Vector = np.array([width, height]) / sensor
        focal, offset = np.split(model.cam_intrinsic[camera] * np.tile(scale, 2), 2)
    else:
        f = 0.5 * height / np.tan(np.deg2rad(model.cam_fovy[camera]) / 2.0)
        focal, offset = np.array([f, f]), np.zeros(2)
    K[0, 0], K[1, 1] = focal
    K[0, 2] = (width - 1) / 2.0 - offset[0]
    K[1, 2] = (height - 1) / 2.0 - offset[1]
    return K
