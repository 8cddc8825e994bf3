"""Pictures of a MuJoCo model without a display, drawn with little work.

On a processor the cost of a picture is that of its vertices. MuJoCo cuts an infinite
plane into 200 x 200 pieces, more than all else in a scene together, and draws geoms
outside of the picture too; here floors are coarse and such geoms are left out.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from typing import Any, Self, TypeAlias

import mujoco
import numpy as np
from numpy.typing import NDArray

from wbc_suite.errors import DeviceError
from wbc_suite.sensing import gl_backend
from wbc_suite.typing import Array, Indices

GEOM = int(mujoco.mjtObj.mjOBJ_GEOM)
PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)
PIECES = 20
"""Pieces of an infinite plane along each side."""

HIDDEN_GROUP = 5
"""A group of geoms that MuJoCo does not draw by default."""

MAX_GEOMS = 10_000  # of a scene that is drawn; MuJoCo leaves out further ones

SURFACE_FLAGS = [
    int(mujoco.mjtRndFlag.mjRND_SEGMENT),
    int(mujoco.mjtRndFlag.mjRND_IDCOLOR),
]
"""Flags to draw the index of each geom in place of its colour."""

Labels: TypeAlias = NDArray[np.int32]


class RenderPreset(StrEnum):
    """Quality of a picture.

    On a processor shadow map and multisampling cost 8 to 40 times more than all else in
    a small scene; coarse rounds and floors save two thirds of the rest.
    """

    FAST = "fast"
    BALANCED = "balanced"
    QUALITY = "quality"


QUALITY_FIELDS = ("shadowsize", "offsamples", "numslices", "numstacks")
QUALITIES = {
    RenderPreset.FAST: (64, 0, 16, 8),
    RenderPreset.BALANCED: (1024, 0, 28, 16),
    RenderPreset.QUALITY: (4096, 8, 28, 16),
}
"""Values of these fields of MuJoCo's `visual/quality`."""


def make_renderer(
    model: mujoco.MjModel,
    *,
    width: int,
    height: int,
    preset: RenderPreset | str | None = None,
) -> "Renderer":
    """Make a renderer with an OpenGL backend that works on this machine.

    It belongs to the thread that makes it. Making one takes 0.1 to 0.7 s, so keep it,
    and close it (``with make_renderer(...) as renderer``). The model is unchanged when
    this returns. Width and height of the picture are in pixels. Without a preset it is
    `RenderPreset.FAST` when the processor draws, and `RenderPreset.QUALITY` when a
    graphics card does.

    Raises:
        DeviceError: If nothing on this machine can draw; the message names the remedy.
    """
    if preset is None:
        software = gl_backend.activate().software
        preset = RenderPreset.FAST if software else RenderPreset.QUALITY
    try:
        return Renderer(model, width, height, RenderPreset(preset))
    except (mujoco.FatalError, AttributeError, ImportError, RuntimeError) as error:
        raise DeviceError(
            f"This machine cannot draw a picture: {error}. Install OpenGL: "
            f"{gl_backend.APT_COMMAND}   then: wbc-suite doctor"
        ) from error


