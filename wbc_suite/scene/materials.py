"""Materials of objects: how they look, how heavy they are, how they touch.

A material is a light texture that is computed here, times the colour of a part. It is
added to a scene when the first part asks for it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from wbc_suite.errors import UnknownNameError
from wbc_suite.robot.shapes import Vector3
from wbc_suite.scene.textures import brushed_pixels, grain_pixels, speckled_pixels

__all__ = ["FRICTION", "MATERIALS", "Material", "material_named", "use_material"]

FRICTION = (1.0, 0.005, 0.0001)
"""Sliding, torsional, rolling; the default of this field's table-top benchmarks."""

PIXELS = 128
"""Along each side of a texture."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Material:
    """One kind of stuff.

    Attributes:
        density: kg/m^3.
        pixels: Computes its texture for a number of pixels, shape (n, n, 3).
        specular: How much of a lamp it mirrors, 0 to 1.
        shininess: How sharply, 0 to 1.
        reflectance: How much of its surroundings it mirrors, 0 to 1.
        friction: Sliding, torsional, rolling.
    """

    density: float
    pixels: Callable[[int], NDArray[np.uint8]] | None = None
    specular: float = 0.3
    shininess: float = 0.3
    reflectance: float = 0.0
    friction: Vector3 = FRICTION


MATERIALS = {
    "wood": Material(density=700.0, pixels=grain_pixels, specular=0.15),
    "metal": Material(
        density=2700.0, pixels=brushed_pixels, specular=0.7, shininess=0.6
    ),
    "ceramic": Material(
        density=2000.0, pixels=speckled_pixels, specular=0.6, shininess=0.8
    ),
    "plastic": Material(density=1000.0, specular=0.45, shininess=0.5),
    "card": Material(density=200.0, specular=0.05, shininess=0.05),
}
"""Densities in kg/m^3: hardwood, aluminium, stoneware, polyethylene to polystyrene, and
a filled folding box."""


def material_named(name: str) -> Material:
    """Return a material.

    Raises:
        UnknownNameError: If there is none of that name.
    """
    if name not in MATERIALS:
        raise UnknownNameError("material", name, MATERIALS)
    return MATERIALS[name]


def use_material(spec: mujoco.MjSpec, name: str) -> str:
    """Add a material to a scene unless it is there; return its name in the scene."""
    own = f"thing_{name}"
    if spec.material(own) is not None:
        return own
    material = material_named(name)
    added = spec.add_material(
        name=own,
        specular=material.specular,
        shininess=material.shininess,
        reflectance=material.reflectance,
    )
    if material.pixels is not None:
        # A square cube texture shows the same picture on all six sides.
        texture = spec.add_texture(
            name=own,
            type=mujoco.mjtTexture.mjTEXTURE_CUBE,
            nchannel=3,
            width=PIXELS,
            height=PIXELS,
        )
        texture.data = material.pixels(PIXELS).tobytes()
        added.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = own
    return own
