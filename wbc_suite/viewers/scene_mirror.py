"""A MuJoCo model as a scene in the browser, kept up to date at little cost.

Every body is a frame under its parent's frame, as in MuJoCo, and only the poses
between the two travel: a hinge that turns is one message, and the hand, the fingers
and the tools that it carries are none. What moved is found by one comparison over all
bodies.
"""

from typing import TYPE_CHECKING

import mujoco
import numpy as np

from wbc_suite.typing import Matrix, Vector
from wbc_suite.viewers.shapes import TriangleMesh, colored_meshes, merge

if TYPE_CHECKING:
    import viser

__all__ = ["COLLISION_GROUP", "SceneMirror", "relative_poses", "robot_box"]

COLLISION_GROUP = 3  # geometries of this group and above are not for the eye
TOLERANCE = 1e-4  # m, and quaternion units: 0.2 mm at the end of a metre


class SceneMirror:
    """Draws a model's geometries and moves them.

    Args:
        server: Server whose scene is drawn on.
        model: Model to draw; static geometries are drawn too, planes are not.
        root: Name of the scene node that holds everything.
    """

    def __init__(
        self, server: "viser.ViserServer", model: mujoco.MjModel, root: str = "/world"
    ) -> None:
        self._server = server
        self._parents = model.body_parentid.copy()
        self._names = _node_names(model, root)
        self._frames = [
            server.scene.add_frame(name, show_axes=False) for name in self._names
        ]
        self._shown = np.tile([0.0, 0, 0, 1, 0, 0, 0], (model.nbody, 1))
        self.collision_shapes: list[viser.MeshHandle] = []
        self.visual_shapes: list[viser.MeshHandle] = []
        for (body, collision, colour), parts in _parts(model).items():
            self._add_mesh(body, collision, colour, merge(parts))

    def node(self, body: int) -> str:
        """Return the name of the scene node that a body's frame has."""
        return self._names[body]

    def update(self, positions: Matrix, quaternions: Matrix) -> int:
        """Send the poses that changed since the last call.

        Args:
            positions: Positions of all bodies in the world, shape (nbody, 3).
            quaternions: Their orientations (wxyz), shape (nbody, 4).

        Returns:
            How many positions and orientations were sent.
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

    def _add_mesh(
        self,
        body: int,
        collision: bool,
        colour: tuple[float, ...],
        mesh: TriangleMesh,
    ) -> None:
        shapes = self.collision_shapes if collision else self.visual_shapes
        kind = "collision" if collision else "visual"
        handle = self._server.scene.add_mesh_simple(
            f"{self._names[body]}/{kind}_{len(shapes)}",
            mesh.vertices,
            mesh.faces,
            color=tuple(round(255 * c) for c in colour[:3]),  # type: ignore[arg-type]
            opacity=0.35 if collision else (colour[3] if colour[3] < 1 else None),
            cast_shadow=not collision,
            visible=not collision,
        )
        shapes.append(handle)


def relative_poses(
    positions: Matrix, quaternions: Matrix, parents: np.ndarray
) -> Matrix:
    """Return the pose of every body in its parent's frame.

    Args:
        positions: Positions in the world, shape (n, 3).
        quaternions: Orientations in the world (wxyz), shape (n, 4).
        parents: Index of each body's parent, shape (n,); the world is its own.

    Returns:
        Position and quaternion (wxyz, w >= 0) side by side, shape (n, 7).
    """
    w, xyz = quaternions[parents, :1], -quaternions[parents, 1:]  # inverse rotation
    offset = positions - positions[parents]
    cross = np.cross(xyz, offset)
    local = offset + 2.0 * (w * cross + np.cross(xyz, cross))
    w_b, xyz_b = quaternions[:, :1], quaternions[:, 1:]
    real = w * w_b - np.sum(xyz * xyz_b, axis=1, keepdims=True)
    imaginary = w * xyz_b + w_b * xyz + np.cross(xyz, xyz_b)
    sign = np.where(real < 0.0, -1.0, 1.0)
    return np.concatenate([local, sign * real, sign * imaginary], axis=1)


def robot_box(
    model: mujoco.MjModel, positions: Matrix, quaternions: Matrix
) -> tuple[Vector, Vector]:
    """Return two corners, in m, of a box around the first robot.

    Robots in a scene carry the prefix `robot0_`; a model without it is all robot.

    Args:
        model: Model with at least one geometry that is not a plane.
        positions: Positions of all bodies in the world, shape (nbody, 3).
        quaternions: Their orientations (wxyz), shape (nbody, 4).
    """
    bodies = [model.body(body).name for body in range(model.nbody)]
    prefix = "robot0_" if any(n.startswith("robot0_") for n in bodies) else ""
    corners = []
    reach = np.abs(model.geom_aabb[:, :3]) + model.geom_aabb[:, 3:]
    radii = np.linalg.norm(reach, axis=1)
    for geom in np.flatnonzero(model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE):
        body, radius = model.geom_bodyid[geom], radii[geom]
        if body == 0 or not bodies[body].startswith(prefix):
            continue
        place = np.empty(3)
        mujoco.mju_rotVecQuat(place, model.geom_pos[geom], quaternions[body])
        corners.append(positions[body] + place + np.array([[-radius], [radius]]))
    box = np.array(corners)
    return box[:, 0].min(axis=0), box[:, 1].max(axis=0)


def _node_names(model: mujoco.MjModel, root: str) -> list[str]:
    names = [root]
    for body in range(1, model.nbody):
        own = model.body(body).name.replace("/", "_") or f"body_{body}"
        names.append(f"{names[model.body_parentid[body]]}/{own}")
    return names


def _parts(
    model: mujoco.MjModel,
) -> dict[tuple[int, bool, tuple[float, ...]], list[TriangleMesh]]:
    """Return the meshes of each body, kind and colour: each becomes one mesh."""
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