class Renderer:
    """Draws pictures, depths and segmentations of one size; see `make_renderer`.

    Row 0 of a picture is its upper edge. `scene` is MuJoCo's scene, filled by
    `update_scene`; `width` and `height` of a picture are in pixels.
    """

    def __init__(
        self, model: mujoco.MjModel, width: int, height: int, preset: RenderPreset
    ) -> None:
        self.model, self.width, self.height = model, width, height
        coarse, shadows = preset != RenderPreset.QUALITY, preset != RenderPreset.FAST
        self._floors = coarse_floors(model) if coarse else {}
        self._culls = not shadows  # a shadow may fall into the picture
        self._option = mujoco.MjvOption()
        self._area = mujoco.MjrRect(0, 0, width, height)
        self._colors = np.empty((height, width, 3), dtype=np.uint8)
        self._depths = np.empty((height, width), dtype=np.float32)
        self._gl: Any = None
        self._context: mujoco.MjrContext | None = None
        gl_context = gl_backend.context_class()
        with _settings_of(model, preset, self._floors, (width, height)):
            self.scene = mujoco.MjvScene(model, maxgeom=MAX_GEOMS)
            self._gl = gl_context(width, height)
            self._gl.make_current()
            scale = int(mujoco.mjtFontScale.mjFONTSCALE_150)
            self._context = mujoco.MjrContext(model, scale)
        mujoco.mjr_setBuffer(int(mujoco.mjtFramebuffer.mjFB_OFFSCREEN), self._context)
        self._context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        self.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = shadows
        self.scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = shadows

    def update_scene(
        self, data: mujoco.MjData, camera: int | str | mujoco.MjvCamera = -1
    ) -> None:
        """Take the scene from a state.

        `camera` is the index or name of a camera of the model, -1 for a free camera
        that shows everything, or a camera of your own.
        """
        if isinstance(camera, str):
            camera = int(self.model.camera(camera).id)
        hidden = np.empty(0, dtype=np.int64)
        if self._culls and isinstance(camera, int) and camera >= 0:
            hidden = outside(self.model, data, camera, self.width / self.height)
        view = mujoco.MjvCamera() if isinstance(camera, int) else camera
        if camera == -1:
            mujoco.mjv_defaultFreeCamera(self.model, view)
        elif isinstance(camera, int):
            view.type, view.fixedcamid = mujoco.mjtCamera.mjCAMERA_FIXED, camera
        everything = int(mujoco.mjtCatBit.mjCAT_ALL)
        groups = self.model.geom_group[hidden]
        self.model.geom_group[hidden] = HIDDEN_GROUP
        try:
            mujoco.mjv_updateScene(
                self.model, data, self._option, None, view, everything, self.scene
            )
        finally:
            self.model.geom_group[hidden] = groups
        if self._floors:
            self._repeat_textures()

    def render(self) -> NDArray[np.uint8]:
        """Draw the scene; return its colours, RGB, shape (height, width, 3)."""
        self._draw()
        mujoco.mjr_readPixels(self._colors, None, self._area, self._context)
        return self._colors[::-1].copy()

    def draw_surfaces(self) -> None:
        """Draw the scene for `read_depth` and `read_geoms`."""
        kept = self.scene.flags.copy()
        self.scene.flags[SURFACE_FLAGS] = True
        try:
            self._draw()
        finally:
            self.scene.flags[:] = kept

    def read_depth(self) -> NDArray[np.float32]:
        """Return distances along the camera's axis, m, shape (height, width)."""
        mujoco.mjr_readPixels(None, self._depths, self._area, self._context)
        depths = self._depths[::-1]  # 1 at the near plane, 0 at the far
        near, far = (
            float(plane) * float(self.model.stat.extent)
            for plane in (self.model.vis.map.znear, self.model.vis.map.zfar)
        )
        if self.scene.camera[0].orthographic:
            return np.float32(far) - np.float32(far - near) * depths
        found = np.float32(1.0 / near - 1.0 / far) * depths
        found += np.float32(1.0 / far)
        return np.reciprocal(found, out=found)

    def read_geoms(self, labels: Labels) -> Labels:
        """Return the label of the geom at each pixel, shape (height, width).

        `labels` has the label of each geom, and last that of the background.
        """
        mujoco.mjr_readPixels(self._colors, None, self._area, self._context)
        found = np.full(self.scene.ngeom + 1, -1, dtype=np.int64)
        for geom in self.scene.geoms[: self.scene.ngeom]:
            if geom.objtype == GEOM and geom.segid >= 0:
                found[geom.segid + 1] = geom.objid
        places = self._colors[::-1, :, 0]
        if len(found) > 256:
            places = places + self._colors[::-1, :, 1] * np.int64(256)
        return labels[found][places]

    def upload_textures(self) -> None:
        """Take the model's textures as they are now."""
        self._gl.make_current()
        for k in range(self.model.ntex):
            mujoco.mjr_uploadTexture(self.model, self._context, k)

    def close(self) -> None:
        """Free the renderer; it cannot draw any more."""
        if self._context is not None:
            with self._gl.as_current():
                self._context.free()
            self._context = None
        if self._gl is not None:
            self._gl.free()
            self._gl = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        self.close()

    def _draw(self) -> None:
        self._gl.make_current()
        mujoco.mjr_render(self._area, self.scene, self._context)

    def _repeat_textures(self) -> None:
        """Scale the textures of coarse floors to the size that MuJoCo draws."""
        for geom in self.scene.geoms[: self.scene.ngeom]:
            if geom.type == PLANE and geom.objid in self._floors:
                geom.texrepeat[:] *= self._floors[geom.objid][:2]


