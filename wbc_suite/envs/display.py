"""The display of `render`: a picture, a depth picture, or a page in the browser."""

import importlib
import time
from typing import Any

from wbc_suite.envs.config import EnvConfig
from wbc_suite.envs.simulation import Simulation
from wbc_suite.errors import ConfigError
from wbc_suite.sensing.cameras import Cameras

WATCH_PAGE = "wbc_suite.viewers.watch_page"
"""Imported when needed: `viewers` is a layer above `envs`."""


class Display:
    """Shows a simulation in one render mode.

    Mode `human` serves a page and keeps to real time, the others return arrays.
    """

    def __init__(
        self, simulation: Simulation, cameras: Cameras, config: EnvConfig
    ) -> None:
        self._simulation, self._cameras, self._config = simulation, cameras, config
        self._page: Any = None
        self._due = 0.0

    def render(self) -> Any:
        """Return a picture, or None in mode `human`.

        `rgb_array`: shape (height, width, 3), uint8. `depth_array`: shape (height,
        width), float32, m along the camera's axis.

        Raises:
            ConfigError: If there is no render mode.
        """
        mode, camera = self._config.render_mode, self._config.render_camera
        width, height = self._config.render_size
        if mode == "human":
            return self._show()
        if mode == "rgb_array":
            return self._cameras.image(camera, width=width, height=height)
        if mode == "depth_array":
            return self._cameras.depth(camera, width=width, height=height)[..., 0]
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
        period = 1.0 / self._config.control_freq
        time.sleep(min(max(self._due - time.monotonic(), 0.0), period))
        self._due = time.monotonic() + period
