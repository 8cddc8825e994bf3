"""Points on shapes."""

from collections.abc import Sequence

import numpy as np

from wbc_suite.robot.poses import rotation_matrix
from wbc_suite.robot.shape_geometry import hull_spheres
from wbc_suite.robot.shapes import Shape
from wbc_suite.typing import Matrix

MORE = 400  # points between the corners of each shape


def surface_points(shapes: Sequence[Shape]) -> Matrix:
    """Return the corners of convex shapes and points between, (n, 3), in their link.

    Spheres count as their centres.
    """
    parts: list[Matrix] = []
    rng = np.random.default_rng(0)
    for shape in shapes:
        corners = hull_spheres(shape)[:, :3]
        shares = rng.dirichlet(np.full(3, 0.7), size=MORE)
        chosen = corners[rng.integers(len(corners), size=(MORE, 3))]
        between = np.einsum("nk,nki->ni", shares, chosen)
        own = np.concatenate([corners, between])
        parts.append(own @ rotation_matrix(shape).T + shape.pos)
    return np.concatenate(parts)
