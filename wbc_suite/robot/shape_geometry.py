"""Geometry of shapes: bounds, convex hulls, and triangle meshes of non-primitives.

Everything here is computed at export: no mesh file is read or shipped.
"""

import math
from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from wbc_suite.errors import DescriptionError
from wbc_suite.robot.poses import compose, rotation_matrix
from wbc_suite.robot.shapes import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    Hull,
    Loft,
    Posed,
    Shape,
    SkinMesh,
    Sphere,
    cached_by_shape,
)
from wbc_suite.robot.surfaces import skin_triangles
from wbc_suite.typing import Indices, Matrix, Vector

RING_POINTS = 24  # points on one ring of a loft or a cone; half as many on a small one
SMALL = 0.02  # largest radius in m of shapes that get coarser rings and spheres
HULL_POINTS = 64  # largest number of points of a hull in the file format
MIN_HALF_SIZE = 1e-3
"""Smallest half size in m of the box that replaces a flat point cloud."""

DOWN = (0.0, 1.0, 0.0, 0.0)  # rotation from z to -z
CORNERS = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T


def mesh_of(shape: Shape | SkinMesh) -> tuple[Matrix, Indices] | None:
    """Compute the read-only mesh of a shape that is not a primitive of MuJoCo, or None.

    Vertices, shape (n, 3), are in the shape's own frame; faces, shape (m, 3), are
    counter-clockwise from outside.
    """
    return skin_triangles(shape) if isinstance(shape, SkinMesh) else _mesh_of(shape)


@cached_by_shape
def _mesh_of(shape: Shape) -> tuple[Matrix, Indices] | None:
    rounded = isinstance(shape, Box) and shape.radius > 0.0
    cone = isinstance(shape, Cylinder) and shape.radius_to is not None
    if isinstance(shape, Loft):
        mesh = _loft_mesh(shape)
    elif isinstance(shape, Hull) or rounded or cone:
        mesh = convex_hull(support_points(shape))
    else:
        return None
    for array in mesh:
        array.flags.writeable = False
    return mesh


def hull_spheres(shape: Shape) -> Matrix:
    """Return spheres x y z radius (n, 4) with the shape as convex hull, in its frame.

    An ellipsoid is replaced by its bounding box, which is larger at the corners.
    """
    match shape:
        case Sphere(radius=radius):
            return np.array([[0.0, 0.0, 0.0, radius]])
        case Capsule(start=start, end=end, radius=radius):
            return np.array([[*start, radius], [*end, radius]])
        case Hull(spheres=spheres):
            return np.asarray(spheres, dtype=np.float64)
        case Box(size=size, radius=radius):
            points = CORNERS * (np.asarray(size) - radius)
        case Ellipsoid(size=size):
            points, radius = CORNERS * np.asarray(size), 0.0
        case _:
            points, radius = support_points(shape), 0.0
    return np.column_stack([points, np.full(len(points), radius)])


def support_points(shape: Shape) -> Matrix:
    """Compute points (n, 3) with the shape as convex hull; raises for round shapes."""
    match shape:
        case Hull() | Box():
            spheres = hull_spheres(shape)
            return _sphere_points(spheres[:, :3], spheres[:, 3])
        case Cylinder(start=a, end=b, radius=r, radius_to=s):
            return _cone_points(np.asarray(a), np.asarray(b), r, r if s is None else s)
        case Loft():
            return _loft_mesh(shape)[0]
        case _:
            raise DescriptionError(
                f"A shape of type '{shape.shape}' is not the convex hull of points."
            )


@cached_by_shape
def shape_bounds(shape: Shape) -> tuple[Vector, Vector]:
    """Compute the corners of an axis-aligned box around a shape, in the link frame.

    Equal shapes share the arrays, which are read-only.
    """
    low, high = _own_bounds(shape)
    if shape.quat != (1.0, 0.0, 0.0, 0.0):
        rotation = rotation_matrix(shape)
        centre, reach = rotation @ (low + high) / 2, np.abs(rotation) @ (high - low) / 2
        low, high = centre - reach, centre + reach
    bounds = low + shape.pos, high + shape.pos
    for corner in bounds:
        corner.flags.writeable = False
    return bounds


def bounds_of(shapes: Iterable[Shape]) -> tuple[Vector, Vector]:
    """Compute the corners of a box around one or more shapes, in the link frame."""
    bounds = np.array([shape_bounds(shape) for shape in shapes])
    return bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)


def farthest_point(shapes: Sequence[Shape]) -> tuple[float, ...]:
    """Return the centre of the sphere or corner that is farthest from the origin."""
    points = np.zeros((1, 3))
    for shape in shapes:
        own = hull_spheres(shape)[:, :3] @ rotation_matrix(shape).T + shape.pos
        points = np.concatenate([points, own])
    return tuple(points[np.argmax(np.linalg.norm(points, axis=1))].tolist())


def _own_bounds(shape: Shape) -> tuple[Vector, Vector]:
    """Compute the bounds in the shape's own frame: of its spheres, or of its discs."""
    if isinstance(shape, Cylinder):
        centres = np.array([shape.start, shape.end])
        axis = (centres[1] - centres[0]) / np.linalg.norm(centres[1] - centres[0])
        radii = np.array([[shape.radius], [shape.radius_to or shape.radius]])
        reach = radii * np.sqrt(np.maximum(0.0, 1.0 - axis**2))
    else:
        spheres = hull_spheres(shape)
        centres, reach = spheres[:, :3], spheres[:, 3:]
    return (centres - reach).min(axis=0), (centres + reach).max(axis=0)


