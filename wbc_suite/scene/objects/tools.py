"""Tools and fittings: hammer, plate with a hole, nuts, wrench, stand, hanging frame."""

import math
from dataclasses import replace
from functools import partial

from wbc_suite.robot.shapes import Vector3
from wbc_suite.scene.objects.grasp_site import GraspSite, rod_grasps
from wbc_suite.scene.objects.scene_object import Color, Part, SceneObject
from wbc_suite.scene.objects.vessels import ring_of_boxes, walls_around

WOOD: Color = (0.72, 0.50, 0.28, 1.0)
STEEL: Color = (0.62, 0.64, 0.67, 1.0)
BLACK: Color = (0.13, 0.13, 0.14, 1.0)
FINGER = 0.02
"""Half of a finger's width and some room, m: grasps keep so far from ends."""
ALONG_X = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
HAMMER_LYING = (0.5, 0.5, 0.5, 0.5)
"""Turns a hammer on its side: its handle, z, to x, and its head, x, to y."""

steel_box = partial(Part, kind="box", color=STEEL, material="metal")
wooden_box = partial(Part, kind="box", color=WOOD, material="wood")


def hammer(
    name: str,
    *,
    handle_radius: float = 0.015,
    handle_length: float = 0.18,
    head_half_size: float = 0.02,
    mass: float = 0.18,
) -> SceneObject:
    """Make a hammer with its handle along z and its head above; origin in the handle.

    Sites: `handle` (the middle of the handle, the origin), `head`. Grasps: `neck` (next
    to the head) and `end`, around the handle. `head_half_size` is that of the middle
    block of the head; m and kg.
    """
    h, top = head_half_size, handle_length / 2
    middle = top + h
    head = partial(Part, color=STEEL, material="metal", density=2000.0)
    face = head(
        kind="cylinder",
        size=(0.8 * h, 0.6 * h),
        pos=(1.6 * h, 0.0, middle),
        quat=ALONG_X,
    )
    claw = partial(head, kind="box", size=(0.75 * h, 0.28 * h, 0.22 * h))
    parts = (
        wooden_box(kind="cylinder", size=(handle_radius, handle_length / 2)),
        head(kind="box", size=(h, h, h), pos=(0.0, 0.0, middle)),
        face,
        *(claw(pos=(-1.6 * h, side * 0.5 * h, middle)) for side in (-1.0, 1.0)),
    )
    sites = {"handle": (0.0, 0.0, 0.0), "head": (0.0, 0.0, middle)}
    neck, end = (0.0, 0.0, top - FINGER), (0.0, 0.0, FINGER - top)
    grasps = rod_grasps([neck], axis=2, name="neck")
    grasps += rod_grasps([end], axis=2, name="end")
    whole = SceneObject(name=name, parts=parts, sites=sites, grasps=grasps)
    return whole.with_mass(mass)


def plate_with_hole(
    name: str,
    *,
    half_size: float = 0.12,
    hole: float = 0.045,
    half_thickness: float = 0.01,
    color: Color = (0.30, 0.48, 0.68, 1.0),
) -> SceneObject:
    """Make a square plate across z with a square hole, all in half sizes, m.

    Site: `hole`, its middle.
    """
    part, wall = partial(Part, kind="box", color=color), half_size - hole
    parts = walls_around(hole, hole, wall, half_thickness, at=0.0, part=part)
    return SceneObject(name=name, parts=tuple(parts), sites={"hole": (0.0, 0.0, 0.0)})


