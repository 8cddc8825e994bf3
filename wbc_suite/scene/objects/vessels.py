"""Vessels and lids: walls of boxes, and rings of boxes."""

import math
from dataclasses import replace
from functools import partial

from wbc_suite.robot.shapes import Vector3
from wbc_suite.scene.objects.scene_object import Color, Part, SceneObject

WOOD: Color = (0.80, 0.62, 0.42, 1.0)
ENAMEL: Color = (0.78, 0.22, 0.16, 1.0)
GREEN: Color = (0.25, 0.55, 0.30, 1.0)
BLUE: Color = (0.18, 0.40, 0.70, 1.0)
DARK: Color = (0.16, 0.16, 0.18, 1.0)


def open_bin(
    name: str,
    size: Vector3,
    *,
    wall: float = 0.01,
    color: Color = WOOD,
    material: str = "wood",
) -> SceneObject:
    """Make a bin that is open above; its origin is the middle of its lower face.

    Site: `floor`, the middle of its floor.

    Args:
        name: Its name.
        size: Outer length, width and height, m.
        wall: Thickness of walls and floor, m.
        color: Colour of all parts.
        material: Material of all parts.
    """
    x, y, z = (s / 2 for s in size)
    side, end = (wall / 2, y, z), (x - wall, wall / 2, z)
    walls = (
        ((x, y, wall / 2), (0.0, 0.0, wall / 2)),
        (side, (x - wall / 2, 0.0, z)),
        (side, (wall / 2 - x, 0.0, z)),
        (end, (0.0, y - wall / 2, z)),
        (end, (0.0, wall / 2 - y, z)),
    )
    parts = tuple(
        Part(kind="box", size=s, pos=p, color=color, material=material)
        for s, p in walls
    )
    return SceneObject(name=name, parts=parts, sites={"floor": (0.0, 0.0, wall)})


def lid(
    name: str, size: Vector3, *, color: Color = WOOD, material: str = "wood"
) -> SceneObject:
    """Make a board with a dark handle on top; its origin is the middle of the board.

    Site: `handle`.

    Args:
        name: Its name.
        size: Length, width and thickness of the board, m.
        color: Colour of the board.
        material: Material of the board.
    """
    x, y, z = (s / 2 for s in size)
    grip, post, reach = 0.008, 0.02, min(0.05, 0.6 * y)
    above = z + 2 * post
    dark = partial(Part, kind="box", color=DARK)
    parts = (
        Part(kind="box", size=(x, y, z), color=color, material=material),
        dark(size=(grip, grip, post), pos=(0.0, reach, z + post)),
        dark(size=(grip, grip, post), pos=(0.0, -reach, z + post)),
        dark(size=(grip, reach + grip, grip), pos=(0.0, 0.0, above)),
    )
    return SceneObject(name=name, parts=parts, sites={"handle": (0.0, 0.0, above)})


def ring_of_boxes(
    inner: float,
    outer: float,
    half_height: float,
    *,
    sides: int,
    pos: Vector3 = (0.0, 0.0, 0.0),
    color: Color = ENAMEL,
    material: str = "metal",
) -> tuple[Part, ...]:
    """Return a ring about z made of boxes, since collision shapes are convex.

    Args:
        inner: Radius of the inscribed circle of the hole, m.
        outer: Radius of the circle that the outer faces touch, m.
        half_height: m.
        sides: Number of boxes.
        pos: Middle of the ring, m.
        color: Colour of all boxes.
        material: Material of all boxes.
    """
    middle, thick = (inner + outer) / 2, (outer - inner) / 2
    width = outer * math.tan(math.pi / sides)
    box = partial(
        Part,
        kind="box",
        size=(thick, width, half_height),
        color=color,
        material=material,
    )
    parts = []
    for k in range(sides):
        angle = 2 * math.pi * k / sides
        x, y = middle * math.cos(angle), middle * math.sin(angle)
        turn = (math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2))
        parts.append(box(pos=(pos[0] + x, pos[1] + y, pos[2]), quat=turn))
    return tuple(parts)


def hollow_cylinder(
    name: str,
    inner: float,
    outer: float,
    half_height: float,
    *,
    sides: int = 16,
    color: Color = (0.62, 0.64, 0.67, 1.0),
    material: str = "metal",
) -> SceneObject:
    """Make a tube about z, its wall of boxes; radii and half height in m."""
    parts = ring_of_boxes(
        inner, outer, half_height, sides=sides, color=color, material=material
    )
    return SceneObject(name=name, parts=parts)


def pot(
    name: str,
    *,
    half_size: Vector3 = (0.07, 0.07, 0.035),
    wall: float = 0.006,
    handle_length: float = 0.09,
    handle_width: float = 0.09,
    handle_radius: float = 0.01,
    handle_colors: tuple[Color, Color] = (GREEN, BLUE),
) -> SceneObject:
    """Make a square pot with a handle on each side along y.

    Its origin is its middle. Sites: `handle0` (at +y), `handle1` (at -y), `center`,
    `bottom`.

    Args:
        name: Its name.
        half_size: Half of its outer length, width and height, m.
        wall: Thickness of walls and bottom, m.
        handle_length: Length of a handle along y, m.
        handle_width: Width of a handle along x, m.
        handle_radius: Half of the thickness of its bars, m.
        handle_colors: Colours of `handle0` and `handle1`.
    """
    x, y, z = half_size
    outer = (2 * x, 2 * y, 2 * z)
    vessel = open_bin("", outer, wall=wall, color=ENAMEL, material="ceramic")
    parts = [
        replace(part, pos=(part.pos[0], part.pos[1], part.pos[2] - z))
        for part in vessel.parts
    ]
    r, half, height = handle_radius, handle_width / 2, z - 2 * handle_radius
    along, grip = (r, handle_length / 2, r), y + handle_length - r
    for side, color in zip((1.0, -1.0), handle_colors, strict=True):
        near = side * (y + handle_length / 2)
        bar = partial(Part, kind="box", color=color)
        parts += [
            bar(size=along, pos=(half - r, near, height)),
            bar(size=along, pos=(r - half, near, height)),
            bar(size=(half, r, r), pos=(0.0, side * grip, height)),
        ]
    sites = {
        "handle0": (0.0, grip, height),
        "handle1": (0.0, -grip, height),
        "center": (0.0, 0.0, 0.0),
        "bottom": (0.0, 0.0, -z),
    }
    return SceneObject(name=name, parts=tuple(parts), sites=sites)
