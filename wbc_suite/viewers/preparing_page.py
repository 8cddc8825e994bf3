"""What a page shows while its session is made: the robot, and what is being done."""

from contextlib import suppress

import mujoco

from wbc_suite.errors import WbcError
from wbc_suite.robot import load_robot
from wbc_suite.viewers.model_scene import ModelScene, robot_box
from wbc_suite.viewers.page_server import PageServer
from wbc_suite.viewers.scene_setup import set_camera, set_up_scene


class PreparingPage:
    """Show a robot in its first keyframe until `close`; the server goes on.

    Args:
        site: Server of the page.
        robot: Name or file of the robot; one that cannot be loaded is not shown.
        label: Title of the panel.
    """

    def __init__(self, site: PageServer, robot: str, *, label: str) -> None:
        self.server = site.server
        set_up_scene(site, label=label)
        self._text = site.server.gui.add_markdown("")
        self.show("Building the robot and its scene.")
        with suppress(WbcError):  # the session's own error is reported
            self._add(robot)

    def show(self, text: str) -> None:
        """Say what is being done."""
        self._text.content = f"**Getting ready**  \n{text}"

    def close(self) -> None:
        """Remove everything from the page."""
        self.server.scene.reset()
        self.server.gui.reset()

    def _add(self, robot: str) -> None:
        model = load_robot(robot).to_mjspec().compile()
        data = mujoco.MjData(model)
        if model.nkey:
            mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_kinematics(model, data)
        ModelScene(self.server, model).update(data.xpos, data.xquat)
        set_camera(self.server, robot_box(model, data.xpos, data.xquat))
