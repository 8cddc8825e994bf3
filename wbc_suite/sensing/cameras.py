"""Cameras of a scene: pictures, depths, segmentations, projections."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium
import mujoco
import numpy as np
from numpy.typing import NDArray

from wbc_suite.control import RobotState
from wbc_suite.sensing.change import Change, Channel, Values
from wbc_suite.sensing.projection import Projection, camera_id
from wbc_suite.sensing.renderer import Renderer, RenderPreset, make_renderer
from wbc_suite.sensing.segmentation import Labels, SegmentationLevel
from wbc_suite.typing import Array


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
        observed: Keys of the observed pictures, inactive ones included.
        space: Spaces of the observed pictures, by key; another one after a change.

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
        self._drawn: dict[str, gymnasium.spaces.Box] = {}
        for request in self._requests:
            camera_id(model, request.name)  # an error if there is no such camera
            self._drawn |= self._spaces(request)
        self.observed = tuple(self._drawn)
        self.space: dict[str, gymnasium.Space[Any]] = dict(self._drawn)
        self._channels: dict[str, Channel] = {}
        self._rng = np.random.default_rng(0)

    @property
    def far(self) -> float:
        """Depth of the background, m: the far clipping plane."""
        return float(np.float32(self._model.vis.map.zfar * self._model.stat.extent))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all cameras of the scene."""
        return tuple(self._model.camera(i).name for i in range(self._model.ncam))

    def observation(self) -> dict[str, Values]:
        """Return the observed pictures, by key, with the changes applied."""
        pictures: dict[str, Values] = {}
        for request in self._requests:
            pictures |= self._draw(request)
        time = float(self._data.time)
        for key, channel in self._channels.items():
            if key in pictures:
                pictures[key] = channel.look(pictures[key], time, self._rng)
        return pictures

    def _draw(self, request: CameraRequest) -> dict[str, Values]:
        """Return the active pictures of a camera."""
        image, depth = f"{request.name}_image", f"{request.name}_depth"
        keys = {request.segmentation_key(x): x for x in request.segmentations}
        levels = {key: level for key, level in keys.items() if key in self.space}
        pictures: dict[str, Values] = {}
        if not {image, depth, *levels} & self.space.keys():
            return pictures
        renderer = self._aim(request.name, request.width, request.height)
        if image in self.space:
            pictures[image] = renderer.render()
        if depth in self.space or levels:
            renderer.draw_surfaces()
        if depth in self.space:
            pictures[depth] = self._read_depth(renderer)
        for key, level in levels.items():
            pictures[key] = self._read_labels(renderer, level)
        return pictures

    def change(self, key: str, change: Change | None) -> None:
        """Change an observed picture from now on; None shows it as it is drawn.

        Raises:
            ConfigError: If the crop is larger than the picture; then nothing changes.
        """
        space = {**self.space, key: self._drawn[key]}
        if change is None:
            self._channels.pop(key, None)
        else:
            channel = Channel(change, self._drawn[key], self._model.opt.timestep)
            old = self._channels.get(key)
            if old is not None and old.space == channel.space:
                channel.continue_from(old)
            self._channels[key], space[key] = channel, channel.space
            if not change.active:
                del space[key]
        self.space = {k: space[k] for k in self.observed if k in space}

    def start(self, rng: np.random.Generator) -> None:
        """Start an episode; changes draw from a generator that `rng` spawns."""
        if self._channels:
            self._rng = rng.spawn(1)[0]
        for channel in self._channels.values():
            channel.start()

    def state(self) -> dict[str, Any]:
        """Return the state of changed pictures, as `restore` takes it."""
        channels = {key: channel.state for key, channel in self._channels.items()}
        return {"channels": channels, "rng": self._rng}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a state."""
        self._rng = state["rng"]
        for key, saved in state["channels"].items():
            if key in self._channels:
                self._channels[key].state = saved

    def black(self) -> dict[str, Values]:
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
        """Return the point of the world at each pixel, m, shape (height, width, 3).

        Where the background is seen it is NaN: `np.isfinite(points[..., 0])` is the
        mask of what has a surface.
        """
        depth = self.depth(camera, width=width, height=height)
        projection = self.projection(camera, width=width, height=height)
        return self._seen(projection.point_cloud(depth), depth)

    def normals(self, camera: str, *, width: int, height: int) -> Array:
        """Return surface normals in the world, shape (height, width, 3).

        NaN where the background is seen.
        """
        depth = self.depth(camera, width=width, height=height)
        projection = self.projection(camera, width=width, height=height)
        return self._seen(projection.normals(depth), depth)

    def _seen(self, values: Array, depth: NDArray[np.float32]) -> Array:
        """Return values of pixels, NaN where the depth is that of the background."""
        return np.where(depth < self.far, values, np.nan)

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

    def _spaces(self, request: CameraRequest) -> dict[str, gymnasium.spaces.Box]:
        box, size = gymnasium.spaces.Box, (request.height, request.width)
        spaces: dict[str, gymnasium.spaces.Box] = {
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
