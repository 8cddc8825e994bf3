"""Textures that are computed, not shipped."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["wood_pixels"]

LIGHT, DARK = np.array([214.0, 178.0, 134.0]), np.array([176.0, 132.0, 88.0])
"""RGB of oak's early and late wood, chosen by eye."""


def wood_pixels(size: int) -> NDArray[np.uint8]:
    """Return planks of wood, shape (size, size, 3), the same at every call.

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
    return pixels.astype(np.uint8)
