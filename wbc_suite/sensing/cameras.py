"""Cameras of a scene: pictures, depths, segmentations, projections."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium
import mujoco
import numpy as np
from numpy.typing import NDArray

from wbc_suite.control import RobotState
from wbc_suite.sensing.projection import Projection, camera_id
from wbc_suite.sensing.renderer import Renderer, RenderPreset, make_renderer
from wbc_suite.sensing.segmentation import Labels, SegmentationLevel
from wbc_suite.typing import Array

Picture = NDArray[Any]


@dataclass(frozen=True, kw_only=True, slots=True)
class CameraRequest:
    """An observed camera; its name starts the keys, sizes are in pixels."""

    name: str
    width: int
    height: int
    depth: bool = False
    segmentations: tuple[SegmentationLevel, ...] = ()

    def segmentation_key(self, level: SegmentationLevel) -> str:
        """Return the key of a segmentation; with several levels it names the level."""
        several = len(self.segmentations) > 1
        return f"{self.name}_segmentation" + (f"_{level}" if several else "")


class Cameras:
    """Takes pictures of a simulation; for `preset` see `make_renderer`.

    Renderers are made when they are first used, one for each size of picture, and
    belong to the first thread that draws. Row 0 of a picture is its upper edge.

    Attributes:
        labels: Numbers of segmentations, and their names.
        space: Spaces of the observed pictures, by key.

    Raises:
        UnknownNameError: If there is no such camera.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        robots: Sequence[RobotState],
        requests: Sequence[CameraRequest] = (),
        *,
        preset: RenderPreset | str | None = None,
    ) -> None:
        self._model, self._data, self._preset = model, data, preset
        self.labels = Labels(model, robots)
        self._requests = tuple(requests)
        self._renderers: dict[tuple[int, int], Renderer] = {}
        self._stale: set[tuple[int, int]] = set()
        self.space: dict[str, gymnasium.Space[Any]] = {}
        for request in self._requests:
            camera_id(model, request.name)  # an error if there is no such camera
            self.space |= self._spaces(request)

    @property
    def far(self) -> float:
        """Depth of the background, m: the far clipping plane."""
        return float(np.float32(self._model.vis.map.zfar * self._model.stat.extent))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all cameras of the scene."""
        return tuple(self._model.camera(i).name for i in range(self._model.ncam))

    def observation(self) -> dict[str, Picture]:
        """Return the observed pictures, by key."""
        pictures: dict[str, Picture] = {}
        for request in self._requests:
            renderer = self._aim(request.name, request.width, request.height)
            pictures[f"{request.name}_image"] = renderer.render()
            if request.depth or request.segmentations:
                renderer.draw_surfaces()
            if request.depth:
                pictures[f"{request.name}_depth"] = self._read_depth(renderer)
            for level in request.segmentations:
                key = request.segmentation_key(level)
                pictures[key] = self._read_labels(renderer, level)
        return pictures

    def black(self) -> dict[str, Picture]:
        """Return black pictures in place of the observed ones, by key."""
        return {k: np.zeros(s.shape or (), s.dtype) for k, s in self.space.items()}

    def image(self, camera: str, *, width: int, height: int) -> NDArray[np.uint8]:
        """Return a picture, RGB, shape (height, width, 3)."""
        return self._aim(camera, width, height).render()

    def depth(self, camera: str, *, width: int, height: int) -> NDArray[np.float32]:
        """Return distances along the camera's axis, m, shape (height, width, 1)."""
        renderer = self._aim(camera, width, height)
        renderer.draw_surfaces()
        return self._read_depth(renderer)

    def segmentation(
        self, camera: str, *, width: int, height: int, level: SegmentationLevel | str
    ) -> NDArray[np.int32]:
        """Return numbers of `labels`, background 0, shape (height, width, 1)."""
        renderer = self._aim(camera, width, height)
        renderer.draw_surfaces()
        return self._read_labels(renderer, SegmentationLevel(level))

    def projection(self, camera: str, *, width: int, height: int) -> Projection:
        """Return intrinsics and extrinsics of a camera."""
        index = camera_id(self._model, camera)
        return Projection.of(self._model, self._data, index, width=width, height=height)

    def point_cloud(self, camera: str, *, width: int, height: int) -> Array:
        """Return the point of the world at each pixel, m, shape (height, width, 3)."""
        depth = self.depth(camera, width=width, height=height)
        return self.projection(camera, width=width, height=height).point_cloud(depth)

    def normals(self, camera: str, *, width: int, height: int) -> Array:
        """Return surface normals in the world, shape (height, width, 3)."""
        depth = self.depth(camera, width=width, height=height)
        return self.projection(camera, width=width, height=height).normals(depth)

    def upload_textures(self) -> None:
        """Draw next pictures with the present textures of the model."""
        self._stale = set(self._renderers)

    def close(self) -> None:
        """Free the renderers; the next picture makes new ones."""
        while self._renderers:
            self._renderers.popitem()[1].close()

    def _aim(self, camera: str, width: int, height: int) -> Renderer:
        """Return a renderer with the present scene of a camera."""
        index, size = camera_id(self._model, camera), (width, height)
        renderer = self._renderers.get(size)
        if renderer is None:
            renderer = make_renderer(
                self._model, width=width, height=height, preset=self._preset
            )
            self._renderers[size] = renderer
        elif size in self._stale:
            renderer.upload_textures()
        self._stale.discard(size)
        mujoco.mj_camlight(self._model, self._data)  # otherwise one physics step behind
        renderer.update_scene(self._data, camera=index)
        return renderer

    def _read_labels(
        self, renderer: Renderer, level: SegmentationLevel
    ) -> NDArray[np.int32]:
        return renderer.read_geoms(self.labels.numbers[level])[..., None]

    def _read_depth(self, renderer: Renderer) -> NDArray[np.float32]:
        depth = renderer.read_depth()
        return np.minimum(depth, np.float32(self.far), out=depth)[..., None]

    def _spaces(self, request: CameraRequest) -> dict[str, gymnasium.Space[Any]]:
        box, size = gymnasium.spaces.Box, (request.height, request.width)
        spaces: dict[str, gymnasium.Space[Any]] = {
            f"{request.name}_image": box(0, 255, (*size, 3), np.uint8)
        }
        if request.depth:
            spaces[f"{request.name}_depth"] = box(0, self.far, (*size, 1), np.float32)
        for level in request.segmentations:
            key, most = (
                request.segmentation_key(level),
                self.labels.numbers[level].max(),
            )
            spaces[key] = box(0, most, (*size, 1), np.int32)
        return spaces