def coarse_floors(model: mujoco.MjModel) -> dict[int, Array]:
    """Return the size (3,) of the finite plane drawn for each infinite one, by geom.

    The plane reaches beyond the horizon and its middle is a corner of the texture. Its
    size has half sides and half a piece's, m, as in MJCF. MuJoCo spans a finite plane
    by its texture, and an infinite one every 2 m: half sides are factors on repeats.
    """
    infinite = (model.geom_type == PLANE) & (model.geom_size[:, :2] <= 0.0).all(1)
    far = 1.1 * float(model.vis.map.zfar) * float(model.stat.extent)
    floors = {}
    for geom in np.flatnonzero(infinite).tolist():
        material = int(model.geom_matid[geom])
        repeat = np.ones(2) if material < 0 else model.mat_texrepeat[material]
        period = 4.0 / np.where(repeat > 0.0, repeat, 1.0)  # m; half a plane holds n
        half = np.ceil(far / period) * period
        floors[geom] = np.append(half, half.max() / PIECES)
    return floors


def outside(
    model: mujoco.MjModel, data: mujoco.MjData, camera: int, aspect: float
) -> Indices:
    """Return geoms (n,) outside of a camera's picture, by their bounding spheres.

    Cameras with optics besides a field of view give none. `aspect` is the width of the
    picture over its height.
    """
    if model.cam_projection[camera] or model.cam_sensorsize[camera].any():
        return np.empty(0, dtype=np.int64)
    centers, half = np.split(model.geom_aabb, 2, axis=1)
    R_wg = data.geom_xmat.reshape(-1, 3, 3)
    at = data.geom_xpos + np.einsum("gij,gj->gi", R_wg, centers)
    x, y, z = ((at - data.cam_xpos[camera]) @ data.cam_xmat[camera].reshape(3, 3)).T
    radii = np.sqrt(np.einsum("gi,gi->g", half, half))
    inside = z < radii
    angle = 0.5 * np.radians(model.cam_fovy[camera])
    for across, half_angle in ((y, angle), (x, np.arctan(aspect * np.tan(angle)))):
        beside = np.abs(across) * np.cos(half_angle) + z * np.sin(half_angle)
        inside &= beside < radii  # m, outside of the two planes through the camera
    return np.flatnonzero(~inside)


@contextmanager
def _settings_of(
    model: mujoco.MjModel,
    preset: RenderPreset,
    floors: dict[int, Array],
    picture: tuple[int, int],
) -> Iterator[None]:
    """Write settings into the model, where a new context reads them once."""
    screen, quality = model.vis.global_, model.vis.quality
    wanted = [(screen, "offwidth", picture[0]), (screen, "offheight", picture[1])]
    values = zip(QUALITY_FIELDS, QUALITIES[preset], strict=True)
    wanted += [(quality, name, value) for name, value in values]
    kept = [(part, name, getattr(part, name)) for part, name, _ in wanted]
    sizes = model.geom_size.copy()
    try:
        for setting in wanted:
            setattr(*setting)
        for plane, size in floors.items():
            model.geom_size[plane] = size
        yield
    finally:
        model.geom_size[:] = sizes
        for setting in kept:
            setattr(*setting)
