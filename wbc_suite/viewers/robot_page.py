"""The page of `wbc-suite view`: one robot with joint sliders and overlays."""

import threading
from collections.abc import Sequence
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Vector
from wbc_suite.viewers.model_scene import ModelScene, robot_box
from wbc_suite.viewers.page_server import PageServer
from wbc_suite.viewers.scene_setup import set_camera, set_up_scene
from wbc_suite.viewers.session_state import plain

if TYPE_CHECKING:
    import viser

SLIDER_STEP = 0.01  # rad or m
UNBOUNDED = np.pi  # rad, range of a slider of a joint without limits
COM_COLOUR, INERTIA_COLOUR = (214, 72, 60), (90, 140, 210)
FRAME_SIZE = 0.07  # m
ORIGIN, IDENTITY = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
LEAST_HALF = 1e-3  # m; thinner boxes of inertia would not be visible


class RobotPage:
    """Serve a page that displays one robot in the posture of its sliders.

    It ends when `site`, its server, is stopped.
    """

    def __init__(self, robot: RobotDescription, site: PageServer) -> None:
        self.robot, self.site = robot, site
        self.model = robot.to_mjspec().compile()
        self.data = mujoco.MjData(self.model)
        self._lock = threading.Lock()
        self._followers: dict[int, viser.FrameHandle] = {}
        self._sliders: dict[str, viser.GuiSliderHandle[float]] = {}
        set_up_scene(site, label=f"wbc_suite · {robot.name}")
        self.scene = ModelScene(site.server, self.model)
        site.server.gui.add_markdown(
            f"**{robot.title or robot.name}**  \n"
            f"{robot.dof} joints, {robot.weight_text}, {robot.root.kind} root"
        )
        names = {**{name: name for name in robot.keyframes}, "zero": None}
        postures = site.server.gui.add_button_group("Posture", tuple(names))
        postures.on_click(lambda _: self.set_keyframe(names[postures.value]))
        self._overlays = Overlays(site.server, self.model, self.data, self.scene)
        self._add_joints()
        self.set_keyframe(next(iter(robot.keyframes), None))
        set_camera(site.server, robot_box(self.model, self.data))

    def set_keyframe(self, name: str | None) -> None:
        """Set a keyframe by its name; None sets every joint to zero."""
        values = dict.fromkeys(self.robot.joint_names, 0.0)
        if name is not None:
            values = self.robot.keyframe(name)
        for joint, slider in self._sliders.items():
            slider.value = float(np.clip(values[joint], slider.min, slider.max))
        self.set_joints(values)

    def set_joints(self, values: dict[str, float]) -> None:
        """Set joint positions, rad or m, and those of joints that mimic them."""
        with self._lock:
            for name, value in values.items():
                self.data.joint(name).qpos[0] = value
            for joint in self.robot.joints:
                if joint.mimic is not None:
                    leader = self.position(joint.mimic.joint)
                    value = joint.mimic.ratio * leader + joint.mimic.offset
                    self.data.joint(joint.name).qpos[0] = value
            mujoco.mj_kinematics(self.model, self.data)
            mujoco.mj_comPos(self.model, self.data)
            self.scene.update(self.data.xpos, self.data.xquat)
            self._overlays.update()
            for body, node in self._followers.items():
                node.position, node.wxyz = self.data.xpos[body], self.data.xquat[body]

    def follow(self, link: str) -> str:
        """Return the name of a scene node that stays at a link.

        It is short, as those of handles have to be.
        """
        body = self.model.body(link).id
        node = self.site.server.scene.add_frame(f"/link{body}", show_axes=False)
        node.position, node.wxyz = self.data.xpos[body], self.data.xquat[body]
        self._followers[body] = node
        return node.name

    def position(self, joint: str) -> float:
        """Return the position of a joint, rad or m."""
        return float(self.data.joint(joint).qpos[0])

    def _add_joints(self) -> None:
        followers = {j.name for j in self.robot.joints if j.mimic is not None}
        for group, joints in self.robot.groups.items():
            if own := [name for name in joints if name not in followers]:
                with self.site.server.gui.add_folder(
                    plain(group).capitalize(), expand_by_default="arm" in group
                ):
                    for name in own:
                        self._add_joint(name, group)

    def _add_joint(self, name: str, group: str) -> None:
        joint, low, high = self.model.joint(name), -UNBOUNDED, UNBOUNDED
        if joint.limited[0]:
            low, high = joint.range.tolist()
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
        async def _(event: "viser.GuiEvent[viser.GuiSliderHandle[float]]") -> None:
            if event.client is not None:  # moved by the user
                self.set_joints({name: slider.value})


