"""Groceries that fit into a gripper."""

from functools import partial
from typing import Literal

from wbc_suite.robot.shapes import Box, Hull, Loft
from wbc_suite.scene.objects.grasp_site import (
    box_grasps,
    end_grasps,
    rod_grasps,
    top_grasps,
)
from wbc_suite.scene.objects.scene_object import Color, Part, SceneObject

RED: Color = (0.80, 0.10, 0.12, 1.0)
WHITE: Color = (0.95, 0.95, 0.93, 1.0)
BLUE: Color = (0.16, 0.36, 0.68, 1.0)
TIN: Color = (0.82, 0.83, 0.85, 1.0)
CRUST: Color = (0.71, 0.45, 0.22, 1.0)
YELLOW: Color = (0.96, 0.80, 0.16, 1.0)
GREEN: Color = (0.20, 0.47, 0.28, 1.0)
CORK: Color = (0.78, 0.62, 0.42, 1.0)

shell = partial(Part, kind="mesh", solid=False)
band = partial(Part, kind="cylinder", solid=False)
label = partial(Part, kind="box", material="card", solid=False)


def can(name: str, *, radius: float = 0.026, height: float = 0.085) -> SceneObject:
    """Make an upright soda can, red between two tin rims; sizes in m."""
    half, rim, middle = height / 2, 0.006, (0.0, 0.0, 0.04 * height)
    narrow, wide = 0.82 * radius, 0.995 * radius
    profile = ((-half, narrow), (rim - half, wide), (half - rim, wide), (half, narrow))
    tin = _turned(profile, smooth=False)
    parts = (
        Part(kind="cylinder", size=(radius, half), drawn=False),
        shell(surface=tin, color=TIN, material="metal"),
        band(size=(radius, half - 1.2 * rim), color=RED),
        band(size=(radius + 0.0003, 0.22 * height), pos=middle, color=WHITE),
        band(size=(radius + 0.0005, 0.10 * height), pos=middle, color=RED),
    )
    above = (0.0, 0.0, half - 0.024)
    grasps = end_grasps(above, axis=2, steps=6, tilt=0.35)
    grasps += rod_grasps([(0.0, 0.0, 0.0)], axis=2, steps=12)
    return SceneObject(name=name, parts=parts, grasps=grasps).with_mass(0.05)


def milk(name: str) -> SceneObject:
    """Make a small upright carton of milk with a gable, 44 x 44 x 130 mm."""
    half, shoulder, top = 0.022, 0.028, 0.065
    corners = [(x, y, shoulder, 0.0) for x in (-half, half) for y in (-half, half)]
    ridge = [(x, y, top - 0.01, 0.0) for x in (-half, half) for y in (-0.001, 0.001)]
    gable = Hull(shape="hull", spheres=(*corners, *ridge))
    body, roof = (shoulder + top) / 2, (top - shoulder) / 2
    card = partial(Part, kind="box", material="card")
    around = half + 0.0003
    parts = (
        card(size=(half, half, body), pos=(0.0, 0.0, shoulder - body), color=WHITE),
        card(size=(half, 0.006, roof), pos=(0.0, 0.0, body), drawn=False),
        shell(surface=gable, color=WHITE, material="card"),
        label(size=(half, 0.0012, 0.006), pos=(0.0, 0.0, top - 0.006), color=BLUE),
        label(size=(around, around, 0.016), pos=(0.0, 0.0, -0.035), color=BLUE),
        label(size=(around, around, 0.002), pos=(0.0, 0.0, -0.012), color=GREEN),
    )
    grasps = top_grasps((0.0, 0.0, 0.046), ((0.0, 1.0, 0.0),), tilt=0.35)
    sides = box_grasps((half, half, body))
    grasps += tuple(
        g.at((0.0, 0.0, shoulder - body)) for g in sides if not g.approach[2]
    )
    return SceneObject(name=name, parts=parts, grasps=grasps).with_mass(0.05)


