"""A MuJoCo model as a scene in the browser.

Every body is a frame under its parent's frame, as in MuJoCo, and only relative poses
are sent: a hinge that turns is one message, whatever it carries.
"""

import math
from typing import TYPE_CHECKING, TypeAlias

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from wbc_suite.robot import triangle_meshes
from wbc_suite.robot.triangle_meshes import TriangleMesh
from wbc_suite.typing import Matrix, Vector

if TYPE_CHECKING:
    import viser

Rgba: TypeAlias = tuple[float, float, float, float]

COLLISION_GROUP = 3  # geoms of this group and above are collision geoms
TOLERANCE = 1e-4  # m, and quaternion units: 0.2 mm at a distance of 1 m
MARGIN = 0.2  # m, around a robot
DEFAULT_COLOR = (0.5, 0.5, 0.5, 1.0)
"""Of a geom without a colour of its own; its material's is drawn then."""


class ModelScene:
    """Draws the geoms of a model but planes, static ones included, and moves them.

    Attributes:
        nodes: Names of the bodies' scene nodes.
    """

    def __init__(self, server: "viser.ViserServer", model: mujoco.MjModel) -> None:
        self._server = server
        self._parents = model.body_parentid.copy()
        self.nodes = _node_names(model)
        self._frames = [server.scene.add_frame(n, show_axes=False) for n in self.nodes]
        self._shown = np.tile([0.0, 0, 0, 1, 0, 0, 0], (model.nbody, 1))
        self.collision_shapes: list[viser.MeshHandle] = []
        self.visual_shapes: list[viser.MeshHandle] = []
        for (body, collision, colour), parts in body_meshes(model).items():
            shapes = self.collision_shapes if collision else self.visual_shapes
            kind = "collision" if collision else "visual"
            mesh = triangle_meshes.merge(parts)
            handle = server.scene.add_mesh_simple(
                f"{self.nodes[body]}/{kind}_{len(shapes)}",
                mesh.vertices,
                mesh.faces,
                color=tuple(round(255 * c) for c in colour[:3]),  # type: ignore[arg-type]
                opacity=0.35 if collision else (colour[3] if colour[3] < 1 else None),
                cast_shadow=not collision,
                visible=not collision,
            )
            shapes.append(handle)

    def update(self, positions: Matrix, quaternions: Matrix) -> int:
        """Send the poses that changed since the last call; return their number.

        Positions of all bodies in the world have shape (nbody, 3), their orientations
        (wxyz) shape (nbody, 4). A position and an orientation count as two.
        """
        poses = relative_poses(positions, quaternions, self._parents)
        change = np.abs(poses - self._shown)
        moved = np.flatnonzero(change[:, :3].max(axis=1) > TOLERANCE)
        turned = np.flatnonzero(change[:, 3:].max(axis=1) > TOLERANCE)
        with self._server.atomic():
            for body in moved:
                self._frames[body].position = poses[body, :3]
            for body in turned:
                self._frames[body].wxyz = poses[body, 3:]
        self._shown[moved, :3] = poses[moved, :3]
        self._shown[turned, 3:] = poses[turned, 3:]
        return len(moved) + len(turned)


def relative_poses(
    positions: Matrix, quaternions: Matrix, parents: np.ndarray
) -> Matrix:
    """Return position and quaternion of every body in its parent's frame, shape (n, 7).

    Quaternions are wxyz, with w >= 0. Positions and orientations (wxyz) in the world
    have shapes (n, 3) and (n, 4), indices of parents (n,); the world is its own parent.
    """
    rotations = Rotation.from_quat(quaternions, scalar_first=True)
    to_parents = rotations[parents].inv()
    local = to_parents.apply(positions - positions[parents])
    wxyz = (to_parents * rotations).as_quat(canonical=True, scalar_first=True)
    return np.concatenate([local, wxyz], axis=1)


def robot_box(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Vector, Vector]:
    """Return two corners of a box around the first robot, with a margin, m.

    Robots in a scene carry the prefix `robot0_`; a model without it is all robot.
    """
    names = [model.body(body).name for body in range(model.nbody)]
    prefix = "robot0_" if any(n.startswith("robot0_") for n in names) else ""
    corners = subject_corners(model, data, prefix)
    return corners.min(axis=0) - MARGIN, corners.max(axis=0) + MARGIN


def subject_corners(
    model: mujoco.MjModel, data: mujoco.MjData, subject: str = ""
) -> Matrix:
    """Return the corners of all geoms' boxes in the world, shape (n, 3); no planes.

    Only bodies whose names start with the subject count. One without geoms is a point.
    """
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
    names = [model.body(body).name for body in model.geom_bodyid]
    seen = np.array([name.startswith(subject) for name in names], dtype=bool)
    seen &= model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE
    seen &= model.geom_group < COLLISION_GROUP
    if not seen.any():
        own = [model.body(b).name.startswith(subject) for b in range(model.nbody)]
        return data.xpos[own]
    centre, half = model.geom_aabb[seen, :3], model.geom_aabb[seen, 3:]
    local = centre[:, None] + signs * half[:, None]
    rotation = data.geom_xmat[seen].reshape(-1, 3, 3)
    world = data.geom_xpos[seen, None] + local @ rotation.transpose(0, 2, 1)
    return world.reshape(-1, 3)


