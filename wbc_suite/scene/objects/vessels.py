"""Vessels and what covers them: walls of boxes, and rings of boxes."""

import math

from wbc_suite.robot.shapes import Vector3
from wbc_suite.scene.objects.thing import Color, Part, Thing

__all__ = ["hollow_cylinder", "lid", "open_bin", "pot", "ring_of_boxes"]

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
) -> Thing:
    """Make a bin that is open above; its origin is the middle of its bottom's face.

    Args:
        name: Its name.
        size: Outer length, width and height, m; the bottom is `wall` thick.
        wall: Thickness of the walls, m.
        color: Of all parts.
        material: Of all parts.
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
    return Thing(name=name, parts=parts, sites={"floor": (0.0, 0.0, wall)})


def lid(
    name: str,
    size: Vector3,
    *,
    color: Color = WOOD,
    material: str = "wood",
) -> Thing:
    """Make a board with a handle on top; its origin is the middle of the board.

    Args:
        name: Its name.
        size: Length, width and thickness of the board, m.
        color: Of the board; the handle is dark.
        material: Of the board.
    """
    x, y, z = (s / 2 for s in size)
    grip, post, reach = 0.008, 0.02, min(0.05, 0.6 * y)
    above = z + 2 * post
    parts = (
        Part(kind="box", size=(x, y, z), color=color, material=material),
        _dark((grip, grip, post), (0.0, reach, z + post)),
        _dark((grip, grip, post), (0.0, -reach, z + post)),
        _dark((grip, reach + grip, grip), (0.0, 0.0, above)),
    )
    return Thing(name=name, parts=parts, sites={"handle": (0.0, 0.0, above)})


def _dark(size: Vector3, pos: Vector3) -> Part:
    return Part(kind="box", size=size, pos=pos, color=DARK)


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
    """Return a ring about z as boxes, side by side; half of a convex engine's trouble.

    Args:
        inner: Radius of the circle inside, m.
        outer: Radius of the circle that the boxes' outer faces touch, m.
        half_height: m.
        sides: How many boxes.
        pos: Its middle.
        color: Of all boxes.
        material: Of all boxes.
    """
    middle, thick = (inner + outer) / 2, (outer - inner) / 2
    width = outer * math.tan(math.pi / sides)
    parts = []
    for k in range(sides):
        angle = 2 * math.pi * k / sides
        c, s = math.cos(angle), math.sin(angle)
        part = Part(
            kind="box",
            size=(thick, width, half_height),
            pos=(pos[0] + middle * c, pos[1] + middle * s, pos[2]),
            quat=(math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2)),
            color=color,
            material=material,
        )
        parts.append(part)
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
) -> Thing:
    """Make a tube about z, its wall of boxes; radii and half height in m."""
    parts = ring_of_boxes(
        inner, outer, half_height, sides=sides, color=color, material=material
    )
    return Thing(name=name, parts=parts)


def pot(
    name: str,
    *,
    half_size: Vector3 = (0.07, 0.07, 0.035),
    wall: float = 0.006,
    handle_length: float = 0.09,
    handle_width: float = 0.09,
    handle_radius: float = 0.01,
    handle_colors: tuple[Color, Color] = (GREEN, BLUE),
) -> Thing:
    """Make an angular pot with a handle on each side along y.

    Its origin is its middle. Sites: `handle0` (at +y), `handle1` (at -y), `center`,
    `bottom`.

    Args:
        name: Its name.
        half_size: Half of its outer length, width and height, m.
        wall: Thickness of walls and bottom, m.
        handle_length: How far a handle stands off, m.
        handle_width: Of a handle, along x, m.
        handle_radius: Of its bars, m.
        handle_colors: Of `handle0` and `handle1`.
    """
    x, y, z = half_size
    vessel = open_bin("", (2 * x, 2 * y, 2 * z), wall=wall, color=ENAMEL)
    parts = [
        Part(
            kind="box",
            size=p.size,
            pos=(p.pos[0], p.pos[1], p.pos[2] - z),
            color=ENAMEL,
            material="ceramic",
        )
        for p in vessel.parts
    ]
    half, height = handle_width / 2, z - 2 * handle_radius
    r = handle_radius
    for side, color in zip((1.0, -1.0), handle_colors, strict=True):
        out = side * (y + handle_length - r)
        along = (r, handle_length / 2, r)
        near = side * (y + handle_length / 2)
        parts += [
            Part(kind="box", size=size, pos=(x_bar, y_bar, height), color=color)
            for size, x_bar, y_bar in (
                (along, half - r, near),
                (along, r - half, near),
                ((half, r, r), 0.0, out),
            )
        ]
    grip = y + handle_length - r
    sites = {
        "handle0": (0.0, grip, height),
        "handle1": (0.0, -grip, height),
        "center": (0.0, 0.0, 0.0),
        "bottom": (0.0, 0.0, -z),
    }
    return Thing(name=name, parts=tuple(parts), sites=sites)