def along_z(shape: Capsule | Cylinder) -> tuple[Posed, float]:
    """Return the pose whose z axis is the segment, and the segment's half length."""
    (ax, ay, az), (bx, by, bz) = shape.start, shape.end
    length = math.dist(shape.start, shape.end)
    x, y, z = (bx - ax) / length, (by - ay) / length, (bz - az) / length
    half = math.hypot(x, y, 1.0 + z)  # the rotation axis is half way from z
    turn = ((1.0 + z) / half, -y / half, x / half, 0.0) if half > 1e-9 else DOWN
    middle = ((ax + bx) / 2, (ay + by) / 2, (az + bz) / 2)
    return Posed(**compose(shape, Posed(pos=middle, quat=turn))), length / 2


@lru_cache(maxsize=4)
def _icosphere(subdivisions: int) -> Matrix:
    """Return points of a subdivided icosahedron on the unit sphere, shape (n, 3)."""
    phi = (1 + math.sqrt(5)) / 2
    points = [(0.0, s, t * phi) for s in (-1, 1) for t in (-1, 1)]
    vertices: Matrix = np.array([np.roll(p, k) for p in points for k in range(3)])
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    for _ in range(subdivisions):
        faces = convex_hull(vertices)[1]
        edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        edges = np.unique(np.sort(edges, axis=1), axis=0)
        middle = vertices[edges].sum(axis=1)
        middle /= np.linalg.norm(middle, axis=1, keepdims=True)
        vertices = np.concatenate([vertices, middle])
    vertices.flags.writeable = False
    return vertices


def _sphere_points(centres: Matrix, radii: Vector) -> Matrix:
    """Return points on several spheres; a radius of zero gives only the centre."""
    finest = 2 if len(centres) <= 12 else 1
    parts = [
        c + r * _icosphere(finest if r > SMALL else 1) if r > 0 else c[None]
        for c, r in zip(centres, radii, strict=True)
    ]
    return np.concatenate(parts)


def _ring_angles(size: float) -> Vector:
    n = RING_POINTS if size > SMALL else RING_POINTS // 2
    return np.linspace(0, 2 * np.pi, n, endpoint=False)


def convex_hull(points: Matrix, *, most: int = -1) -> tuple[Matrix, Indices]:
    """Compute the convex hull of points (n, 3): its corners, and triangles of these.

    Faces, shape (m, 3), are counter-clockwise from outside. `most` is the largest
    number of corners, those farthest out; -1 for all of them. MuJoCo computes it:
    `scipy.spatial`, which gives the same, takes 0.5 s to import.

    Raises:
        DescriptionError: If the points lie in a plane.
    """
    import mujoco  # not needed by who only computes with a robot

    spec = mujoco.MjSpec()
    spec.add_mesh(
        name="hull",
        uservert=points.ravel().tolist(),
        maxhullvert=most,
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
    try:
        faces = spec.compile().mesh_face
    except ValueError as error:
        raise DescriptionError(
            "A hull is flat or a single point: give its spheres a radius."
        ) from error
    used, index = np.unique(faces, return_inverse=True)
    return points[used], index.reshape(-1, 3)


def _cone_points(a: Vector, b: Vector, radius_a: float, radius_b: float) -> Matrix:
    axis = (b - a) / np.linalg.norm(b - a)
    other = np.eye(3)[int(np.argmin(np.abs(axis)))]
    u: Vector = np.asarray(np.cross(axis, other), dtype=np.float64)
    u /= np.linalg.norm(u)
    v: Vector = np.asarray(np.cross(axis, u), dtype=np.float64)
    t = _ring_angles(max(radius_a, radius_b))
    ring = np.cos(t)[:, None] * u + np.sin(t)[:, None] * v
    return np.concatenate([a + radius_a * ring, b + radius_b * ring])


def _loft_mesh(shape: Loft) -> tuple[Matrix, Indices]:
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
    # (x, z) is left-handed about y, so rings along y have the opposite orientation.
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
    from scipy.interpolate import PchipInterpolator  # takes 0.4 s to import

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


def fit_hull(points: Matrix) -> dict[str, Any]:
    """Return the fields of a hull that approximates the convex hull of points (n, 3).

    A flat cloud gives a thin box. Of more than `HULL_POINTS` corners those are kept
    that lie farthest outside of the hull of the ones before them.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    centred = points - points.mean(axis=0)
    spread = np.linalg.svd(centred, compute_uv=False)
    if len(points) < 4 or spread[2] < 1e-6 * max(spread[0], 1e-9):
        half = np.maximum((high - low) / 2, MIN_HALF_SIZE)
        centre = ((low + high) / 2).tolist()
        return {"shape": "box", "size": half.tolist(), "pos": centre}
    corners, _ = convex_hull(points, most=HULL_POINTS)
    return {"shape": "hull", "spheres": [[*p, 0.0] for p in corners.tolist()]}
