"""What a robot's page shows on demand: frames, shapes, centre of mass, inertia."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from wbc_suite.typing import Vector
from wbc_suite.viewers.scene_mirror import SceneMirror

if TYPE_CHECKING:
    import viser

__all__ = ["Overlays", "equivalent_box"]

COM_COLOUR, INERTIA_COLOUR = (214, 72, 60), (90, 140, 210)
FRAME_SIZE = 0.07  # m
LEAST_HALF = 1e-3  # m; thinner inertia boxes could not be seen


class Overlays:
    """Toggles for what lies under a robot's skin, and what they show.

    Args:
        server: Server whose page is drawn on.
        model: Model of the robot.
        data: Its state, which `update` reads.
        mirror: The robot as it is drawn.
    """

    def __init__(
        self,
        server: "viser.ViserServer",
        model: mujoco.MjModel,
        data: mujoco.MjData,
        mirror: SceneMirror,
    ) -> None:
        self._model, self._data = model, data
        self._frames = [
            server.scene.add_frame(
                f"{mirror.node(body)}/{label}",
                axes_length=FRAME_SIZE,
                axes_radius=0.035 * FRAME_SIZE,
                origin_radius=0.07 * FRAME_SIZE,
                wxyz=wxyz,
                position=position,
                visible=False,
            )
            for body, label, position, wxyz in _places(model)
        ]
        self._inertias = [
            _inertia_box(server, model, body, mirror.node(body))
            for body in range(1, model.nbody)
            if model.body_mass[body] > 0
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
            self._toggle(server, "Visual shapes", mirror.visual_shapes, shown=True)
            self._toggle(server, "Collision shapes", mirror.collision_shapes)
            self._toggle(server, "Frames", self._frames)
            self._toggle(server, "Centre of mass", [self._com, self._plumb])
            self._toggle(server, "Inertia", self._inertias)

    def update(self) -> None:
        """Move the centre of mass to where the posture puts it."""
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

    For a box of half sizes a: I_x = m (a_y^2 + a_z^2) / 3, and so on around; so
    a_x^2 = 3 (I_y + I_z - I_x) / (2 m).

    Args:
        mass: Mass in kg.
        inertia: Principal moments of inertia, shape (3,), in kg m^2.

    Returns:
        Half sizes, shape (3,), in m.
    """
    squares = 1.5 * (inertia.sum() - 2.0 * inertia) / mass
    return np.maximum(np.sqrt(np.maximum(squares, 0.0)), LEAST_HALF)


def _inertia_box(
    server: "viser.ViserServer", model: mujoco.MjModel, body: int, node: str
) -> "viser.BoxHandle":
    half = equivalent_box(model.body_mass[body], model.body_inertia[body])
    return server.scene.add_box(
        f"{node}/inertia",
        dimensions=tuple(2.0 * half),
        color=INERTIA_COLOUR,
        opacity=0.45,
        cast_shadow=False,
        wxyz=model.body_iquat[body],
        position=model.body_ipos[body],
        visible=False,
    )


def _places(model: mujoco.MjModel) -> list[tuple[int, str, Vector, Vector]]:
    """Return body, label, position and quaternion of every link's and site's frame."""
    here: Vector = np.zeros(3)
    upright: Vector = np.array([1.0, 0.0, 0.0, 0.0])
    places: list[tuple[int, str, Vector, Vector]] = [
        (body, "frame", here, upright) for body in range(1, model.nbody)
    ]
    for site in range(model.nsite):
        body, label = int(model.site_bodyid[site]), f"frame_{model.site(site).name}"
        places.append((body, label, model.site_pos[site], model.site_quat[site]))
    return places
