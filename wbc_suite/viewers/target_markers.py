"""Markers of targets: a translucent copy of each limb, a line and a label."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.robot.triangle_meshes import TriangleMesh, ellipsoid_mesh, merge
from wbc_suite.viewers.model_scene import COLLISION_GROUP, geom_mesh
from wbc_suite.viewers.scene_setup import Colour, place
from wbc_suite.viewers.session_state import SessionInfo, Snapshot

if TYPE_CHECKING:
    import viser

LEAST_MARKED = 0.012  # m; a copy nearer than this to its limb would only tint it
TURNED = 0.12  # rad
ABOVE = np.array([0.0, 0.0, 0.12])  # m, from the target to its label
BALL = 0.04  # m, radius of the marker of a frame without geoms


class TargetMarkers:
    """A translucent copy of each limb at its target, with a line to the limb.

    Copies are taken in the posture of `snapshot`, the state at the start.
    """

    def __init__(
        self,
        server: "viser.ViserServer",
        info: SessionInfo,
        snapshot: Snapshot,
        colours: Mapping[str, Colour],
    ) -> None:
        self._markers: dict[str, tuple[Any, Any, Any]] = {}
        for name in info.limbs:
            mesh = _copy(info, name, snapshot)
            node = server.scene.add_mesh_simple(
                f"/targets/{name}",
                mesh.vertices,
                mesh.faces,
                color=colours[name],
                opacity=0.38,
                cast_shadow=False,
                receive_shadow=False,
                visible=False,
            )
            line = server.scene.add_line_segments(
                f"/target_lines/{name}",
                np.zeros((1, 2, 3), dtype=np.float32),
                colors=colours[name],
                thickness=0.006,
                visible=False,
            )
            label = server.scene.add_label(
                f"/target_labels/{name}", "", anchor="bottom-center", visible=False
            )
            self._markers[name] = node, line, label

    def update(self, snapshot: Snapshot, notes: Mapping[str, str]) -> None:
        """Move the markers; `notes` are the labels of limbs, possibly empty."""
        for name, status in snapshot.limbs.items():
            node, line, label = self._markers[name]
            line.visible = status.position_error > LEAST_MARKED
            node.visible = line.visible or status.orientation_error > TURNED
            if node.visible:
                place(node, status.target)
            if line.visible:
                ends = status.measured.translation, status.target.translation
                line.points = np.array([ends], dtype=np.float32)
            text = notes.get(name, "")
            label.visible = bool(text)
            if text:
                label.text = text
                label.position = status.target.translation + ABOVE


def _copy(info: SessionInfo, name: str, snapshot: Snapshot) -> TriangleMesh:
    """Return the mesh of a limb in its controlled frame."""
    others = {limb.body for limb in info.limbs.values() if limb.name != name}
    model, parts = info.model, []
    chosen = _own_bodies(model, info.limbs[name].body, others)
    T_limb_world = snapshot.limbs[name].measured.inverse()
    for geom in range(model.ngeom):
        body, mesh = model.geom_bodyid[geom], geom_mesh(model, geom)
        is_visual = model.geom_group[geom] < COLLISION_GROUP
        if body in chosen and is_visual and mesh is not None:
            turn = pin.Quaternion(*model.geom_quat[geom])
            T_body_geom = pin.SE3(turn, model.geom_pos[geom])
            turn = pin.Quaternion(*snapshot.body_quaternions[body])
            T_world_body = pin.SE3(turn, snapshot.body_positions[body])
            T = T_limb_world * T_world_body * T_body_geom
            parts.append(mesh.moved(T.translation, T.rotation))
    return merge(parts) if parts else ellipsoid_mesh(np.full(3, BALL))


def _own_bodies(model: mujoco.MjModel, root: int, others: set[int]) -> set[int]:
    """Return a limb's bodies: its subtree, unless another limb is part of it."""
    if root < 0:
        return set()
    carried = {root}
    for body in range(root + 1, model.nbody):
        if model.body_parentid[body] in carried:
            carried.add(body)
    return {root} if carried & others else carried
