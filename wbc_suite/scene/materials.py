"""Materials of objects: texture, gloss, density and friction.

A material is a computed light texture times the colour of a part. It is added to a
scene together with the first part that uses it.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from wbc_suite.errors import look_up
from wbc_suite.robot.shapes import Vector3

FRICTION = (1.0, 0.005, 0.0001)
"""Sliding, torsional, rolling; the default of this field's table-top benchmarks."""

PIXELS = 128  # along each side of a texture


@dataclass(frozen=True, kw_only=True, slots=True)
class Material:
    """One material; specular, shininess and reflectance are MuJoCo's, from 0 to 1.

    Attributes:
        density: kg/m^3.
        pixels: Function that computes its texture of n pixels, shape (n, n, 3).
        friction: Sliding, torsional, rolling.
    """

    density: float
    pixels: Callable[[int], NDArray[np.uint8]] | None = None
    specular: float = 0.3
    shininess: float = 0.3
    reflectance: float = 0.0
    friction: Vector3 = FRICTION


LIGHT, DARK = np.array([214.0, 178.0, 134.0]), np.array([176.0, 132.0, 88.0])
"""RGB of the early and late wood of oak, chosen by eye."""


@functools.cache
def wood_pixels(size: int) -> NDArray[np.uint8]:
    """Return planks of wood, shape (size, size, 3), read-only, the same at every call.

    Rings are sine waves across the grain, bent by low frequencies along it; each of
    four planks has its own shift and shade.
    """
    rng = np.random.default_rng(7)
    along, across = np.meshgrid(np.linspace(0, 1, size), np.linspace(0, 1, size))
    plank = np.minimum((across * 4).astype(np.int64), 3)
    shift, shade = rng.uniform(0, 10, 4)[plank], rng.uniform(-0.12, 0.12, 4)[plank]
    bend = np.zeros_like(along)
    for frequency in (1.0, 2.0, 5.0):
        phase = rng.uniform(0, 2 * np.pi)
        wave = 2 * np.pi * frequency * along + phase + shift
        bend += np.sin(wave) / frequency
    rings = np.sin(2 * np.pi * (9.0 * across + 0.25 * bend + shift))
    grain = rng.normal(0.0, 1.0, (size, 1)).repeat(size, axis=1)
    mix = np.clip(0.5 + 0.28 * rings + 0.08 * grain + shade, 0.0, 1.0)[..., None]
    seam = np.abs(across * 4 - np.rint(across * 4)) < 4.0 / size
    pixels = LIGHT * (1 - mix) + DARK * mix
    pixels[seam] *= 0.8
    planks = pixels.astype(np.uint8)
    planks.flags.writeable = False
    return planks


@functools.cache
def grain_pixels(size: int) -> NDArray[np.uint8]:
    """Return light wood grain to be coloured, shape (size, size, 3), read-only."""
    rng = np.random.default_rng(11)
    along, across = np.meshgrid(np.linspace(0, 1, size), np.linspace(0, 1, size))
    bend = 0.6 * np.sin(2 * np.pi * along) + 0.3 * np.sin(4 * np.pi * along + 1.0)
    rings = np.sin(2 * np.pi * (7.0 * across + 0.4 * bend))
    fibres = rng.normal(0.0, 1.0, (size, 1)).repeat(size, axis=1)
    return _greys(0.86 + 0.08 * rings + 0.03 * fibres)


@functools.cache
def brushed_pixels(size: int) -> NDArray[np.uint8]:
    """Return brushed metal to be coloured, shape (size, size, 3), read-only."""
    rng = np.random.default_rng(12)
    strokes = rng.normal(0.0, 1.0, (size, 1)) + 0.4 * rng.normal(0.0, 1.0, (size, size))
    glow = np.sin(np.pi * np.linspace(0, 1, size))[:, None]
    return _greys(0.82 + 0.10 * glow + 0.035 * strokes)


@functools.cache
def speckled_pixels(size: int) -> NDArray[np.uint8]:
    """Return glazed stoneware to be coloured, shape (size, size, 3), read-only."""
    rng = np.random.default_rng(13)
    value = 0.97 + 0.008 * rng.normal(0.0, 1.0, (size, size))
    value[rng.uniform(size=(size, size)) < 0.012] -= 0.18
    return _greys(value)


def _greys(value: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Turn brightness, 0 to 1, shape (n, n), into grey pixels."""
    grey = (255.0 * np.clip(value, 0.0, 1.0)).astype(np.uint8)
    pixels = np.repeat(grey[:, :, None], 3, axis=2)
    pixels.flags.writeable = False
    return pixels


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
    """Return a material; raises UnknownNameError."""
    return look_up("material", name, MATERIALS)


def use_material(spec: mujoco.MjSpec, name: str) -> str:
    """Add a material to a scene unless it is there; return its name in the scene."""
    own = f"object_{name}"
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
        kind = mujoco.mjtTexture.mjTEXTURE_CUBE
        add_texture(spec, added, kind, material.pixels(PIXELS))
    return own


def add_texture(
    spec: mujoco.MjSpec,
    material: mujoco.MjsMaterial,
    kind: mujoco.mjtTexture,
    pixels: NDArray[np.uint8],
) -> None:
    """Add pixels, shape (height, width, 3), as the texture of a material."""
    height, width, _ = pixels.shape
    texture = spec.add_texture(
        name=material.name, type=kind, nchannel=3, width=width, height=height
    )
    texture.data = pixels.tobytes()
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = material.name
