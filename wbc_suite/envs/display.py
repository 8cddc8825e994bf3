"""The display of `render`: a picture, a depth picture, or a page in the browser."""

import importlib
import time
from typing import Any, Literal, TypeAlias

from wbc_suite.envs.simulation import Simulation
from wbc_suite.errors import ConfigError
from wbc_suite.sensing.cameras import Cameras

__all__ = ["Display", "RenderMode"]

RenderMode: TypeAlias = Literal["human", "rgb_array", "depth_array"]

WATCH_PAGE = "wbc_suite.viewers.watch_page"
"""Imported when needed: `viewers` is a layer above `envs`."""


class Display:
    """Shows a simulation in one render mode.

    Args:
        mode: `human` serves a page and keeps to real time; the others return arrays.
        simulation: What is shown.
        cameras: Cameras of the scene.
        camera: Name of the one that pictures come from.
        size: Width and height of a picture, pixels.
        period: Time between two frames, s.
    """

    def __init__(
        self,
        mode: RenderMode | None,
        simulation: Simulation,
        cameras: Cameras,
        *,
        camera: str,
        size: tuple[int, int],
        period: float,
    ) -> None:
        self.mode, self._simulation, self._cameras = mode, simulation, cameras
        self._camera, self._size, self._period = camera, size, period
        self._page: Any = None
        self._due = 0.0

    def render(self) -> Any:
        """Return a picture, or None in mode `human`.

        `rgb_array`: shape (height, width, 3), uint8. `depth_array`: shape (height,
        width), float32, m along the camera's axis.

        Raises:
            ConfigError: If there is no render mode.
        """
        width, height = self._size
        if self.mode == "human":
            return self._show()
        if self.mode == "rgb_array":
            return self._cameras.image(self._camera, width=width, height=height)
        if self.mode == "depth_array":
            depth = self._cameras.depth(self._camera, width=width, height=height)
            return depth[..., 0]
        raise ConfigError("render: make the environment with render_mode.")

    def close(self) -> None:
        """Close the page."""
        if self._page is not None:
            self._page.stop()
            self._page = None

    def _show(self) -> None:
        if self._page is None:
            self._page = importlib.import_module(WATCH_PAGE).WatchPage(
                self._simulation.model
            )
        data = self._simulation.data
        self._page.show(data.xpos, data.xquat)
        time.sleep(min(max(self._due - time.monotonic(), 0.0), self._period))
        self._due = time.monotonic() + self._period
