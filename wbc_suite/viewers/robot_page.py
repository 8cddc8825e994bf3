"""The view page: a robot at rest, with its joints to turn and its insides to see."""

import threading
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Vector
from wbc_suite.viewers.overlays import Overlays
from wbc_suite.viewers.scene_mirror import SceneMirror, robot_box
from wbc_suite.viewers.site import Site
from wbc_suite.viewers.stage import set_camera, set_stage
from wbc_suite.viewers.words import plain

if TYPE_CHECKING:
    import viser

__all__ = ["RobotPage"]

SLIDER_STEP = 0.01  # rad or m
UNBOUNDED = np.pi  # rad; how far a slider of a joint without limits goes


class RobotPage:
    """Serve a page that shows one robot, still, in a posture that people set.

    Args:
        robot: Robot to show.
        site: Where the page is served; the page closes it when it stops.
    """

    def __init__(self, robot: RobotDescription, site: Site) -> None:
        self.robot, self.site = robot, site
        self.model = robot.to_mjspec().compile()
        self.data = mujoco.MjData(self.model)
        self._lock = threading.Lock()
        self._sliders: dict[str, viser.GuiSliderHandle[float]] = {}
        self._setting = False
        set_stage(site.server, label=f"wbc_suite · {robot.name}")
        self.mirror = SceneMirror(site.server, self.model)
        self._add_facts()
        self._add_postures()
        self._overlays = Overlays(site.server, self.model, self.data, self.mirror)
        self._add_joints()
        self.set_keyframe(next(iter(robot.keyframes), None))
        set_camera(site.server, *robot_box(self.model, self.data.xpos, self.data.xquat))

    def stop(self) -> None:
        """Close the page."""
        self.site.stop()

    def set_keyframe(self, name: str | None) -> None:
        """Take a posture by its name; None puts every joint at zero."""
        values = dict.fromkeys(self.robot.joint_names, 0.0)
        if name is not None:
            values = self.robot.keyframe(name)
        self._setting = True  # sliders then move without moving joints one by one
        for joint, slider in self._sliders.items():
            slider.value = float(np.clip(values[joint], slider.min, slider.max))
        self._setting = False
        self.set_joints(values)

    def set_joints(self, values: dict[str, float]) -> None:
        """Put joints at positions, in rad or m; joints that follow them follow."""
        with self._lock:
            for name, value in values.items():
                self.data.qpos[self.model.joint(name).qposadr[0]] = value
            self._couple()
            mujoco.mj_kinematics(self.model, self.data)
            mujoco.mj_comPos(self.model, self.data)
            self.mirror.update(self.data.xpos, self.data.xquat)
            self._overlays.update()

    def position(self, joint: str) -> float:
        """Return where a joint is now, in rad or m."""
        return float(self.data.qpos[self.model.joint(joint).qposadr[0]])

    def _couple(self) -> None:
        for joint in self.robot.joints:
            if joint.mimic is not None:
                leader = self.position(joint.mimic.joint)
                value = joint.mimic.ratio * leader + joint.mimic.offset
                self.data.qpos[self.model.joint(joint.name).qposadr[0]] = value

    def _add_facts(self) -> None:
        robot = self.robot
        self.site.server.gui.add_markdown(
            f"**{robot.title or robot.name}**  \n"
            f"{robot.dof} joints, {robot.mass:.1f} kg, {robot.root.kind} root"
        )

    def _add_postures(self) -> None:
        postures = self.site.server.gui.add_button_group(
            "Posture", (*self.robot.keyframes, "zero")
        )
        postures.on_click(
            lambda _: self.set_keyframe(
                None if postures.value == "zero" else postures.value
            )
        )

    def _add_joints(self) -> None:
        followers = {j.name for j in self.robot.joints if j.mimic is not None}
        for group, joints in self.robot.groups.items():
            own = [name for name in joints if name not in followers]
            if not own:
                continue
            folder = self.site.server.gui.add_folder(
                plain(group).capitalize(), expand_by_default="arm" in group
            )
            with folder:
                for name in own:
                    self._add_joint(name, group)

    def _add_joint(self, name: str, group: str) -> None:
        low, high = _range(self.model, name)
        side = group.split("_")[0] + "_"
        slider = self.site.server.gui.add_slider(
            plain(name.removeprefix(side)),
            min=low,
            max=high,
            step=SLIDER_STEP,
            initial_value=float(np.clip(0.0, low, high)),
            hint=f"{name}, {low:.2f} to {high:.2f}",
        )
        self._sliders[name] = slider

        @slider.on_update
        async def _(_: object) -> None:
            if not self._setting:
                self.set_joints({name: slider.value})


def _range(model: mujoco.MjModel, name: str) -> Vector:
    joint = model.joint(name)
    if not joint.limited[0]:
        return np.array([-UNBOUNDED, UNBOUNDED])
    return np.array(joint.range, dtype=np.float64)
