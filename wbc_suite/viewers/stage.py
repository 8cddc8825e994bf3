"""Floor, light, camera and theme: what every page of ours has around its robot."""

from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from wbc_suite.typing import Vector

if TYPE_CHECKING:
    import viser

__all__ = ["VIEWS", "look_from", "set_camera", "set_stage"]

FIELD_OF_VIEW = np.deg2rad(42.0)  # vertical
VIEWS = MappingProxyType(
    {
        "Front": np.array([1.0, -0.62, 0.5]),
        "Left": np.array([0.1, 1.0, 0.25]),
        "Behind": np.array([-1.0, -0.35, 0.6]),
        "Above": np.array([-0.15, 0.0, 1.0]),
    }
)
"""From where the robot, which faces x, is looked at."""
BRAND = (38, 98, 132)


def set_stage(server: "viser.ViserServer", *, label: str) -> None:
    """Lay the floor, hang the lights and set the theme."""
    server.gui.configure_theme(
        show_logo=False, show_share_button=False, brand_color=BRAND
    )
    server.gui.set_panel_label(label)
    server.gui.main_panel.dock_right()
    server.scene.world_axes.visible = False
    server.scene.add_grid(
        "/floor",
        infinite_grid=True,
        cell_size=0.25,
        cell_color=(208, 214, 222),
        section_color=(184, 192, 204),
        section_size=1.0,
        fade_distance=14.0,
        fade_strength=2.0,
        shadow_opacity=0.22,
    )
    server.scene.configure_environment_map(
        "studio",
        background=True,
        background_blurriness=1.0,
        background_intensity=0.65,
        environment_intensity=0.3,
    )


def set_camera(server: "viser.ViserServer", low: Vector, high: Vector) -> None:
    """Let new clients look at a box from its front right, a little from above.

    Args:
        server: Server whose new clients start there.
        low: Corner of the box with the smallest coordinates, shape (3,), in m.
        high: The opposite corner.
    """
    position, look_at = _camera(low, high, VIEWS["Front"])
    server.initial_camera.position = tuple(position)
    server.initial_camera.look_at = tuple(look_at)
    server.initial_camera.fov = FIELD_OF_VIEW


def look_from(
    client: "viser.ClientHandle", low: Vector, high: Vector, direction: Vector
) -> None:
    """Move one client's camera to where it sees a box from a direction."""
    position, look_at = _camera(low, high, direction)
    with client.atomic():
        client.camera.position = position
        client.camera.look_at = look_at


def _camera(low: Vector, high: Vector, direction: Vector) -> tuple[Vector, Vector]:
    """Return where the camera is and where it looks."""
    middle = (low + high) / 2.0
    distance = 1.3 * max(float(np.linalg.norm(high - low)), 0.8)
    return middle + distance * direction / np.linalg.norm(direction), middle
