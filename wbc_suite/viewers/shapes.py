"""Triangle meshes of MuJoCo's geometries, for a page to draw."""

import math

import mujoco
import numpy as np

from wbc_suite.robot.triangles import (
    TriangleMesh,
    box_mesh,
    capsule_mesh,
    cylinder_mesh,
    ellipsoid_mesh,
    merge,
)

__all__ = ["Rgba", "TriangleMesh", "colored_meshes", "geom_mesh", "merge"]

Rgba = tuple[float, float, float, float]

DEFAULT_COLOR = (0.5, 0.5, 0.5, 1.0)
"""Of a geometry that says none; its material's counts then."""


def geom_mesh(model: mujoco.MjModel, geom: int) -> TriangleMesh | None:
    """Return a geometry in its own frame; None for planes and what has no surface."""
    size = model.geom_size[geom]
    match model.geom_type[geom]:
        case mujoco.mjtGeom.mjGEOM_BOX:
            return box_mesh(size)
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            return ellipsoid_mesh(np.full(3, size[0]))
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            return ellipsoid_mesh(size)
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            return capsule_mesh(size[0], size[1])
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            return cylinder_mesh(size[0], size[1])
        case mujoco.mjtGeom.mjGEOM_MESH:
            return _mesh(model, int(model.geom_dataid[geom]))
        case _:
            return None


def colored_meshes(model: mujoco.MjModel, geom: int) -> list[tuple[Rgba, TriangleMesh]]:
    """Return a geometry in its own frame, one mesh for each of its colours.

    Links have several, from a palette: a picture of one row. Of other pictures the mean
    colour is shown, times the geometry's own.
    """
    mesh, material = geom_mesh(model, geom), int(model.geom_matid[geom])
    if mesh is None:
        return []
    rgba, pixels = _color_of(model, geom), _pixels_of(model, material)
    if pixels is None:
        return [(_rgba(rgba), mesh)]
    if len(pixels) > 1 or model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_MESH:
        mean = pixels.mean(axis=(0, 1)) / 255.0
        return [(_rgba([*(mean * rgba[:3]), rgba[3]]), mesh)]
    data, palette = int(model.geom_dataid[geom]), pixels[0]
    first, start = model.mesh_faceadr[data], model.mesh_texcoordadr[data]
    corner = model.mesh_facetexcoord[first : first + len(mesh.faces), 0]
    column = (model.mesh_texcoord[start + corner, 0] * len(palette)).astype(np.int64)
    return [
        (_rgba([*palette[k] / 255.0, rgba[3]]), _part(mesh, column == k))
        for k in np.unique(column)
    ]


def _color_of(model: mujoco.MjModel, geom: int) -> np.ndarray:
    """Return the colour that MuJoCo draws with: its own, unless it has the default."""
    own, material = model.geom_rgba[geom], model.geom_matid[geom]
    is_default = material >= 0 and np.array_equal(own, DEFAULT_COLOR)
    return model.mat_rgba[material] if is_default else own


def _rgba(values: np.ndarray | list[float]) -> Rgba:
    red, green, blue, alpha = map(float, values)
    return red, green, blue, alpha


def _pixels_of(model: mujoco.MjModel, material: int) -> np.ndarray | None:
    """Return the picture of a material, shape (height, width, 3)."""
    role = mujoco.mjtTextureRole.mjTEXROLE_RGB
    texture = -1 if material < 0 else int(model.mat_texid[material, role])
    if texture < 0 or model.tex_nchannel[texture] != 3:
        return None
    first = model.tex_adr[texture]
    shape = int(model.tex_height[texture]), int(model.tex_width[texture]), 3
    return model.tex_data[first : first + math.prod(shape)].reshape(shape)


def _part(mesh: TriangleMesh, chosen: np.ndarray) -> TriangleMesh:
    """Return some faces of a mesh, with their own vertices only."""
    used, faces = np.unique(mesh.faces[chosen], return_inverse=True)
    return TriangleMesh(mesh.vertices[used], faces.reshape(-1, 3))


def _mesh(model: mujoco.MjModel, mesh: int) -> TriangleMesh:
    vertex, face = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
    return TriangleMesh(
        model.mesh_vert[vertex : vertex + model.mesh_vertnum[mesh]].astype(np.float64),
        model.mesh_face[face : face + model.mesh_facenum[mesh]].astype(np.int64),
    )
