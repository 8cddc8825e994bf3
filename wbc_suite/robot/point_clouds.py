"""Describe a cloud of points by one of our shapes."""

from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from wbc_suite.typing import Matrix

__all__ = ["enclosing_shape"]

HULL_POINTS = 64
"""Most points of a hull in our format."""
THINNEST = 1e-3
"""Half size in m of the box that stands for a flat cloud."""


def enclosing_shape(points: Matrix) -> dict[str, Any]:
    """Return the fields of a hull near the convex hull of points, shape (n, 3).

    A flat cloud gives a thin box. Of more than `HULL_POINTS` corners those are kept
    that reach farthest in evenly spread directions, the axes among them, so the hull
    lies inside the true one and touches it in all of them.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    centred = points - points.mean(axis=0)
    spread = np.linalg.svd(centred, compute_uv=False)
    if len(points) < 4 or spread[2] < 1e-6 * max(spread[0], 1e-9):
        half = np.maximum((high - low) / 2, THINNEST)
        centre = ((low + high) / 2).tolist()
        return {"shape": "box", "size": half.tolist(), "pos": centre}
    corners = points[ConvexHull(points).vertices]
    if len(corners) > HULL_POINTS:
        corners = corners[_outermost(corners / np.maximum(high - low, 1e-9))]
    return {"shape": "hull", "spheres": [[*p, 0.0] for p in corners.tolist()]}


def _outermost(points: Matrix) -> list[int]:
    """Return the indices of the points that are extreme in one of the directions."""
    chosen: list[int] = np.argmax(points @ _directions().T, axis=0).tolist()
    return sorted(set(chosen))


def _directions() -> Matrix:
    """The six axes, and unit vectors on a Fibonacci spiral; shape (HULL_POINTS, 3)."""
    count = HULL_POINTS - 6
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    turn = np.pi * (1 + 5**0.5) * k
    ring = np.sqrt(1 - z * z)
    spiral = np.column_stack([ring * np.cos(turn), ring * np.sin(turn), z])
    return np.concatenate([np.eye(3), -np.eye(3), spiral])
