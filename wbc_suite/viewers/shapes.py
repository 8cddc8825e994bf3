"""Triangle meshes of MuJoCo's geometries, for a page to draw.

Corners that should look sharp are repeated, one copy per face, because the page
smooths normals over shared vertices.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["TriangleMesh", "geom_mesh", "merge"]

SEGMENTS = 24  # around an axis; a 5 cm link then deviates by 0.4 mm from round


@dataclass(frozen=True, slots=True)
class TriangleMesh:
    """Vertices, shape (n, 3), in m, and faces, shape (m, 3), counter-clockwise."""

    vertices: Matrix
    faces: Indices

    def moved(self, position: Vector, rotation: Matrix) -> "TriangleMesh":
        """Return the mesh carried from its own frame into another one."""
        return TriangleMesh(self.vertices @ rotation.T + position, self.faces)


def geom_mesh(model: mujoco.MjModel, geom: int) -> TriangleMesh | None:
    """Return a geometry in its own frame; None for planes and what has no surface."""
    size = model.geom_size[geom]
    match model.geom_type[geom]:
        case mujoco.mjtGeom.mjGEOM_BOX:
            return _box(size)
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            return _lathe(*_arc(size[0], 0.0), np.ones(3))
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            return _lathe(*_arc(1.0, 0.0), size)
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            return _lathe(*_arc(size[0], size[1]), np.ones(3))
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            return _cylinder(size[0], size[1])
        case mujoco.mjtGeom.mjGEOM_MESH:
            return _mesh(model, int(model.geom_dataid[geom]))
        case _:
            return None


def merge(meshes: list[TriangleMesh]) -> TriangleMesh:
    """Return one mesh with the triangles of all."""
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    return TriangleMesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate(
            [m.faces + start for m, start in zip(meshes, starts, strict=True)]
        ),
    )


def _box(half: Vector) -> TriangleMesh:
    square = np.array([[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]], dtype=float)
    cyclic = [np.roll(square, k, axis=1) for k in range(3)]
    sides = [side for c in cyclic for side in (c, -c[::-1])]
    quads = 4 * np.arange(6)[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])
    return TriangleMesh(np.concatenate(sides) * half, quads.reshape(-1, 3))


def _arc(radius: float, half_length: float) -> tuple[Vector, Vector]:
    """Return radii and heights of half a circle, its middle stretched by a shaft."""
    angles = np.linspace(-np.pi / 2, np.pi / 2, SEGMENTS // 2 + 2)
    lower, upper = angles[angles <= 1e-9], angles[angles >= -1e-9]
    if half_length == 0.0:
        lower, upper = angles, angles[:0]
    radii = radius * np.cos(np.concatenate([lower, upper]))
    heights = radius * np.sin(np.concatenate([lower, upper]))
    return radii, heights + half_length * np.repeat([-1, 1], [len(lower), len(upper)])


def _lathe(radii: Vector, heights: Vector, scale: Vector) -> TriangleMesh:
    """Turn a profile around z; neighbouring rings share their vertices."""
    turn = np.linspace(0, 2 * np.pi, SEGMENTS, endpoint=False)
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    vertices = np.concatenate(
        [
            np.column_stack([r * ring, np.full(SEGMENTS, z)])
            for r, z in zip(radii, heights, strict=True)
        ]
    )
    return TriangleMesh(vertices * scale, _ring_faces(len(radii)))


def _ring_faces(rings: int) -> Indices:
    here = np.arange(SEGMENTS)
    there = np.roll(here, -1)
    band = np.concatenate(
        [
            np.stack([here, there, here + SEGMENTS], axis=1),
            np.stack([there, there + SEGMENTS, here + SEGMENTS], axis=1),
        ]
    )
    return np.concatenate([band + SEGMENTS * k for k in range(rings - 1)])


def _cylinder(radius: float, half: float) -> TriangleMesh:
    ones = np.ones(3)
    side = _lathe(np.full(2, radius), np.array([-half, half]), ones)
    top = _lathe(np.array([radius, 1e-6]), np.full(2, half), ones)
    bottom = _lathe(np.array([1e-6, radius]), np.full(2, -half), ones)
    return merge([side, top, bottom])


def _mesh(model: mujoco.MjModel, mesh: int) -> TriangleMesh:
    vertex, face = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
    return TriangleMesh(
        model.mesh_vert[vertex : vertex + model.mesh_vertnum[mesh]].astype(np.float64),
        model.mesh_face[face : face + model.mesh_facenum[mesh]].astype(np.int64),
    )
