"""Things made of primitives."""

import mujoco

from wbc_suite.robot.shapes import Vector3

__all__ = ["add_box"]

WOOD_DENSITY = 700.0
"""kg/m^3, hardwood."""


def add_box(
    spec: mujoco.MjSpec,
    name: str,
    *,
    half_size: Vector3,
    rgba: tuple[float, float, float, float],
    friction: Vector3 = (1.0, 0.005, 0.0001),
    density: float = WOOD_DENSITY,
) -> None:
    """Add a free box; body, geom and free joint carry its name.

    Args:
        spec: The scene.
        name: Name of body and geom; the joint is called `{name}_joint`.
        half_size: Half lengths of the edges, m.
        rgba: Colour.
        friction: Sliding, torsional, rolling.
        density: kg/m^3.
    """
    body = spec.worldbody.add_body(name=name)
    body.add_joint(name=f"{name}_joint", type=mujoco.mjtJoint.mjJNT_FREE)
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=half_size,
        rgba=rgba,
        friction=friction,
        density=density,
        condim=4,
        solref=(0.02, 2.0),
    )
