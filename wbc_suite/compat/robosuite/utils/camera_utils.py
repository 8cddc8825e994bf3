"""Matrices of cameras; pixels are counted from the upper left corner, row first."""

from typing import Any

import numpy as np

from wbc_suite.typing import Array

CORRECTION = np.diag([1.0, -1.0, -1.0, 1.0])
"""From axes with z forward and y down to MuJoCo's, with z back and y up."""


def get_camera_intrinsic_matrix(
    sim: Any, camera_name: str, camera_height: int, camera_width: int
) -> Array:
    """Return the intrinsic matrix, shape (3, 3)."""
    fovy = np.deg2rad(sim.model.cam_fovy[sim.model.camera_name2id(camera_name)])
    f = 0.5 * camera_height / np.tan(fovy / 2)
    return np.array([[f, 0, camera_width / 2], [0, f, camera_height / 2], [0, 0, 1]])


def get_camera_extrinsic_matrix(sim: Any, camera_name: str) -> Array:
    """Return the pose of the camera in the world, z forward, shape (4, 4)."""
    pose = np.eye(4)
    pose[:3, 3] = sim.data.get_camera_xpos(camera_name)
    pose[:3, :3] = sim.data.get_camera_xmat(camera_name)
    return pose @ CORRECTION


def get_camera_transform_matrix(
    sim: Any, camera_name: str, camera_height: int, camera_width: int
) -> Array:
    """Return the matrix from the world to pixels, shape (4, 4)."""
    K = np.eye(4)
    K[:3, :3] = get_camera_intrinsic_matrix(
        sim, camera_name, camera_height, camera_width
    )
    return K @ np.linalg.inv(get_camera_extrinsic_matrix(sim, camera_name))


def get_camera_segmentation(
    sim: Any, camera_name: str, camera_height: int, camera_width: int
) -> Array:
    """Return type and index of the element at each pixel, upper row first."""
    return sim.render(
        camera_name=camera_name,
        height=camera_height,
        width=camera_width,
        segmentation=True,
    )[::-1]


def get_real_depth_map(sim: Any, depth_map: Any) -> Array:
    """Return depths of 0 to 1 as distances along the camera's axis, m."""
    model = sim.model
    near, far = (
        plane * model.stat.extent for plane in (model.vis.map.znear, model.vis.map.zfar)
    )
    return near / (1.0 - np.asarray(depth_map) * (1.0 - near / far))


def project_points_from_world_to_camera(
    points: Any, world_to_camera_transform: Any, camera_height: int, camera_width: int
) -> Array:
    """Return the pixels, row and column, of points, shape (..., 3), in the picture."""
    points = np.asarray(points)
    ones = np.ones((*points.shape[:-1], 1))
    found = np.concatenate([points, ones], axis=-1) @ np.transpose(
        world_to_camera_transform
    )
    pixels = np.round(found[..., :2] / found[..., 2:3]).astype(int)
    columns = np.clip(pixels[..., 0], 0, camera_width - 1)
    rows = np.clip(pixels[..., 1], 0, camera_height - 1)
    return np.stack([rows, columns], axis=-1)


def transform_from_pixels_to_world(
    pixels: Any, depth_map: Any, camera_to_world_transform: Any
) -> Array:
    """Return the points of the world at pixels, row and column, shape (..., 2).

    The depth map is in m, shape (..., height, width, 1).
    """
    pixels = np.asarray(pixels, np.float64)
    depth_map = np.asarray(depth_map)
    if depth_map.ndim == 3:
        z = bilinear_interpolate(depth_map, pixels[..., 1], pixels[..., 0])
    else:
        flat = [
            bilinear_interpolate(m, p[..., 1], p[..., 0])
            for m, p in zip(
                depth_map.reshape(-1, *depth_map.shape[-3:]),
                pixels.reshape(-1, 2),
                strict=True,
            )
        ]
        z = np.reshape(flat, (*pixels.shape[:-1], 1))
    z = np.reshape(z, (*pixels.shape[:-1], 1))
    columns, rows = pixels[..., 1:2], pixels[..., :1]
    found = np.concatenate([columns * z, rows * z, z, np.ones_like(z)], axis=-1)
    return (found @ np.transpose(camera_to_world_transform))[..., :3]


def bilinear_interpolate(im: Any, x: Any, y: Any) -> Array:
    """Return the values of a picture between pixels; x is the column, y the row."""
    im, x, y = np.asarray(im), np.asarray(x), np.asarray(y)
    left = np.clip(np.floor(x).astype(int), 0, im.shape[1] - 1)
    upper = np.clip(np.floor(y).astype(int), 0, im.shape[0] - 1)
    right = np.clip(left + 1, 0, im.shape[1] - 1)
    lower = np.clip(upper + 1, 0, im.shape[0] - 1)
    a, b = (x - left)[..., None], (y - upper)[..., None]
    above = (1 - a) * im[upper, left] + a * im[upper, right]
    below = (1 - a) * im[lower, left] + a * im[lower, right]
    return (1 - b) * above + b * below


class CameraMover:
    """Moves a camera of an environment."""

    def __init__(
        self,
        env: Any,
        camera: str = "frontview",
        init_camera_pos: Any = None,
        init_camera_quat: Any = None,
    ) -> None:
        self.env, self.camera = env, camera
        self._id = env.sim.model.camera_name2id(camera)
        self.set_camera_pose(init_camera_pos, init_camera_quat)

    def set_camera_pose(self, pos: Any = None, quat: Any = None) -> None:
        """Write position, m, and orientation, x y z w, in the parent's frame."""
        model = self.env.sim.model
        if pos is not None:
            model.cam_pos[self._id] = pos
        if quat is not None:
            model.cam_quat[self._id] = np.asarray(quat)[[3, 0, 1, 2]]
        self.env.sim.forward()

    def get_camera_pose(self) -> tuple[Array, Array]:
        """Return position, m, and orientation, x y z w."""
        model = self.env.sim.model
        quat = model.cam_quat[self._id][[1, 2, 3, 0]]
        return model.cam_pos[self._id].copy(), quat
