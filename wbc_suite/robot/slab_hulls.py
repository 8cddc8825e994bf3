"""Cut a mesh that is not convex into slabs, and fit a hull to each."""

from typing import Any

import numpy as np

from wbc_suite.errors import DescriptionError
from wbc_suite.robot.shape_geometry import convex_hull, fit_hull
from wbc_suite.typing import Indices, Matrix, Vector

SLABS = 8
LEAST = 1e-9  # m^3; a smaller slab is left out
CONVEX = 0.9  # a mesh whose slabs have more of its hull's volume stays whole


def slab_hulls(vertices: Matrix, faces: Indices) -> list[dict[str, Any]]:
    """Return the fields of hulls that follow a mesh closer than one hull does.

    The slabs are equally thick, across the principal axis that leaves the least volume.

    Args:
        vertices: Shape (n, 3), m.
        faces: Triangles of these, shape (m, 3).
    """
    axes = np.linalg.svd(vertices - vertices.mean(axis=0), full_matrices=False)[2]
    ways = [_slabs(vertices, faces, axis) for axis in axes]
    volumes = [sum(map(_hull_volume, way)) for way in ways]
    least = int(np.argmin(volumes))
    if volumes[least] > CONVEX * _hull_volume(vertices):
        return [fit_hull(vertices)]
    return [fit_hull(points) for points in ways[least]]


def _slabs(vertices: Matrix, faces: Indices, axis: Vector) -> list[Matrix]:
    """Return the points of each slab: vertices in it, and edges cut by its planes."""
    heights: Vector = vertices @ axis
    low, high = float(heights.min()), float(heights.max())
    planes = [low + (high - low) * k / SLABS for k in range(SLABS + 1)]
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    cuts: list[Matrix] = []
    for plane in planes:
        a, b = edges[:, 0], edges[:, 1]
        crossed = (heights[a] - plane) * (heights[b] - plane) < 0.0
        a, b = a[crossed], b[crossed]
        share = ((plane - heights[a]) / (heights[b] - heights[a]))[:, None]
        cuts.append(vertices[a] + share * (vertices[b] - vertices[a]))
    parts: list[Matrix] = []
    for k in range(SLABS):
        inside = (heights >= planes[k]) & (heights <= planes[k + 1])
        parts.append(np.concatenate([vertices[inside], cuts[k], cuts[k + 1]]))
    return [points for points in parts if _hull_volume(points) > LEAST]


def _hull_volume(points: Matrix) -> float:
    """Return the volume of a convex hull, m^3; 0 if it is flat."""
    if len(points) < 4:
        return 0.0
    try:
        corners, faces = convex_hull(points)
    except DescriptionError:
        return 0.0
    a, b, c = np.moveaxis(corners[faces], 1, 0)
    return float(abs(np.einsum("ni,ni->n", a, np.cross(b, c)).sum()) / 6.0)
