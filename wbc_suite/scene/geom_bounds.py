"""Bounds of a model's geoms along directions, and of their boxes in a frame."""

import mujoco
import numpy as np

from wbc_suite.typing import Indices, Matrix, Vector


def solid_geoms(model: mujoco.MjModel) -> Indices:
    """Return the geoms that collide, shape (n,)."""
    return np.flatnonzero(model.geom_contype | model.geom_conaffinity)


def support(model: mujoco.MjModel, geom: int, ways: Matrix) -> Vector:
    """Return the support function of a geom along unit vectors, m, shape (n,).

    h(u) is the largest u . p over the points p of the geom; the vectors, shape (n, 3),
    have the geom's axes, and p begins in its middle.
    """
    kinds, size = mujoco.mjtGeom, model.geom_size[geom]
    match model.geom_type[geom]:
        case kinds.mjGEOM_SPHERE:
            return np.full(len(ways), size[0])
        case kinds.mjGEOM_CAPSULE:
            return size[0] + size[1] * np.abs(ways[:, 2])
        case kinds.mjGEOM_CYLINDER:
            x, y, z = ways.T
            return size[0] * np.hypot(x, y) + size[1] * np.abs(z)
        case kinds.mjGEOM_ELLIPSOID:
            return np.linalg.norm(ways * size, axis=1)
        case kinds.mjGEOM_MESH:
            mesh = model.geom_dataid[geom]
            first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
            return (ways @ model.mesh_vert[first : first + count].T).max(axis=1)
        case _:
            return np.abs(ways) @ size


def box_corners(
    model: mujoco.MjModel, data: mujoco.MjData, geoms: Indices, p: Vector, R: Matrix
) -> tuple[Matrix, Matrix]:
    """Return the corners of a box around each geom in a frame, m, shape (n, 3) each.

    The frame has the position p, m, and the axes R, shape (3, 3), in the world.
    """
    turns = R.T @ data.geom_xmat[geoms].reshape(-1, 3, 3)
    middle, half = np.split(model.geom_aabb[geoms], 2, axis=1)
    middles = (data.geom_xpos[geoms] - p) @ R
    middles += np.einsum("gij,gj->gi", turns, middle)
    reach = np.einsum("gij,gj->gi", np.abs(turns), half)
    return middles - reach, middles + reach
