"""The page of render mode `human`: a scene in the browser."""

import mujoco

from wbc_suite import logs
from wbc_suite.typing import Matrix
from wbc_suite.viewers.model_scene import ModelScene
from wbc_suite.viewers.page_server import PageServer
from wbc_suite.viewers.scene_setup import set_camera, set_up_scene

log = logs.logger(__name__)


class WatchPage:
    """Serve a scene on this machine; its address is logged."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.site = PageServer()
        set_up_scene(self.site, label="wbc_suite")
        self._scene = ModelScene(self.site.server, model)
        middle, reach = model.stat.center, 0.5 * model.stat.extent
        set_camera(self.site.server, (middle - reach, middle + reach))
        log.warning("View the scene at %s", self.site.url)

    def show(self, positions: Matrix, quaternions: Matrix) -> None:
        """Display bodies at their poses in the world; see `ModelScene.update`."""
        self._scene.update(positions, quaternions)

    def stop(self) -> None:
        """Close the page."""
        self.site.stop()