def bread(name: str) -> SceneObject:
    """Make a small lying loaf, 60 x 44 x 44 mm."""
    half = (0.030, 0.022, 0.022)
    crust = Box(shape="box", size=half, radius=0.012)
    cut = partial(
        Part,
        kind="capsule",
        size=(0.0015, 0.012),
        quat=(0.7071067811865476, 0.7071067811865476, 0.0, 0.0),
        color=(0.93, 0.80, 0.58, 1.0),
        material="card",
        solid=False,
    )
    parts = (
        Part(kind="box", size=half, drawn=False, density=250.0),
        shell(surface=crust, color=CRUST, material="card"),
        *(cut(pos=(x, 0.0, 0.0212)) for x in (-0.013, 0.0, 0.013)),
    )
    return SceneObject(name=name, parts=parts, grasps=box_grasps(half)).with_mass(0.03)


def cereal(name: str) -> SceneObject:
    """Make an upright box of cereals, 56 x 30 x 120 mm."""
    half = (0.028, 0.015, 0.060)
    x, y, _ = half
    front, title = y + 0.0003, (0.0, 0.0, 0.036)
    bowl = (0.020, front, 0.022)
    parts = (
        Part(kind="box", size=half, color=(0.87, 0.36, 0.12, 1.0), material="card"),
        label(size=(x - 0.003, front, 0.014), pos=title, color=WHITE),
        label(size=(x - 0.006, front + 0.0003, 0.006), pos=title, color=RED),
        label(kind="ellipsoid", size=bowl, pos=(0.0, 0.0, -0.016), color=YELLOW),
    )
    grasps = top_grasps(
        (0.0, 0.0, 0.036), ((0.0, 1.0, 0.0), (1.0, 0.0, 0.0)), tilt=0.35
    )
    grasps += tuple(g for g in box_grasps(half) if not g.approach[2])
    return SceneObject(name=name, parts=parts, grasps=grasps).with_mass(0.068)


def bottle(name: str) -> SceneObject:
    """Make an upright bottle of green glass with a cork, 60 mm wide, 180 mm high."""
    profile = (
        (-0.090, 0.027),
        (-0.086, 0.030),
        (0.015, 0.030),
        (0.045, 0.016),
        (0.060, 0.011),
        (0.082, 0.011),
    )
    glass, green = _turned(profile), (0.16, 0.38, 0.24, 1.0)
    cork, paper = (0.0, 0.0, 0.084), (0.0, 0.0, -0.030)
    parts = (
        Part(kind="cylinder", size=(0.030, 0.055), pos=(0, 0, -0.035), drawn=False),
        Part(kind="cylinder", size=(0.012, 0.035), pos=(0, 0, 0.055), drawn=False),
        shell(surface=glass, color=green, material="ceramic"),
        band(size=(0.008, 0.006), pos=cork, color=CORK, material="wood"),
        band(size=(0.0304, 0.024), pos=paper, color=WHITE, material="card"),
    )
    return SceneObject(name=name, parts=parts).with_mass(0.15)


def lemon(name: str) -> SceneObject:
    """Make a lemon, 60 mm long along x and 44 mm thick."""
    profile = (
        (-0.033, 0.002),
        (-0.028, 0.006),
        (-0.016, 0.018),
        (0.0, 0.022),
        (0.016, 0.018),
        (0.027, 0.007),
        (0.030, 0.003),
    )
    parts = (
        Part(kind="ellipsoid", size=(0.028, 0.022, 0.022), drawn=False),
        shell(surface=_turned(profile, axis="x"), color=YELLOW, material="plastic"),
    )
    return SceneObject(name=name, parts=parts).with_mass(0.06)


def _turned(
    profile: tuple[tuple[float, float], ...],
    *,
    axis: Literal["x", "z"] = "z",
    smooth: bool = True,
) -> Loft:
    """Return a solid of revolution through circles (height, radius), m."""
    sections = tuple((z, 0.0, 0.0, r, r) for z, r in profile)
    return Loft(shape="loft", axis=axis, sections=sections, smooth=smooth)
