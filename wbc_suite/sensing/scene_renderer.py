"""MuJoCo's renderer, spared what software OpenGL is slow at.

On a processor a picture's cost is that of its vertices. MuJoCo cuts an infinite plane
into 200 x 200 pieces, more than all else in a scene together, and draws what lies
outside of the picture too.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from wbc_suite.typing import Array, Indices

__all__ = ["Floor", "SceneRenderer", "coarse_floors"]

GEOM = int(mujoco.mjtObj.mjOBJ_GEOM)
PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)
PIECES = 20
"""Of an infinite plane, along each side."""

UNSEEN = 5
"""A group of geoms that MuJoCo does not draw by default."""

Labelled: TypeAlias = NDArray[np.int32]

FLAT = (int(mujoco.mjtRndFlag.mjRND_SEGMENT), int(mujoco.mjtRndFlag.mjRND_IDCOLOR))


@dataclass(frozen=True, kw_only=True, slots=True)
class Floor:
    """How an infinite plane is drawn: as a finite one that stays below the camera.

    Attributes:
        size: Half sides and half a piece's, m, as a plane's size in MJCF.
        repeats: Factors on the material's repeats. MuJoCo spans a finite plane by its
            texture, and an infinite one every 2 m.
    """

    size: tuple[float, float, float]
    repeats: tuple[float, float]


def coarse_floors(model: mujoco.MjModel) -> dict[int, Floor]:
    """Return how each infinite plane of a model is drawn, by its geom."""
    infinite = (model.geom_type == PLANE) & (model.geom_size[:, :2] <= 0.0).all(1)
    return {int(i): _floor(model, int(i)) for i in np.flatnonzero(infinite)}


def _floor(model: mujoco.MjModel, geom: int) -> Floor:
    """Make a plane to behind the horizon, whose middle is a corner of the texture."""
    material = int(model.geom_matid[geom])
    repeat = np.ones(2) if material < 0 else np.array(model.mat_texrepeat[material])
    period = 4.0 / np.where(repeat > 0.0, repeat, 1.0)  # m; half a plane holds n
    far = 1.1 * float(model.vis.map.zfar) * float(model.stat.extent)
    x, y = (np.ceil(far / period) * period).tolist()
    return Floor(size=(x, y, max(x, y) / PIECES), repeats=(x, y))


class SceneRenderer(mujoco.Renderer):
    """MuJoCo's renderer with coarse floors, of what is in the picture.

    Args:
        model: What to draw, into which floors are written as they are drawn.
        height: Of the picture, pixels.
        width: Of the picture, pixels.
        floors: Planes that are drawn as finite ones, by geom.
        culls: Whether what lies outside of a picture is left out; its shadow may not.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        height: int,
        width: int,
        *,
        floors: Mapping[int, Floor],
        culls: bool,
    ) -> None:
        super().__init__(model, height, width)
        self._floors, self._culls = dict(floors), culls
        self._colors = np.empty((height, width, 3), dtype=np.uint8)
        self._depths = np.empty((height, width), dtype=np.float32)

    @property
    def _inner(self) -> Any:
        """This one: MuJoCo's renderer has no public way to its context.

        Kept as an attribute it would leave 17 MB to the garbage collector.
        """
        return self

    def update_scene(
        self,
        data: mujoco.MjData,
        camera: int | str | mujoco.MjvCamera = -1,
        scene_option: mujoco.MjvOption | None = None,
    ) -> None:
        """Take what is to be drawn from a state; see MuJoCo's renderer."""
        model, unseen = self._inner.model, np.empty(0, dtype=np.int64)
        if self._culls and isinstance(camera, int) and camera >= 0:
            unseen = outside(
                model, data, camera, self._inner.width / self._inner.height
            )
        groups = model.geom_group[unseen]
        model.geom_group[unseen] = UNSEEN
        try:
            super().update_scene(data, camera, scene_option)
        finally:
            model.geom_group[unseen] = groups
        if self._floors:
            self._repeat_textures()

    def draw_surfaces(self) -> None:
        """Draw what is where, for `read_depth` and `read_geoms`."""
        kept = self.scene.flags.copy()
        self.scene.flags[list(FLAT)] = True
        try:
            self.make_current()
            mujoco.mjr_render(self._inner._rect, self.scene, self._inner._mjr_context)
        finally:
            self.scene.flags[:] = kept

    def read_depth(self) -> NDArray[np.float32]:
        """Return distances along the camera's axis, m, shape (height, width)."""
        inner, model = self._inner, self._inner.model
        mujoco.mjr_readPixels(None, self._depths, inner._rect, inner._mjr_context)
        depths = self._depths[::-1]  # 1 at the near plane, 0 at the far
        near, far = (
            float(plane) * float(model.stat.extent)
            for plane in (model.vis.map.znear, model.vis.map.zfar)
        )
        if self.scene.camera[0].orthographic:
            return np.float32(far) - np.float32(far - near) * depths
        found = np.float32(1.0 / near - 1.0 / far) * depths
        found += np.float32(1.0 / far)
        return np.reciprocal(found, out=found)

    def read_geoms(self, numbers: Labelled) -> Labelled:
        """Return the number of the geom at each pixel, shape (height, width).

        Args:
            numbers: The number of each geom, and last of what is none.
        """
        inner = self._inner
        mujoco.mjr_readPixels(self._colors, None, inner._rect, inner._mjr_context)
        found = np.full(self.scene.ngeom + 1, -1, dtype=np.int64)
        for geom in self.scene.geoms[: self.scene.ngeom]:
            if geom.objtype == GEOM and geom.segid >= 0:
                found[geom.segid + 1] = geom.objid
        places = self._colors[::-1, :, 0]
        if len(found) > 256:
            places = places + self._colors[::-1, :, 1] * np.int64(256)
        return numbers[found][places]  # once for all pixels: it is a tenth of a picture

    def upload_textures(self) -> None:
        """Take the model's textures as they are now."""
        self.make_current()
        for k in range(self._inner.model.ntex):
            mujoco.mjr_uploadTexture(self._inner.model, self._inner._mjr_context, k)

    def make_current(self) -> None:
        """Let OpenGL draw for this renderer."""
        if self._inner._gl_context is not None:
            self._inner._gl_context.make_current()

    def _repeat_textures(self) -> None:
        """Let textures on coarse floors be as large as MuJoCo draws them."""
        left = len(self._floors)
        for geom in self.scene.geoms[: self.scene.ngeom]:
            if geom.type == PLANE and geom.objid in self._floors:
                geom.texrepeat[:] *= self._floors[geom.objid].repeats
                left -= 1
                if not left:
                    return


