"""Random patterns for textures: plain, chequered, graded and noisy."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["draw_pattern"]


def draw_pattern(
    height: int, width: int, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Return a picture of two random colours, shape (height, width, 3)."""
    first, second = rng.uniform(0.0, 255.0, (2, 3))
    y, x = np.mgrid[0.0 : 1.0 : height * 1j, 0.0 : 1.0 : width * 1j]
    kind = rng.integers(4)
    if kind == 0:
        mix = np.zeros_like(x)
    elif kind == 1:
        cells = rng.integers(2, 12)
        mix = (np.floor(x * cells) + np.floor(y * cells)) % 2.0
    elif kind == 2:
        angle = rng.uniform(0.0, 2.0 * np.pi)
        mix = 0.5 + 0.5 * np.sin(2.0 * np.pi * (x * np.cos(angle) + y * np.sin(angle)))
    else:
        coarse = rng.uniform(0.0, 1.0, (16, 16))
        rows = np.minimum((y * 16).astype(np.int64), 15)
        columns = np.minimum((x * 16).astype(np.int64), 15)
        mix = coarse[rows, columns]
    picture = first + mix[..., None] * (second - first)
    return picture.astype(np.uint8)