def square_nut(
    name: str,
    *,
    hole: float = 0.0228,
    outer: float = 0.0445,
    half_height: float = 0.01,
    handle: float = 0.028,
) -> SceneObject:
    """Make a square nut of wood across z, with a handle along x of a length in m.

    `hole` and `outer` are half edges, m. Sites: `center` (the middle of the hole, the
    origin), `handle`.
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
) -> SceneObject:
    """Make an eight-sided nut of metal across z, with a handle along x.

    `hole` and `outer` are radii of inscribed circles, m. Sites: `center` (the middle of
    the hole, the origin), `handle`.
    """
    parts = ring_of_boxes(hole, outer, half_height, sides=8, color=STEEL)
    return _with_handle(name, parts, outer, half_height, handle)


def _with_handle(
    name: str, ring: tuple[Part, ...], outer: float, half_height: float, handle: float
) -> SceneObject:
    at = (outer + handle / 2, 0.0, 0.0)
    grip = replace(
        ring[0],
        size=(handle / 2, 0.013, half_height),
        pos=at,
        quat=(1.0, 0.0, 0.0, 0.0),
    )
    sites = {"center": (0.0, 0.0, 0.0), "handle": at}
    grasps = _flat_grasps(at[0], lift=0.4 * half_height, tilt=0.6)
    whole = SceneObject(name=name, parts=(*ring, grip), sites=sites, grasps=grasps)
    return whole.with_mass(0.04)


def _flat_grasps(x: float, *, lift: float, tilt: float) -> tuple[GraspSite, ...]:
    """Return grasps across a lying bar along x, by `lift` clear of a table, m."""
    closing = (0.0, 1.0, 0.0)
    sides = [
        GraspSite(
            pos=(x, 0.0, -lift * z), approach=(0.0, 0.0, z), closing=closing, tilt=tilt
        )
        for z in (1.0, -1.0)
    ]
    return tuple(turn for one in sides for turn in (one, one.turned()))


def wrench(
    name: str,
    *,
    length: float = 0.14,
    hole: float = 0.012,
    ring: float = 0.021,
    half_height: float = 0.005,
    mass: float = 0.09,
) -> SceneObject:
    """Make a lying ring spanner, its shaft along x, a ring across z at each end.

    `length` is from hole to hole, `hole` and `ring` are radii of inscribed circles, m.
    Sites: `hole1` (at +x), `hole2` (at -x), `grip` (the origin).
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
        steel_box(size=(end - ring + 0.002, 0.007, half_height)),
        Part(kind="box", size=(0.034, 0.012, 0.010), color=BLACK, density=1200.0),
    )
    sites = {
        "hole1": (end, 0.0, 0.0),
        "hole2": (-end, 0.0, 0.0),
        "grip": (0.0, 0.0, 0.0),
    }
    grasps = _flat_grasps(0.0, lift=0.004, tilt=0.4)
    parts = (*rings, *shaft)
    whole = SceneObject(name=name, parts=parts, sites=sites, grasps=grasps)
    return whole.with_mass(mass)


def stand(
    name: str,
    *,
    half_size: Vector3 = (0.085, 0.06, 0.01),
    hole: float = 0.011,
    wall: float = 0.005,
    height: float = 0.10,
) -> SceneObject:
    """Make a board, half size in m, with a square socket that is open above.

    Its origin is the middle of the lower face of the board; `hole` is half of the inner
    edge, `wall` the thickness of the walls, m. Sites: `socket` (the middle of the upper
    end of the socket), `floor` (its lower end).
    """
    board, half = 2 * half_size[2], height / 2
    firm = partial(wooden_box, firm=True)
    parts = (
        firm(size=half_size, pos=(0.0, 0.0, half_size[2])),
        *walls_around(hole, hole, wall, half, at=board + half, part=firm),
    )
    sites = {"socket": (0.0, 0.0, board + height), "floor": (0.0, 0.0, board)}
    return SceneObject(name=name, parts=parts, sites=sites)


def hanging_frame(
    name: str,
    *,
    length: float = 0.19,
    arm: float = 0.085,
    radius: float = 0.005,
    mass: float = 0.05,
) -> SceneObject:
    """Make a rod along z with an arm along x at its upper end, whose tip is bent up.

    Its origin is the middle of the rod; `radius` is half of the thickness of the bars,
    m. Sites: `tip` (the lower end of the rod), `corner`, `hook` (where a tool hangs),
    `bend`, `hook_tip`, `grip`.
    """
    end, bend, r = length / 2, 0.018, radius
    grip = (0.0, 0.0, 0.5 * end)
    parts = (
        steel_box(size=(r, r, end), firm=True),
        steel_box(size=(arm / 2, r, r), pos=(arm / 2, 0.0, end)),
        steel_box(size=(r, r, bend / 2), pos=(arm, 0.0, end + bend / 2)),
        Part(kind="box", size=(2 * r, 2 * r, 0.025), pos=grip, color=BLACK),
    )
    sites = {
        "tip": (0.0, 0.0, -end),
        "corner": (0.0, 0.0, end),
        "hook": (0.6 * arm, 0.0, end),
        "bend": (arm, 0.0, end),
        "hook_tip": (arm, 0.0, end + bend),
        "grip": grip,
    }
    grasps = rod_grasps([grip], axis=2, steps=4, tilt=0.6, lift=r)
    whole = SceneObject(name=name, parts=parts, sites=sites, grasps=grasps)
    return whole.with_mass(mass)
