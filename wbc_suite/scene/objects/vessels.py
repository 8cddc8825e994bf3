"""Vessels and lids: walls of boxes, and rings of boxes."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

from wbc_suite.robot.shapes import Vector3
from wbc_suite.scene.objects.grasp_site import rod_grasps, top_grasps
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
    """Make a bin, outer size in m, that is open above.

    Its origin is the middle of its lower face. Site: `floor`, the middle of its floor.
    """
    x, y, z = (s / 2 for s in size)
    board = partial(Part, kind="box", color=color, material=material)
    floor = board(size=(x, y, wall / 2), pos=(0.0, 0.0, wall / 2))
    parts = (floor, *walls_around(x - wall, y - wall, wall, z, at=z, part=board))
    return SceneObject(name=name, parts=parts, sites={"floor": (0.0, 0.0, wall)})


def walls_around(
    x: float,
    y: float,
    wall: float,
    half_height: float,
    *,
    at: float,
    part: Callable[..., Part],
) -> list[Part]:
    """Return four walls, at a height, around a hole of half sizes x and y, m."""
    side, end = (wall / 2, y + wall, half_height), (x, wall / 2, half_height)
    out, up = x + wall / 2, y + wall / 2
    places = ((side, out, 0.0), (side, -out, 0.0), (end, 0.0, up), (end, 0.0, -up))
    return [part(size=size, pos=(px, py, at)) for size, px, py in places]


def lid(
    name: str, size: Vector3, *, color: Color = WOOD, material: str = "wood"
) -> SceneObject:
    """Make a board, size in m, with a dark handle on top; its origin is its middle.

    Site: `handle`.
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
    bar = (0.0, 0.0, above)
    grasps = top_grasps(bar, [(1.0, 0.0, 0.0)], tilt=0.4)
    return SceneObject(name=name, parts=parts, sites={"handle": bar}, grasps=grasps)


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

    `inner` is the radius of the circle in the hole, `outer` that of the circle that the
    outer faces touch, `pos` the middle of the ring, m.
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
    """Make a square pot, half of its outer size in m, with handles at +y and -y.

    Its origin is its middle. `handle_length` is along y, `handle_width` along x,
    `handle_radius` half of the thickness of the bars, m. Sites: `handle0` (at +y),
    `handle1` (at -y), `center`, `bottom`; colours are in the same order.
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
    grasps = [
        rod_grasps([sites[handle]], axis=0, grasp="wrap", tilt=0.4, name=handle)
        for handle in ("handle0", "handle1")
    ]
    return SceneObject(
        name=name, parts=tuple(parts), sites=sites, grasps=(*grasps[0], *grasps[1])
    )