class Overlays:
    """Checkboxes that show shapes, frames, centre of mass and inertia of a scene."""

    def __init__(
        self,
        server: "viser.ViserServer",
        model: mujoco.MjModel,
        data: mujoco.MjData,
        scene: ModelScene,
    ) -> None:
        self._model, self._data = model, data
        places = [(f"{link}/frame", IDENTITY, ORIGIN) for link in scene.nodes[1:]]
        for site in range(model.nsite):
            link, name = scene.nodes[model.site_bodyid[site]], model.site(site).name
            place = model.site_quat[site], model.site_pos[site]
            places.append((f"{link}/frame_{name}", *place))
        self._frames = [
            server.scene.add_frame(
                node,
                axes_length=FRAME_SIZE,
                axes_radius=0.035 * FRAME_SIZE,
                origin_radius=0.07 * FRAME_SIZE,
                wxyz=wxyz,
                position=position,
                visible=False,
            )
            for node, wxyz, position in places
        ]
        self._inertias = [
            server.scene.add_box(
                f"{scene.nodes[body]}/inertia",
                dimensions=tuple(2.0 * equivalent_box(mass, model.body_inertia[body])),
                color=INERTIA_COLOUR,
                opacity=0.45,
                cast_shadow=False,
                wxyz=model.body_iquat[body],
                position=model.body_ipos[body],
                visible=False,
            )
            for body, mass in enumerate(model.body_mass)
            if body > 0 and mass > 0
        ]
        self._com = server.scene.add_icosphere(
            "/com", radius=0.03, color=COM_COLOUR, visible=False
        )
        self._plumb = server.scene.add_line_segments(
            "/com_plumb",
            np.zeros((1, 2, 3), dtype=np.float32),
            colors=COM_COLOUR,
            thickness=0.006,
            visible=False,
        )
        with server.gui.add_folder("Show"):
            self._toggle(server, "Visual shapes", scene.visual_shapes, shown=True)
            self._toggle(server, "Collision shapes", scene.collision_shapes)
            self._toggle(server, "Frames", self._frames)
            self._toggle(server, "Centre of mass", [self._com, self._plumb])
            self._toggle(server, "Inertia", self._inertias)

    def update(self) -> None:
        """Move the centre of mass to that of the current posture."""
        com = self._data.subtree_com[0].copy()
        self._com.position = com
        self._plumb.points = np.array([[com, [com[0], com[1], 0.0]]], dtype=np.float32)

    def _toggle(
        self,
        server: "viser.ViserServer",
        label: str,
        nodes: "Sequence[viser.SceneNodeHandle]",
        *,
        shown: bool = False,
    ) -> None:
        box = server.gui.add_checkbox(label, initial_value=shown)

        @box.on_update
        def _(_: object) -> None:
            with server.atomic():
                for node in nodes:
                    node.visible = box.value


def equivalent_box(mass: float, inertia: Vector) -> Vector:
    """Return the half sizes of the solid box that has these principal inertias.

    For a box of half sizes a, m, shape (3,): I_x = m (a_y^2 + a_z^2) / 3, and so on
    around; so a_x^2 = 3 (I_y + I_z - I_x) / (2 m). The mass is in kg, the inertia in
    kg m^2, shape (3,).
    """
    squares = 1.5 * (inertia.sum() - 2.0 * inertia) / mass
    return np.maximum(np.sqrt(np.maximum(squares, 0.0)), LEAST_HALF)
