"""Textures that are computed, not shipped."""

import functools

import numpy as np
from numpy.typing import NDArray

__all__ = ["brushed_pixels", "grain_pixels", "speckled_pixels", "wood_pixels"]

LIGHT, DARK = np.array([214.0, 178.0, 134.0]), np.array([176.0, 132.0, 88.0])
"""RGB of oak's early and late wood, chosen by eye."""


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
