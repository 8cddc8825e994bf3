"""Tools and fittings: hammer, plate with a hole, nuts, wrench, hanging frame."""

import math
from dataclasses import replace

from wbc_suite.robot.shapes import Vector3
from wbc_suite.scene.objects.thing import Color, Part, Thing
from wbc_suite.scene.objects.vessels import ring_of_boxes

__all__ = [
    "hammer",
    "hanging_frame",
    "plate_with_hole",
    "round_nut",
    "square_nut",
    "stand",
    "wrench",
]

WOOD: Color = (0.72, 0.50, 0.28, 1.0)
STEEL: Color = (0.62, 0.64, 0.67, 1.0)
BRASS: Color = (0.80, 0.58, 0.24, 1.0)
BLACK: Color = (0.13, 0.13, 0.14, 1.0)
ALONG_X = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
HAMMER_LYING = (0.5, 0.5, 0.5, 0.5)
"""Turns a hammer on its side: its handle, z, to x, and its head, x, to y."""
ALONG_Y = (math.sqrt(0.5), -math.sqrt(0.5), 0.0, 0.0)


def hammer(
    name: str,
    *,
    handle_radius: float = 0.015,
    handle_length: float = 0.18,
    head_half_size: float = 0.02,
    mass: float = 0.18,
) -> Thing:
    """Make a hammer whose handle points along z, its head above; origin in the handle.

    Sites: `handle` (the handle's middle, the origin), `head`.

    Args:
        name: Its name.
        handle_radius: m.
        handle_length: m.
        head_half_size: Of the head's middle block, m.
        mass: kg.
    """
    h, top = head_half_size, handle_length / 2
    middle = top + h
    parts = (
        Part(
            kind="cylinder",
            size=(handle_radius, handle_length / 2),
            color=WOOD,
            material="wood",
        ),
        Part(
            kind="box",
            size=(h, h, h),
            pos=(0.0, 0.0, middle),
            color=STEEL,
            material="metal",
            density=2000.0,
        ),
        Part(
            kind="cylinder",
            size=(0.8 * h, 0.6 * h),
            pos=(1.6 * h, 0.0, middle),
            quat=ALONG_X,
            color=STEEL,
            material="metal",
            density=2000.0,
        ),
        *(
            Part(
                kind="box",
                size=(0.75 * h, 0.28 * h, 0.22 * h),
                pos=(-1.6 * h, side * 0.5 * h, middle),
                color=STEEL,
                material="metal",
                density=2000.0,
            )
            for side in (-1.0, 1.0)
        ),
    )
    sites = {"handle": (0.0, 0.0, 0.0), "head": (0.0, 0.0, middle)}
    return Thing(name=name, parts=parts, sites=sites).with_mass(mass)


def plate_with_hole(
    name: str,
    *,
    half_size: float = 0.12,
    hole: float = 0.045,
    half_thickness: float = 0.01,
    color: Color = (0.30, 0.48, 0.68, 1.0),
) -> Thing:
    """Make a square plate across z with a square hole in its middle; sizes in m.

    Args:
        name: Its name.
        half_size: Half of the plate's edge.
        hole: Half of the hole's edge.
        half_thickness: Half of the plate's thickness.
        color: Its colour.
    """
    band, middle = (half_size - hole) / 2, (half_size + hole) / 2
    parts = tuple(
        Part(kind="box", size=(*size, half_thickness), pos=(*at, 0.0), color=color)
        for size, at in (
            ((half_size, band), (0.0, middle)),
            ((half_size, band), (0.0, -middle)),
            ((band, hole), (middle, 0.0)),
            ((band, hole), (-middle, 0.0)),
        )
    )
    return Thing(name=name, parts=parts, sites={"hole": (0.0, 0.0, 0.0)})


def square_nut(
    name: str,
    *,
    hole: float = 0.0228,
    outer: float = 0.0445,
    half_height: float = 0.01,
    handle: float = 0.028,
) -> Thing:
    """Make a square nut of wood across z, with a handle along x.

    Sites: `center` (the hole's middle, the origin), `handle`.

    Args:
        name: Its name.
        hole: Half of the hole's edge, m.
        outer: Half of the nut's edge, m.
        half_height: m.
        handle: How far the handle stands off, m.
    """
    plate = plate_with_hole(
        name, half_size=outer, hole=hole, half_thickness=half_height
    )
    parts = tuple(replace(p, color=WOOD, material="wood") for p in plate.parts)
    return _with_handle(name, parts, outer, half_height, handle)


def round_nut(
    name: str,
    *,
    hole: float = 0.0265,
    outer: float = 0.045,
    half_height: float = 0.01,
    handle: float = 0.028,
) -> Thing:
    """Make an eight-sided nut of metal across z, with a handle along x.

    Sites: `center` (the hole's middle, the origin), `handle`.

    Args:
        name: Its name.
        hole: Radius of the circle in the hole, m.
        outer: Radius of the circle that the outer faces touch, m.
        half_height: m.
        handle: How far the handle stands off, m.
    """
    parts = ring_of_boxes(
        hole, outer, half_height, sides=8, color=STEEL, material="metal"
    )
    return _with_handle(name, parts, outer, half_height, handle)


