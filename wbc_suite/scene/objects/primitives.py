"""Objects of one primitive each."""

from collections.abc import Sequence

from wbc_suite.robot.shapes import Hull, Vector3
from wbc_suite.scene.objects.grasp_site import box_grasps
from wbc_suite.scene.objects.scene_object import Color, Part, SceneObject

GREY = (0.7, 0.7, 0.7, 1.0)


def box(
    name: str,
    half_size: Vector3,
    *,
    color: Color = GREY,
    material: str = "wood",
    density: float | None = None,
) -> SceneObject:
    """Make a box with the half lengths of its edges, m."""
    part = Part(
        kind="box", size=half_size, color=color, material=material, density=density
    )
    return SceneObject(name=name, parts=(part,), grasps=box_grasps(half_size))


def ball(
    name: str, radius: float, *, color: Color = GREY, material: str = "plastic"
) -> SceneObject:
    """Make a ball, radius in m."""
    part = Part(kind="ball", size=(radius,), color=color, material=material)
    return SceneObject(name=name, parts=(part,))


def cylinder(
    name: str,
    radius: float,
    half_height: float,
    *,
    color: Color = GREY,
    material: str = "metal",
) -> SceneObject:
    """Make an upright cylinder, sizes in m."""
    size = (radius, half_height)
    part = Part(kind="cylinder", size=size, color=color, material=material)
    return SceneObject(name=name, parts=(part,))


def capsule(
    name: str,
    radius: float,
    half_length: float,
    *,
    color: Color = GREY,
    material: str = "plastic",
) -> SceneObject:
    """Make an upright cylinder with round ends; `half_length` excludes them, m."""
    size = (radius, half_length)
    part = Part(kind="capsule", size=size, color=color, material=material)
    return SceneObject(name=name, parts=(part,))


def hull(
    name: str,
    spheres: Sequence[tuple[float, float, float, float]],
    *,
    color: Color = GREY,
    material: str = "plastic",
) -> SceneObject:
    """Make the convex hull of spheres `(x, y, z, radius)`, m; a radius may be 0."""
    surface = Hull(shape="hull", spheres=tuple(spheres))
    part = Part(kind="mesh", surface=surface, color=color, material=material)
    return SceneObject(name=name, parts=(part,))
