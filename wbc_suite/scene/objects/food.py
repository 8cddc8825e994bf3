"""Groceries: what stands in a kitchen and fits into a gripper."""

from wbc_suite.robot.shapes import Box, Hull, Loft
from wbc_suite.scene.objects.thing import Color, Part, Thing

__all__ = ["bottle", "bread", "can", "cereal", "lemon", "milk"]

RED: Color = (0.80, 0.10, 0.12, 1.0)
WHITE: Color = (0.95, 0.95, 0.93, 1.0)
BLUE: Color = (0.16, 0.36, 0.68, 1.0)
TIN: Color = (0.82, 0.83, 0.85, 1.0)
CRUST: Color = (0.71, 0.45, 0.22, 1.0)
YELLOW: Color = (0.96, 0.80, 0.16, 1.0)
GREEN: Color = (0.20, 0.47, 0.28, 1.0)


def can(name: str, *, radius: float = 0.026, height: float = 0.085) -> Thing:
    """Make a soda can: a red mantle between two rims of tin, upright; sizes in m."""
    half, rim = height / 2, 0.006
    shoulder = (
        *((-half, 0.0, 0.0, 0.82 * radius, 0.82 * radius),),
        *((-half + rim, 0.0, 0.0, 0.995 * radius, 0.995 * radius),),
        *((half - rim, 0.0, 0.0, 0.995 * radius, 0.995 * radius),),
        *((half, 0.0, 0.0, 0.82 * radius, 0.82 * radius),),
    )
    tin = Loft(shape="loft", sections=shoulder, smooth=False)
    parts = (
        Part(kind="cylinder", size=(radius, half), drawn=False),
        _skin(tin, TIN, "metal"),
        Part(
            kind="cylinder",
            size=(radius, half - 1.2 * rim),
            color=RED,
            solid=False,
        ),
        Part(
            kind="cylinder",
            size=(radius + 0.0003, 0.22 * height),
            pos=(0.0, 0.0, 0.04 * height),
            color=WHITE,
            solid=False,
        ),
        Part(
            kind="cylinder",
            size=(radius + 0.0005, 0.10 * height),
            pos=(0.0, 0.0, 0.04 * height),
            color=RED,
            solid=False,
        ),
    )
    return Thing(name=name, parts=parts).with_mass(0.05)


def milk(name: str) -> Thing:
    """Make a small carton of milk with a gable, 44 x 44 x 130 mm, upright."""
    half, shoulder, top = 0.022, 0.028, 0.065
    gable = Hull(
        shape="hull",
        spheres=(
            *((x, y, shoulder, 0.0) for x in (-half, half) for y in (-half, half)),
            *((x, y, top - 0.01, 0.0) for x in (-half, half) for y in (-0.001, 0.001)),
        ),
    )
    body = (shoulder + top) / 2
    parts = (
        Part(
            kind="box",
            size=(half, half, body),
            pos=(0.0, 0.0, shoulder - body),
            color=WHITE,
            material="card",
        ),
        Part(
            kind="box",
            size=(half, 0.006, (top - shoulder) / 2),
            pos=(0.0, 0.0, (top + shoulder) / 2),
            drawn=False,
            material="card",
        ),
        _skin(gable, WHITE, "card"),
        Part(
            kind="box",
            size=(half, 0.0012, 0.006),
            pos=(0.0, 0.0, top - 0.006),
            color=BLUE,
            material="card",
            solid=False,
        ),
        Part(
            kind="box",
            size=(half + 0.0003, half + 0.0003, 0.016),
            pos=(0.0, 0.0, -0.035),
            color=BLUE,
            material="card",
            solid=False,
        ),
        Part(
            kind="box",
            size=(half + 0.0003, half + 0.0003, 0.002),
            pos=(0.0, 0.0, -0.012),
            color=GREEN,
            material="card",
            solid=False,
        ),
    )
    return Thing(name=name, parts=parts).with_mass(0.05)


def bread(name: str) -> Thing:
    """Make a small loaf, 60 x 44 x 44 mm, lying."""
    half = (0.030, 0.022, 0.022)
    crust = Box(shape="box", size=half, radius=0.012)
    parts = (
        Part(kind="box", size=half, drawn=False, density=250.0),
        _skin(crust, CRUST, "card"),
        *(
            Part(
                kind="capsule",
                size=(0.0015, 0.012),
                pos=(x, 0.0, 0.0212),
                quat=(0.7071067811865476, 0.7071067811865476, 0.0, 0.0),
                color=(0.93, 0.80, 0.58, 1.0),
                material="card",
                solid=False,
            )
            for x in (-0.013, 0.0, 0.013)
        ),
    )
    return Thing(name=name, parts=parts).with_mass(0.03)


def cereal(name: str) -> Thing:
    """Make a box of cereals, 56 x 30 x 120 mm, upright."""
    half = (0.028, 0.015, 0.060)
    x, y, _ = half
    front = y + 0.0003
    parts = (
        Part(kind="box", size=half, color=(0.87, 0.36, 0.12, 1.0), material="card"),
        Part(
            kind="box",
            size=(x - 0.003, front, 0.014),
            pos=(0.0, 0.0, 0.036),
            color=WHITE,
            material="card",
            solid=False,
        ),
        Part(
            kind="box",
            size=(x - 0.006, front + 0.0003, 0.006),
            pos=(0.0, 0.0, 0.036),
            color=RED,
            material="card",
            solid=False,
        ),
        Part(
            kind="ellipsoid",
            size=(0.020, front, 0.022),
            pos=(0.0, 0.0, -0.016),
            color=YELLOW,
            material="card",
            solid=False,
        ),
    )
    return Thing(name=name, parts=parts).with_mass(0.068)


def bottle(name: str) -> Thing:
    """Make a bottle of green glass with a cork, 60 mm wide and 180 mm high, upright."""
    profile = (
        (-0.090, 0.027),
        (-0.086, 0.030),
        (0.015, 0.030),
        (0.045, 0.016),
        (0.060, 0.011),
        (0.082, 0.011),
    )
    glass = Loft(shape="loft", sections=tuple((z, 0.0, 0.0, r, r) for z, r in profile))
    parts = (
        Part(kind="cylinder", size=(0.030, 0.055), pos=(0, 0, -0.035), drawn=False),
        Part(kind="cylinder", size=(0.012, 0.035), pos=(0, 0, 0.055), drawn=False),
        _skin(glass, (0.16, 0.38, 0.24, 1.0), "ceramic"),
        Part(
            kind="cylinder",
            size=(0.008, 0.006),
            pos=(0.0, 0.0, 0.084),
            color=(0.78, 0.62, 0.42, 1.0),
            material="wood",
            solid=False,
        ),
        Part(
            kind="cylinder",
            size=(0.0304, 0.024),
            pos=(0.0, 0.0, -0.030),
            color=WHITE,
            material="card",
            solid=False,
        ),
    )
    return Thing(name=name, parts=parts).with_mass(0.15)


def lemon(name: str) -> Thing:
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
    peel = Loft(
        shape="loft", axis="x", sections=tuple((x, 0.0, 0.0, r, r) for x, r in profile)
    )
    parts = (
        Part(kind="ellipsoid", size=(0.028, 0.022, 0.022), drawn=False),
        _skin(peel, YELLOW, "plastic"),
    )
    return Thing(name=name, parts=parts).with_mass(0.06)


def _skin(surface: Box | Hull | Loft, color: Color, material: str) -> Part:
    return Part(
        kind="mesh", surface=surface, color=color, material=material, solid=False
    )
