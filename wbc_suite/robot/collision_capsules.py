"""Capsules and spheres that enclose collision shapes, for the QP's distance limits.

Each capsule encloses its shape, which the simulator collides exactly.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.elements import rigid_bodies
from wbc_suite.robot.poses import rotation_matrix
from wbc_suite.robot.shape_geometry import (
    convex_hull,
    hull_spheres,
    support_points,
)
from wbc_suite.robot.shapes import Box, Capsule, Cylinder, Ellipsoid, Shape, Sphere
from wbc_suite.typing import Indices, Matrix, Vector

MAX_STRIPS = 4  # largest number of capsules for a flat box
NEAR_HULL, WIDE = 0.03, 0.15
"""m; a capsule that reaches less out of the hull is not cut, others twice, in pieces of
pieces, and wide ones three times."""
WORTH = 4e-3  # m; a further capsule must bring all so much nearer to the hull


@dataclass(frozen=True, kw_only=True, slots=True)
class EnclosingCapsule:
    """All points within `radius` of a segment in a link's frame, m.

    The ends have the shape (3,) and are equal for a sphere.
    """

    link: str
    start: Vector
    end: Vector
    radius: float


def enclosing_capsules(robot: RobotDescription) -> tuple[EnclosingCapsule, ...]:
    """Compute the capsules around all collision shapes, in the order of the links."""
    return tuple(
        EnclosingCapsule(
            link=link.name,
            start=np.asarray(shape.pos) + rotation_matrix(shape) @ start,
            end=np.asarray(shape.pos) + rotation_matrix(shape) @ end,
            radius=radius,
        )
        for link in robot.links
        for shape in link.collision
        for start, end, radius in _capsules(shape)
    )


def collision_spheres(robot: RobotDescription) -> dict[str, Matrix]:
    """Return the spheres whose hulls are the collision shapes, for links that have any.

    Rows are x, y, z in the link's frame and the radius, m, shape (n, 4). The lowest
    sphere gives a shape's exact height over a plane.
    """
    return {
        link.name: np.concatenate([_in_link(shape) for shape in link.collision])
        for link in robot.links
        if link.collision
    }


def _in_link(shape: Shape) -> Matrix:
    spheres, R = hull_spheres(shape), rotation_matrix(shape)
    return np.column_stack([spheres[:, :3] @ R.T + shape.pos, spheres[:, 3]])


def collision_pairs(robot: RobotDescription) -> frozenset[frozenset[str]]:
    """Return the pairs of links that can collide with each other.

    By the simulator's rules these are not links of one rigid body, neighbours over a
    joint and pairs of `contacts.exclude`. Links of one gripper are left out as well.
    """
    rigid = rigid_bodies(robot.links)
    parent = {link.name: rigid[link.parent] for link in robot.links if link.parent}
    grippers = _gripper_links(robot)
    excluded = {frozenset(pair) for pair in robot.contacts.exclude}
    shaped = [link.name for link in robot.links if link.collision]
    pairs: set[frozenset[str]] = set()
    for a, b in itertools.combinations(shaped, 2):
        body_a, body_b = rigid[a], rigid[b]
        neighbours = parent.get(body_a) == body_b or parent.get(body_b) == body_a
        same_gripper = a in grippers and grippers[a] == grippers.get(b)
        if body_a != body_b and not neighbours and not same_gripper:
            pairs.add(frozenset((a, b)))
    return frozenset(pairs - excluded)


def _gripper_links(robot: RobotDescription) -> dict[str, str]:
    """Map the moving links of grippers to their gripper."""
    owner = {
        joint: group
        for group in robot.synergies
        for joint in robot.groups.get(group, ())
    }
    links: dict[str, str] = {}
    for link in robot.links:
        joint = link.joint
        name = joint and (joint.mimic.joint if joint.mimic else joint.name)
        group = owner.get(name or "") or links.get(link.parent or "")
        if group is not None:
            links[link.name] = group
    return links


Segment = tuple[Vector, Vector, float]


def _capsules(shape: Shape) -> list[Segment]:
    match shape:
        case Sphere(radius=radius):
            return [(np.zeros(3), np.zeros(3), radius)]
        case Capsule(start=start, end=end, radius=radius):
            return [(np.asarray(start), np.asarray(end), radius)]
        case Cylinder(start=start, end=end, radius=radius):
            wide = max(radius, shape.radius_to or 0.0)
            return [_around_cylinder(np.asarray(start), np.asarray(end), wide)]
        case Ellipsoid(size=size):
            return [_around_ellipsoid(np.asarray(size))]
        case Box(size=size):
            return _around_box(np.asarray(size))
        case _:
            return _around_hull(support_points(shape))


def _around_cylinder(start: Vector, end: Vector, radius: float) -> Segment:
    """Return the capsule of least volume on a cylinder's axis.

    Its segment ends a distance `u` before the cylinder's end faces. Its radius reaches
    their rims: `rho^2 = r^2 + u^2`.
    """
    length = float(np.linalg.norm(end - start))
    u = np.linspace(0.0, length / 2, 101)
    rho = np.hypot(radius, u)
    best = int(np.argmin(rho**2 * (length - 2.0 * u + 4.0 / 3.0 * rho)))
    step = u[best] / length * (end - start)
    return start + step, end - step, float(rho[best])


def _around_ellipsoid(size: Vector) -> Segment:
    """Return a segment of half length a - b, radius b, for half axes a >= b."""
    axis = int(np.argmax(size))
    radius = float(np.max(np.delete(size, axis)))
    half = np.zeros(3)
    half[axis] = size[axis] - radius
    return -half, half, radius


def _around_box(size: Vector) -> list[Segment]:
    """Return parallel capsules along the longest axis, side by side in a flat box."""
    thin, middle, long = np.argsort(size)
    strips = int(np.clip(np.round(size[middle] / size[thin]), 1, MAX_STRIPS))
    width = size[middle] / strips
    radius = float(np.hypot(width, size[thin]))
    half = np.zeros(3)
    half[long] = size[long]
    found: list[Segment] = []
    for k in range(strips):
        centre = np.zeros(3)
        centre[middle] = -size[middle] + (2 * k + 1) * width
        found.append(_around_cylinder(centre - half, centre + half, radius))
    return found


def _around_hull(points: Matrix) -> list[Segment]:
    """Return capsules around the hull of points, cut where that brings them nearer."""
    points, faces = convex_hull(points)
    planes = _face_planes(points, faces)
    reach, _ = _pieces(points, planes, 0)
    return _pieces(points, planes, 3 if reach > WIDE else 2)[1]


def _face_planes(points: Matrix, faces: Indices) -> Matrix:
    """Return outward normals n and offsets d of faces, n x + d = 0, shape (m, 4)."""
    a, b, c = (points[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, sizes, out=np.zeros_like(normals), where=sizes > 0.0)
    planes = np.column_stack([normals, -np.einsum("ij,ij->i", normals, a)])
    return planes[sizes[:, 0] > 0.0]


def _pieces(points: Matrix, planes: Matrix, cuts: int) -> tuple[float, list[Segment]]:
    """Return how far capsules of a hull's piece are out of its planes, m, and these.

    A piece is cut in the middle, across the axis of the link that is best for it.
    """
    start, end, radius = whole = _around_points(points)
    reach = np.maximum(planes[:, :3] @ start, planes[:, :3] @ end) + planes[:, 3]
    found = [(float(reach.max()) + radius, [whole])]
    if cuts and found[0][0] > NEAR_HULL:
        for halves in _halves(points):
            (a, low), (b, high) = (_pieces(half, planes, cuts - 1) for half in halves)
            found.append((max(a, b), low + high))
    return min(found, key=lambda piece: piece[0] + WORTH * len(piece[1]))


def _halves(points: Matrix) -> Iterator[tuple[Matrix, Matrix]]:
    """Yield the halves of a hull's points across each axis of the link.

    Both have the points where the cut goes through an edge.
    """
    points, faces = convex_hull(points)
    edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    for along in points.T:
        middle = (along.min() + along.max()) / 2
        low = along < middle
        crossing = edges[low[edges].sum(axis=1) == 1]
        near, far = along[crossing].T - middle
        share = (near / (near - far))[:, None]
        cut = points[crossing[:, 0]] * (1 - share) + points[crossing[:, 1]] * share
        yield np.concatenate([points[low], cut]), np.concatenate([points[~low], cut])


def _volume(capsule: Segment) -> float:
    start, end, radius = capsule
    length = float(np.linalg.norm(end - start))
    return float(np.pi * radius**2 * (length + 4.0 / 3.0 * radius))


def _around_points(points: Matrix) -> Segment:
    """Return the smallest capsule along an axis, or the longest principal axis."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    longest = np.linalg.svd(points - middle, full_matrices=False)[2][0]
    found = [_along(axis, points, middle) for axis in (longest, *np.eye(3))]
    return min(found, key=_volume)


def _along(axis: Vector, points: Matrix, middle: Vector) -> Segment:
    """Return the capsule around points on the line through their middle."""
    along = (points - middle) @ axis
    across = np.linalg.norm(points - middle - np.outer(along, axis), axis=1)
    radius = float(across.max())
    reach = np.sqrt(np.maximum(radius**2 - across**2, 0.0))
    low, high = float((along + reach).min()), float((along - reach).max())
    if low > high:
        low = high = (low + high) / 2
    return middle + low * axis, middle + high * axis, radius
