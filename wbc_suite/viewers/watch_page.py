"""The page of render mode `human`: a scene in the browser, to be watched."""

import logging

import mujoco

from wbc_suite.typing import Matrix
from wbc_suite.viewers.scene_mirror import SceneMirror
from wbc_suite.viewers.site import Site
from wbc_suite.viewers.stage import set_camera, set_stage

__all__ = ["WatchPage"]

log = logging.getLogger(__name__)


class WatchPage:
    """Serve a scene on this machine; its address goes to the log.

    Args:
        model: The scene.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self.site = Site()
        set_stage(self.site.server, label="wbc_suite")
        self._mirror = SceneMirror(self.site.server, model)
        middle, reach = model.stat.center, 0.5 * model.stat.extent
        set_camera(self.site.server, middle - reach, middle + reach)
        log.warning("watch at %s", self.site.url)

    def show(self, positions: Matrix, quaternions: Matrix) -> None:
        """Show bodies at their poses in the world; see `SceneMirror.update`."""
        self._mirror.update(positions, quaternions)

    def stop(self) -> None:
        """Close the page."""
        self.site.stop()
