"""Triangle meshes of primitives, with MuJoCo's resolution.

Vertices at sharp edges are repeated, because renderers smooth normals of shared ones.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wbc_suite.typing import Indices, Matrix, Vector

RESOLUTION = ((0.006, 10, 4), (0.02, 16, 8), (math.inf, 28, 16))
"""Largest radius in m; segments around the axis; stacks from pole to pole, all even.
The largest are those of MuJoCo; fingers are round to 0.4 mm, links to 0.3 mm."""

SHARP = 0.8  # cosine of the smallest angle of a sharp edge, as in MuJoCo


@dataclass(frozen=True, slots=True)
class TriangleMesh:
    """Vertices, shape (n, 3), in m, and faces, shape (m, 3), counter-clockwise."""

    vertices: Matrix
    faces: Indices

    def moved(self, position: Vector, rotation: Matrix) -> "TriangleMesh":
        """Return it in another frame, given its position (3,) and rotation (3, 3)."""
        return TriangleMesh(self.vertices @ rotation.T + position, self.faces)


def creased(mesh: TriangleMesh) -> TriangleMesh:
    """Return the mesh with vertices repeated along its sharp edges.

    A vertex normal is the mean of its faces' normals, weighted by area. A corner of a
    face whose normal differs by more than 37 degrees gets its own vertex.
    """
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    weighted = np.cross(b - a, c - a)
    flat, near = _unit(weighted), np.ones(mesh.faces.shape, dtype=bool)
    for _ in range(2):  # the second mean excludes faces across sharp edges
        total = np.zeros((len(mesh.vertices), 3))
        for k in range(3):
            np.add.at(total, mesh.faces[near[:, k], k], weighted[near[:, k]])
        smooth = _unit(total)
        near = np.einsum("fi,fki->fk", flat, smooth[mesh.faces]) >= SHARP
    faces = mesh.faces.copy()
    faces[~near] = len(mesh.vertices) + np.arange(np.count_nonzero(~near))
    own = mesh.vertices[mesh.faces[~near]]
    return TriangleMesh(np.concatenate([mesh.vertices, own]), faces)


def _unit(vectors: Matrix) -> Matrix:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    safe = np.where(lengths > 0.0, lengths, 1.0)
    return np.where(lengths > 0.0, vectors / safe, (0.0, 0.0, 1.0))


def merge(meshes: Sequence[TriangleMesh]) -> TriangleMesh:
    """Return one mesh with the triangles of all meshes."""
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    return TriangleMesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate(
            [m.faces + start for m, start in zip(meshes, starts, strict=True)]
        ),
    )


def box_mesh(half: Vector) -> TriangleMesh:
    """Return a box with half sizes `half`, shape (3,)."""
    square = np.array([[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]], dtype=float)
    cyclic = [np.roll(square, k, axis=1) for k in range(3)]
    sides = [side for c in cyclic for side in (c, -c[::-1])]
    quads = 4 * np.arange(6)[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])
    return TriangleMesh(np.concatenate(sides) * half, quads.reshape(-1, 3))


def ellipsoid_mesh(half: Vector) -> TriangleMesh:
    """Return an ellipsoid, or a sphere, with half axes `half`, shape (3,)."""
    segments, stacks = _resolution(float(np.max(half)))
    angles = np.linspace(-np.pi / 2, np.pi / 2, stacks + 1)
    ball = _lathe(np.cos(angles), np.sin(angles), segments)
    return TriangleMesh(ball.vertices * half, ball.faces)


def capsule_mesh(radius: float, half: float) -> TriangleMesh:
    """Return a capsule along z with a cylinder of length 2 `half`."""
    segments, stacks = _resolution(radius)
    angles = np.linspace(0.0, np.pi / 2, stacks // 2 + 1)
    radii, heights = radius * np.cos(angles), half + radius * np.sin(angles)
    return _lathe(
        np.concatenate([radii[::-1], radii]),
        np.concatenate([-heights[::-1], heights]),
        segments,
    )


def cylinder_mesh(radius: float, half: float) -> TriangleMesh:
    """Return a cylinder along z of length 2 `half`."""
    n, _ = _resolution(radius)
    side = _lathe(np.full(2, radius), np.array([-half, half]), n)
    here = np.arange(n)
    fan = np.stack([here, np.roll(here, -1), np.full(n, n)], axis=1)
    disc = np.concatenate([side.vertices[n:], [[0.0, 0.0, half]]])
    top = TriangleMesh(disc, fan)
    bottom = TriangleMesh(disc * (1, 1, -1), fan[:, ::-1])
    return merge([side, top, bottom])


def _resolution(radius: float) -> tuple[int, int]:
    return next((n, k) for limit, n, k in RESOLUTION if radius <= limit)


def _lathe(radii: Vector, heights: Vector, segments: int) -> TriangleMesh:
    """Rotate a profile about z; neighbouring rings share their vertices."""
    turn = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    rings = np.empty((len(radii), segments, 3))
    rings[:, :, 0] = radii[:, None] * np.cos(turn)
    rings[:, :, 1] = radii[:, None] * np.sin(turn)
    rings[:, :, 2] = heights[:, None]
    return TriangleMesh(rings.reshape(-1, 3), _ring_faces(len(radii), segments))


def _ring_faces(rings: int, segments: int) -> Indices:
    """Split the quads between rings along alternating diagonals.

    The face area around a vertex is then symmetric, and smoothed normals point outward.
    """
    here = np.arange(segments)
    there = np.roll(here, -1)
    above, aslant = here + segments, there + segments
    odd = here % 2 == 1
    band = np.concatenate(
        [
            np.stack([here, there, np.where(odd, aslant, above)], axis=1),
            np.stack([np.where(odd, here, there), aslant, above], axis=1),
        ]
    )
    return np.concatenate([band + segments * k for k in range(rings - 1)])


def volume(vertices: Matrix, faces: Indices) -> float:
    """Return the volume in m^3 that triangles enclose, seen from their mean corner."""
    a, b, c = (
        vertices[faces[:, k]] - vertices[faces].mean(axis=(0, 1)) for k in range(3)
    )
    return abs(float(np.einsum("ij,ij->", a, np.cross(b, c)))) / 6.0
