"""Turn hulls, rounded boxes, cones and lofts into triangle meshes.

Everything here is computed at export: no mesh file is read or shipped.
"""

import math
from functools import lru_cache

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial import ConvexHull, QhullError

from wbc_suite.errors import DescriptionError
from wbc_suite.robot.shapes import (
    Box,
    Cylinder,
    Hull,
    Loft,
    Shape,
    SkinMesh,
    kept_by_shape,
)
from wbc_suite.robot.skin_meshes import skin_triangles
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["mesh_of", "support_points"]

RING_POINTS = 24
"""Points on one ring of a loft or a cone; half as many on a small one."""
SMALL = 0.02
"""Radius in m up to which coarser rings and spheres do: fingers, knobs, edges."""


def mesh_of(shape: Shape | SkinMesh) -> tuple[Matrix, Indices] | None:
    """Compute the triangle mesh of a shape that is no primitive.

    Equal shapes share one mesh, which is read-only.

    Returns:
        Vertices, shape (n, 3), in the shape's own frame, and faces, shape (m, 3),
        counter-clockwise from outside; None when the engine has a primitive for it.
    """
    return skin_triangles(shape) if isinstance(shape, SkinMesh) else _computed(shape)


@kept_by_shape
def _computed(shape: Shape) -> tuple[Matrix, Indices] | None:
    match shape:
        case Hull():
            mesh = _convex(support_points(shape))
        case Box(radius=r) if r > 0.0:
            mesh = _convex(support_points(shape))
        case Cylinder(radius_to=r) if r is not None:
            mesh = _convex(support_points(shape))
        case Loft():
            mesh = _loft(shape)
        case _:
            return None
    for array in mesh:
        array.flags.writeable = False
    return mesh


def support_points(shape: Shape) -> Matrix:
    """Compute points, shape (n, 3), whose convex hull is the shape, in its frame.

    Raises:
        DescriptionError: For shapes that are no hull of points.
    """
    match shape:
        case Hull(spheres=spheres):
            rows = np.asarray(spheres, dtype=np.float64)
            return _sphere_points(rows[:, :3], rows[:, 3])
        case Box(size=size, radius=radius):
            half = np.asarray(size) - radius
            signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
            return _sphere_points(signs * half, np.full(8, radius))
        case Cylinder(start=a, end=b, radius=r, radius_to=s):
            return _cone_points(np.asarray(a), np.asarray(b), r, r if s is None else s)
        case Loft():
            return _loft(shape)[0]
        case _:
            raise DescriptionError(f"A {shape.shape} is not a hull of points.")


@lru_cache(maxsize=4)
def _icosphere(subdivisions: int) -> Matrix:
    """Points of a subdivided icosahedron on the unit sphere, shape (n, 3)."""
    phi = (1 + math.sqrt(5)) / 2
    points = [(0.0, s, t * phi) for s in (-1, 1) for t in (-1, 1)]
    vertices: Matrix = np.array([np.roll(p, k) for p in points for k in range(3)])
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    for _ in range(subdivisions):
        faces = ConvexHull(vertices).simplices
        edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        edges = np.unique(np.sort(edges, axis=1), axis=0)
        middle = vertices[edges].sum(axis=1)
        middle /= np.linalg.norm(middle, axis=1, keepdims=True)
        vertices = np.concatenate([vertices, middle])
    vertices.flags.writeable = False
    return vertices


def _sphere_points(centres: Matrix, radii: Vector) -> Matrix:
    """Points on several spheres; a radius of zero gives the centre alone."""
    finest = 2 if len(centres) <= 12 else 1
    parts = [
        c + r * _icosphere(finest if r > SMALL else 1) if r > 0 else c[None]
        for c, r in zip(centres, radii, strict=True)
    ]
    return np.concatenate(parts)


def _ring_angles(size: float) -> Vector:
    n = RING_POINTS if size > SMALL else RING_POINTS // 2
    return np.linspace(0, 2 * np.pi, n, endpoint=False)


def _convex(points: Matrix) -> tuple[Matrix, Indices]:
    """Convex hull with outward, counter-clockwise faces."""
    try:
        hull = ConvexHull(points)
    except QhullError as error:
        raise DescriptionError(
            "A hull is flat or a single point: give its spheres a radius."
        ) from error
    used = np.unique(hull.simplices)
    index = np.full(len(points), -1)
    index[used] = np.arange(len(used))
    faces = hull.simplices.astype(np.int64)
    a, b, c = (points[faces[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    faces[inward] = faces[inward][:, [0, 2, 1]]
    return points[used], index[faces]


def _cone_points(a: Vector, b: Vector, radius_a: float, radius_b: float) -> Matrix:
    axis = (b - a) / np.linalg.norm(b - a)
    other = np.eye(3)[int(np.argmin(np.abs(axis)))]
    u: Vector = np.asarray(np.cross(axis, other), dtype=np.float64)
    u /= np.linalg.norm(u)
    v: Vector = np.asarray(np.cross(axis, u), dtype=np.float64)
    t = _ring_angles(max(radius_a, radius_b))
    ring = np.cos(t)[:, None] * u + np.sin(t)[:, None] * v
    return np.concatenate([a + radius_a * ring, b + radius_b * ring])


def _loft(shape: Loft) -> tuple[Matrix, Indices]:
    sections = _smooth_sections(shape)
    t = _ring_angles(float(sections[:, 3:].max()))
    power = 2.0 / shape.exponent
    u = np.sign(np.cos(t)) * np.abs(np.cos(t)) ** power
    v = np.sign(np.sin(t)) * np.abs(np.sin(t)) ** power
    k = "xyz".index(shape.axis)
    others = [i for i in range(3) if i != k]
    vertices = np.empty((len(sections) * len(t) + 2, 3))
    rings = vertices[:-2].reshape(len(sections), len(t), 3)
    rings[:, :, k] = sections[:, 0:1]
    rings[:, :, others[0]] = sections[:, 1:2] + sections[:, 3:4] * u
    rings[:, :, others[1]] = sections[:, 2:3] + sections[:, 4:5] * v
    for row, section in zip((-2, -1), (sections[0], sections[-1]), strict=True):
        vertices[row, k] = section[0]
        vertices[row, others] = section[1:3]
    faces = _loft_faces(len(sections), len(t))
    # (x, z) is left-handed about y, so rings along y turn the other way round.
    return vertices, faces[:, ::-1].copy() if shape.axis == "y" else faces


def _smooth_sections(shape: Loft) -> Matrix:
    """Insert rings on a monotone cubic through the given ones."""
    given = np.asarray(shape.sections, dtype=np.float64)
    if not shape.smooth or len(given) < 3:
        return given
    knots: list[float] = given[:, 0].tolist()
    between = 4  # rings from one given ring to the next
    x = np.interp(
        np.arange(between * (len(knots) - 1) + 1) / between,
        np.arange(len(knots)),
        knots,
    )
    curve = PchipInterpolator(given[:, 0], given[:, 1:])
    return np.column_stack([x, curve(x)])


def _loft_faces(rings: int, n: int) -> Indices:
    i = np.arange(n)
    j = (i + 1) % n
    faces: list[Indices] = []
    for ring in range(rings - 1):
        a, b = ring * n, (ring + 1) * n
        faces.append(np.column_stack([a + i, a + j, b + j]))
        faces.append(np.column_stack([a + i, b + j, b + i]))
    first, last = rings * n, rings * n + 1
    faces.append(np.column_stack([np.full(n, first), j, i]))
    top = (rings - 1) * n
    faces.append(np.column_stack([np.full(n, last), top + i, top + j]))
    return np.concatenate(faces).astype(np.int64)