def outside(
    model: mujoco.MjModel, data: mujoco.MjData, camera: int, aspect: float
) -> Indices:
    """Return geoms that lie outside of a camera's picture, by spheres around them.

    Args:
        model: The scene.
        data: Its state.
        camera: A camera of the model with no optics but a field of view.
        aspect: Width of its picture, over its height.
    """
    if model.cam_projection[camera] or model.cam_sensorsize[camera].any():
        return np.empty(0, dtype=np.int64)
    centers, half = np.split(model.geom_aabb, 2, axis=1)
    turns = data.geom_xmat.reshape(-1, 3, 3)
    at = data.geom_xpos + np.einsum("gij,gj->gi", turns, centers)
    x, y, z = ((at - data.cam_xpos[camera]) @ data.cam_xmat[camera].reshape(3, 3)).T
    radii = np.sqrt(np.einsum("gi,gi->g", half, half))
    seen = z < radii
    angle = 0.5 * np.radians(model.cam_fovy[camera])
    for across, half_angle in ((y, angle), (x, np.arctan(aspect * np.tan(angle)))):
        seen &= _beside(across, z, half_angle) < radii
    return np.flatnonzero(~seen)


def _beside(across: Array, z: Array, half_angle: float) -> Array:
    """Return how far points are outside of two planes through the camera, m."""
    return np.abs(across) * np.cos(half_angle) + z * np.sin(half_angle)