def _node_names(model: mujoco.MjModel) -> list[str]:
    names = ["/world"]
    for body in range(1, model.nbody):
        own = model.body(body).name.replace("/", "_") or f"body_{body}"
        names.append(f"{names[model.body_parentid[body]]}/{own}")
    return names


def body_meshes(
    model: mujoco.MjModel,
) -> dict[tuple[int, bool, tuple[float, ...]], list[TriangleMesh]]:
    """Return the meshes by body, kind and colour; each group becomes one mesh."""
    parts: dict[tuple[int, bool, tuple[float, ...]], list[TriangleMesh]] = {}
    for geom in range(model.ngeom):
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
        collision = bool(model.geom_group[geom] >= COLLISION_GROUP)
        for rgba, mesh in colored_meshes(model, geom):
            if rgba[3] > 0.0:
                placed = mesh.moved(model.geom_pos[geom], rotation.reshape(3, 3))
                key = int(model.geom_bodyid[geom]), collision, rgba
                parts.setdefault(key, []).append(placed)
    return parts


def geom_mesh(model: mujoco.MjModel, geom: int) -> TriangleMesh | None:
    """Return the mesh of a geom in its own frame; None for planes and others."""
    size = model.geom_size[geom]
    match model.geom_type[geom]:
        case mujoco.mjtGeom.mjGEOM_BOX:
            return triangle_meshes.box_mesh(size)
        case mujoco.mjtGeom.mjGEOM_SPHERE:
            return triangle_meshes.ellipsoid_mesh(np.full(3, size[0]))
        case mujoco.mjtGeom.mjGEOM_ELLIPSOID:
            return triangle_meshes.ellipsoid_mesh(size)
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            return triangle_meshes.capsule_mesh(size[0], size[1])
        case mujoco.mjtGeom.mjGEOM_CYLINDER:
            return triangle_meshes.cylinder_mesh(size[0], size[1])
        case mujoco.mjtGeom.mjGEOM_MESH:
            asset = model.mesh(model.geom_dataid[geom])
            vertex, face = asset.vertadr[0], asset.faceadr[0]
            return TriangleMesh(
                model.mesh_vert[vertex : vertex + asset.vertnum[0]].astype(np.float64),
                model.mesh_face[face : face + asset.facenum[0]].astype(np.int64),
            )
    return None


def colored_meshes(model: mujoco.MjModel, geom: int) -> list[tuple[Rgba, TriangleMesh]]:
    """Return the meshes of a geom in its own frame, one for each of its colours.

    Links have several colours from a palette, which is a texture of one row. Other
    textures are drawn in their mean colour times the geom's own.
    """
    mesh, material = geom_mesh(model, geom), int(model.geom_matid[geom])
    if mesh is None:
        return []
    rgba, pixels = model.geom_rgba[geom], _pixels_of(model, material)
    if material >= 0 and np.array_equal(rgba, DEFAULT_COLOR):
        rgba = model.mat_rgba[material]
    if pixels is None:
        return [(_rgba(rgba), mesh)]
    if len(pixels) > 1 or model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_MESH:
        mean = pixels.mean(axis=(0, 1)) / 255.0
        return [(_rgba([*(mean * rgba[:3]), rgba[3]]), mesh)]
    data, palette = int(model.geom_dataid[geom]), pixels[0]
    first, start = model.mesh_faceadr[data], model.mesh_texcoordadr[data]
    corner = model.mesh_facetexcoord[first : first + len(mesh.faces), 0]
    column = (model.mesh_texcoord[start + corner, 0] * len(palette)).astype(np.int64)
    found = []
    for k in np.unique(column):  # the faces of one colour, and the vertices they use
        used, faces = np.unique(mesh.faces[column == k], return_inverse=True)
        part = TriangleMesh(mesh.vertices[used], faces.reshape(-1, 3))
        found.append((_rgba([*palette[k] / 255.0, rgba[3]]), part))
    return found


def _rgba(values: np.ndarray | list[float]) -> Rgba:
    red, green, blue, alpha = map(float, values)
    return red, green, blue, alpha


def _pixels_of(model: mujoco.MjModel, material: int) -> np.ndarray | None:
    """Return the texture of a material, shape (height, width, 3)."""
    role = mujoco.mjtTextureRole.mjTEXROLE_RGB
    texture = -1 if material < 0 else int(model.mat_texid[material, role])
    if texture < 0 or model.tex_nchannel[texture] != 3:
        return None
    first = model.tex_adr[texture]
    shape = int(model.tex_height[texture]), int(model.tex_width[texture]), 3
    return model.tex_data[first : first + math.prod(shape)].reshape(shape)
