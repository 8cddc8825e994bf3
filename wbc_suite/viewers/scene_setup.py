"""Floor, light, camera, theme and colours of every page."""

import colorsys
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import pinocchio as pin

from wbc_suite.typing import Vector

if TYPE_CHECKING:
    import viser
    import viser.uplot

    from wbc_suite.viewers.page_server import PageServer

Colour: TypeAlias = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""
Box: TypeAlias = tuple[Vector, Vector]
"""Corners with the smallest and the largest coordinates, m."""

FIELD_OF_VIEW = np.deg2rad(42.0)  # vertical, or horizontal where that is less
LEAST_ASPECT = 0.4  # width over height of a scene; at less, it is cut off
VIEWS = {
    "Front": np.array([1.0, -0.62, 0.5]),
    "Left": np.array([0.1, 1.0, 0.25]),
    "Back": np.array([-1.0, -0.35, 0.6]),
    "Top": np.array([-0.15, 0.0, 1.0]),
}
"""Direction from the robot, which faces x, to the camera."""
BRAND = (38, 98, 132)  # red, green, blue, 0 to 255

# Right is warm, left is cool, the middle of the body is green and violet.
_BY_WORD: tuple[tuple[tuple[str, ...], Colour], ...] = (
    (("right", "foot"), (196, 92, 60)),
    (("left", "foot"), (52, 104, 178)),
    (("right",), (235, 131, 45)),
    (("left",), (20, 152, 168)),
    (("head",), (138, 102, 190)),
    (("torso",), (88, 148, 88)),
    (("com",), (88, 148, 88)),
    (("base",), (94, 106, 126)),
    (("hand",), (235, 131, 45)),
    (("gripper",), (235, 131, 45)),
)


def set_up_scene(site: "PageServer", *, label: str) -> None:
    """Add the floor and the lights, and set theme and title of the page."""
    server, site.title = site.server, label
    set_theme(server.gui)
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
    _light(server.scene)


def _light(scene: "viser.SceneApi", *, dark: bool = False) -> None:
    scene.configure_environment_map(
        "studio",
        background=True,
        background_blurriness=1.0,
        background_intensity=0.06 if dark else 0.65,
        environment_intensity=0.3,
    )


def set_theme(gui: "viser.GuiApi", *, dark: bool = False) -> None:
    """Set the colours of the panel, for all clients or for one."""
    gui.configure_theme(
        show_logo=False, show_share_button=False, brand_color=BRAND, dark_mode=dark
    )


def set_dark(client: "viser.ClientHandle", dark: bool) -> None:
    """Set dark or light colours of panel and background for one client."""
    set_theme(client.gui, dark=dark)
    _light(client.scene, dark=dark)


def set_camera(server: "viser.ViserServer", box: Box) -> None:
    """Point the cameras of new clients at a box, from its front right and above.

    Its two corners have the smallest and the largest coordinates, shape (3,), m.
    """
    position, look_at = _camera(box, VIEWS["Front"])
    server.initial_camera.position = tuple(position)
    server.initial_camera.look_at = tuple(look_at)
    server.initial_camera.fov = FIELD_OF_VIEW

    @server.on_client_connect
    def _(client: "viser.ClientHandle") -> None:
        _widen(client.camera)
        client.camera.on_update(_widen)


def _widen(camera: "viser.CameraHandle") -> None:
    """Set the field of view so that a box is seen whole in a tall window too."""
    aspect = camera.image_width / max(camera.image_height, 1)
    tangent = np.tan(FIELD_OF_VIEW / 2.0) / np.clip(aspect, LEAST_ASPECT, 1.0)
    if abs(camera.fov - (fov := 2.0 * float(np.arctan(tangent)))) > 1e-3:
        camera.fov = fov


def add_views(client: "viser.ClientHandle", box: Callable[[], Box]) -> None:
    """Add buttons that point one client's camera at a box, each from a direction."""
    buttons = client.gui.add_button_group("View from", tuple(VIEWS))

    @buttons.on_click
    def _(_: object) -> None:
        position, look_at = _camera(box(), VIEWS[buttons.value])
        with client.atomic():
            client.camera.position = position
            client.camera.look_at = look_at


def _camera(box: Box, direction: Vector) -> tuple[Vector, Vector]:
    """Return the position of the camera and the point that it looks at."""
    low, high = box
    middle = (low + high) / 2.0
    distance = 1.3 * max(float(np.linalg.norm(high - low)), 0.8)
    return middle + distance * direction / np.linalg.norm(direction), middle


def add_plot(
    gui: "viser.GuiApi", title: str, curves: Mapping[str, str], **options: Any
) -> "viser.GuiUplotHandle":
    """Add a plot over the time in s, without data.

    `curves` is the colour of each curve in CSS notation, by its label; for `options`
    see viser's `add_uplot`.
    """
    axis = {"x": {"time": False}}  # else seconds are shown as dates
    settings = {"scales": axis, "legend": {"show": False}, "height": 150} | options
    return gui.add_uplot(
        data=tuple(np.zeros(2) for _ in range(1 + len(curves))),
        series=plot_series(curves),
        title=title,
        **settings,
    )


def plot_series(
    curves: Mapping[str, str], shown: Sequence[bool] | None = None
) -> "tuple[viser.uplot.Series, ...]":
    """Return the curves of a plot; those that are not shown are hidden."""
    lines = zip(curves.items(), shown or [True] * len(curves), strict=True)
    return (
        {"label": "s"},
        *(
            {"label": label, "stroke": colour, "width": 2, "show": visible}
            for (label, colour), visible in lines
        ),
    )


def marked(labels: Iterable[str], chosen: str) -> tuple[str, ...]:
    """Return the labels of a button group with the chosen one marked."""
    return tuple(f"• {x} •" if x == chosen else str(x) for x in labels)


def unmarked(label: str) -> str:
    """Return a label without its mark."""
    return label.strip("• ")


def place(node: "viser.SceneNodeHandle", T_world_node: pin.SE3) -> None:
    """Set the pose of a scene node whose parent is the world."""
    position_xyzw = pin.SE3ToXYZQUAT(T_world_node)
    node.position = position_xyzw[:3]
    node.wxyz = np.roll(position_xyzw[3:], 1)


def limb_colours(names: Iterable[str]) -> MappingProxyType[str, Colour]:
    """Return a different colour for every limb, the same in all parts of the page."""
    colours: dict[str, Colour] = {}
    for name in names:
        known = (c for words, c in _BY_WORD if all(w in name for w in words))
        colour = next((c for c in known if c not in colours.values()), None)
        if colour is None:  # a muted one; the golden ratio separates neighbours
            hue = (0.11 + 0.618 * len(colours)) % 1.0
            r, g, b = colorsys.hls_to_rgb(hue, 0.48, 0.45)
            colour = round(255 * r), round(255 * g), round(255 * b)
        colours[name] = colour
    return MappingProxyType(colours)


def css(colour: Colour) -> str:
    """Return a colour in CSS notation."""
    return f"#{colour[0]:02x}{colour[1]:02x}{colour[2]:02x}"
