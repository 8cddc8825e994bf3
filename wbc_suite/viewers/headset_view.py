"""What a headset displays of a session: meshes, poses, and how its hands follow."""

import json
import struct

import mujoco
import numpy as np

from wbc_suite.devices.action_ports import LimbKind, side_of
from wbc_suite.robot.triangle_meshes import TriangleMesh, merge
from wbc_suite.typing import Vector
from wbc_suite.viewers.model_scene import body_meshes
from wbc_suite.viewers.session_state import LimbStatus, Snapshot
from wbc_suite.viewers.status_text import pause_text
from wbc_suite.viewers.teleop_session import TeleopSession

CREASE = np.cos(np.deg2rad(40.0))  # faces that meet at a larger angle have an edge
AWAY, TURNED = 0.02, 0.15  # m, rad; a hand that holds an object is nearer than that
EYES = ("head", "robotview")  # in names of cameras
BEHIND = (-0.45, 0.0, 0.35)  # m, from hands to the eyes of a robot without camera
RED, AMBER, GREEN, GREY = "#b3362b", "#a86f00", "#1b7a49", "#3c4956"


class SessionView:
    """Display a session to a headset; implements `HeadsetView`.

    Attributes:
        scene: Meshes of all bodies, see `pages/headset/scene.js`.
    """

    def __init__(self, session: TeleopSession, title: str) -> None:
        self._session = session
        self._hands = [
            name
            for name, limb in session.info.limbs.items()
            if limb.kind is LimbKind.POSE and side_of(name) in ("right", "left")
        ]
        self._titles = {n: limb.title for n, limb in session.info.limbs.items()}
        self.scene = _scene(session, self._hands, title)

    def poses(self) -> bytes:
        """Return poses of bodies and targets: position, quaternion wxyz, float32."""
        snapshot = self._session.snapshot
        bodies = np.hstack([snapshot.body_positions, snapshot.body_quaternions])
        targets = [_pose(snapshot.limbs[name]) for name in self._hands]
        return np.vstack([bodies, *targets]).astype("<f4").tobytes()

    def status(self) -> str:
        """Return the state of each hand, and the most important message, as JSON."""
        snapshot = self._session.snapshot
        hands = {
            name: {"state": _state(snapshot, snapshot.limbs[name])}
            for name in self._hands
        }
        text, colour = self._message(snapshot)
        return json.dumps({"hands": hands, "text": text, "colour": colour})

    def _message(self, snapshot: Snapshot) -> tuple[str, str]:
        """Return a sentence for the user, possibly empty, and its colour."""
        if snapshot.message:
            return snapshot.message, RED
        if snapshot.fell:
            return f"The robot fell: {snapshot.fell}", RED
        if snapshot.success:
            return "Done: the task is solved", GREEN
        if snapshot.paused:
            return pause_text(snapshot), GREY
        for name in self._hands:
            limb = snapshot.limbs[name]
            if _state(snapshot, limb) == "unreachable":
                why = f": {limb.reasons[0]}" if limb.reasons else ""
                return f"{self._titles[name]} cannot follow{why}", RED
        for name in self._hands:
            if _state(snapshot, snapshot.limbs[name]) == "limited":
                return f"{self._titles[name]}: {snapshot.limbs[name].acting[0]}", AMBER
        return "" if snapshot.recording is None else snapshot.recording.message, GREY


def _state(snapshot: Snapshot, limb: LimbStatus) -> str:
    """Return a word for how a hand follows, the name of a colour of the page."""
    if snapshot.device or "clutch disengaged" in limb.acting:
        return "released"
    away = limb.position_error > AWAY or limb.orientation_error > TURNED
    if (not limb.reached and away) or "limited by the leash" in limb.acting:
        return "unreachable"
    return "limited" if limb.acting else "following"


def _pose(limb: LimbStatus) -> Vector:
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, limb.target.rotation.flatten())
    return np.concatenate([limb.target.translation, quat])


def _scene(session: TeleopSession, hands: list[str], title: str) -> bytes:
    """Return a length, a JSON header, and vertices, normals and faces of all meshes."""
    model, snapshot = session.model, session.snapshot
    names = [model.body(body).name for body in range(model.nbody)]
    root = next((b for b, n in enumerate(names) if n.startswith("robot0_")), 0)
    w, x, y, z = snapshot.body_quaternions[root]
    heading = float(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
    eye = _eye(session, hands) - snapshot.body_positions[root] * (1.0, 1.0, 0.0)
    meshes, blocks = [], []
    for (body, collision, colour), parts in body_meshes(model).items():
        if collision:
            continue
        vertices, normals, faces = creased(merge(parts))
        size = {"vertices": len(vertices), "faces": len(faces)}
        meshes.append({"body": body, "colour": colour, **size})
        blocks += [vertices.astype("<f4"), normals.astype("<f4"), faces.astype("<u4")]
    header = {
        "title": title,
        "bodies": model.nbody,
        "root": root,
        "heading": heading,
        "eye": eye.tolist(),
        "hands": hands,
        "meshes": meshes,
    }
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<I", len(text)) + text + b"".join(b.tobytes() for b in blocks)


def _eye(session: TeleopSession, hands: list[str]) -> Vector:
    """Return the place of the user's eyes: the robot's, or behind its hands."""
    model, snapshot = session.model, session.snapshot
    cameras = {model.camera(k).name: k for k in range(model.ncam)}
    for word in EYES:
        for name, camera in cameras.items():
            if name.startswith("robot0_") and word in name:
                body, offset = model.cam_bodyid[camera], np.empty(3)
                quat = snapshot.body_quaternions[body]
                mujoco.mju_rotVecQuat(offset, model.cam_pos[camera], quat)
                return snapshot.body_positions[body] + offset
    limbs = [snapshot.limbs[n] for n in hands] or list(snapshot.limbs.values())
    if not limbs:
        return np.array([-1.5, 0.0, 1.6])
    return np.mean([x.measured.translation for x in limbs], axis=0) + BEHIND


def creased(mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return vertices, normals (n, 3) and faces (m, 3) that are drawn with edges.

    Vertices at one place share a normal with the faces within 40 degrees of their own.
    """
    corners = mesh.vertices[mesh.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normals, axis=1, keepdims=True)
    kept = area[:, 0] > 1e-12  # others cannot be seen, and have no normal
    faces, corners, normals = mesh.faces[kept], corners[kept], normals[kept]
    units = normals / area[kept]
    _, place = np.unique(np.round(mesh.vertices, 6), axis=0, return_inverse=True)
    owner = np.repeat(np.arange(len(faces)), 3)  # face of each corner
    at = place[faces].ravel()  # place of each corner
    order = np.argsort(at, kind="stable")
    first, count = np.searchsorted(at[order], at), np.bincount(at)[at]
    smooth = np.zeros((len(at), 3))
    for k in range(int(count.max(initial=0))):  # the k-th face that meets a corner
        corner = np.flatnonzero(count > k)
        other = owner[order[first[corner] + k]]
        near = (units[other] * units[owner[corner]]).sum(axis=1) > CREASE
        smooth[corner[near]] += normals[other[near]]
    length = np.linalg.norm(smooth, axis=1, keepdims=True)
    smooth = np.where(length > 1e-15, smooth / np.maximum(length, 1e-15), units[owner])
    flat = np.hstack([corners.reshape(-1, 3), np.round(smooth, 3)])
    flat = np.round(flat, 6).astype(np.float32) + 0.0  # no -0, which is another number
    drawn, index = np.unique(flat, axis=0, return_inverse=True)
    return drawn[:, :3], drawn[:, 3:], index.reshape(-1, 3)