def _with_handle(
    name: str, ring: tuple[Part, ...], outer: float, half_height: float, handle: float
) -> Thing:
    at = (outer + handle / 2, 0.0, 0.0)
    grip = Part(
        kind="box",
        size=(handle / 2, 0.013, half_height),
        pos=at,
        color=ring[0].color,
        material=ring[0].material,
    )
    sites = {"center": (0.0, 0.0, 0.0), "handle": at}
    return Thing(name=name, parts=(*ring, grip), sites=sites).with_mass(0.04)


def wrench(
    name: str,
    *,
    length: float = 0.14,
    hole: float = 0.012,
    ring: float = 0.021,
    half_height: float = 0.005,
    mass: float = 0.09,
) -> Thing:
    """Make a ring spanner that lies across z, its shaft along x, a ring at each end.

    Sites: `hole1` (at +x), `hole2` (at -x), `grip` (the origin).

    Args:
        name: Its name.
        length: Between the holes' middles, m.
        hole: Radius of the circle in a hole, m.
        ring: Radius of the circle that a ring's faces touch, m.
        half_height: m.
        mass: kg.
    """
    end = length / 2
    rings = [
        part
        for x in (end, -end)
        for part in ring_of_boxes(
            hole, ring, half_height, sides=6, pos=(x, 0.0, 0.0), color=STEEL
        )
    ]
    shaft = (
        Part(
            kind="box",
            size=(end - ring + 0.002, 0.007, half_height),
            color=STEEL,
            material="metal",
        ),
        Part(kind="box", size=(0.034, 0.012, 0.010), color=BLACK, density=1200.0),
    )
    sites = {
        "hole1": (end, 0.0, 0.0),
        "hole2": (-end, 0.0, 0.0),
        "grip": (0.0, 0.0, 0.0),
    }
    return Thing(name=name, parts=(*rings, *shaft), sites=sites).with_mass(mass)


def stand(
    name: str,
    *,
    half_size: Vector3 = (0.085, 0.06, 0.01),
    hole: float = 0.011,
    wall: float = 0.005,
    height: float = 0.10,
) -> Thing:
    """Make a board with a square socket that something can be put into from above.

    Its origin is the middle of the board's lower face. Sites: `socket` (the middle of
    the socket's upper end), `floor` (its lower end).

    Args:
        name: Its name.
        half_size: Of the board, m.
        hole: Half of the socket's inner edge, m.
        wall: Thickness of its walls, m.
        height: Of its walls, m.
    """
    board = 2 * half_size[2]
    side, middle, up = hole + wall, hole + wall / 2, board + height / 2
    walls = (
        ((side, wall / 2), (0.0, middle)),
        ((side, wall / 2), (0.0, -middle)),
        ((wall / 2, hole), (middle, 0.0)),
        ((wall / 2, hole), (-middle, 0.0)),
    )
    parts = (
        Part(
            kind="box",
            size=half_size,
            pos=(0.0, 0.0, half_size[2]),
            color=WOOD,
            material="wood",
        ),
        *(
            Part(
                kind="box",
                size=(*size, height / 2),
                pos=(*at, up),
                color=WOOD,
                material="wood",
            )
            for size, at in walls
        ),
    )
    sites = {"socket": (0.0, 0.0, board + height), "floor": (0.0, 0.0, board)}
    return Thing(name=name, parts=parts, sites=sites)


def hanging_frame(
    name: str,
    *,
    length: float = 0.19,
    arm: float = 0.085,
    radius: float = 0.005,
    mass: float = 0.05,
) -> Thing:
    """Make a rod along z with an arm along x at its upper end, whose tip is bent up.

    Its origin is the middle of the rod. Sites: `tip` (the rod's lower end), `corner`,
    `hook` (where something hangs), `bend`, `hook_tip`, `grip`.

    Args:
        name: Its name.
        length: Of the rod, m.
        arm: Length of the arm, m.
        radius: Half of the bars' thickness, m.
        mass: kg.
    """
    end, bend = length / 2, 0.018
    steel = {"color": STEEL, "material": "metal"}
    parts = (
        Part(kind="box", size=(radius, radius, end), **steel),
        Part(
            kind="box",
            size=(arm / 2, radius, radius),
            pos=(arm / 2, 0.0, end),
            **steel,
        ),
        Part(
            kind="box",
            size=(radius, radius, bend / 2),
            pos=(arm, 0.0, end + bend / 2),
            **steel,
        ),
        Part(
            kind="box",
            size=(2 * radius, 2 * radius, 0.025),
            pos=(0.0, 0.0, 0.5 * end),
            color=BLACK,
        ),
    )
    sites = {
        "tip": (0.0, 0.0, -end),
        "corner": (0.0, 0.0, end),
        "hook": (0.6 * arm, 0.0, end),
        "bend": (arm, 0.0, end),
        "hook_tip": (arm, 0.0, end + bend),
        "grip": (0.0, 0.0, 0.5 * end),
    }
    return Thing(name=name, parts=parts, sites=sites).with_mass(mass)
