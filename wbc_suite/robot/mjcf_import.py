"""Read an MJCF file into a robot description."""

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.errors import DescriptionError, join_first
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.importing import LinkFields, NameTable, describe_import
from wbc_suite.robot.inertia import inertia_fields
from wbc_suite.robot.mjcf_compile import compile_mjcf
from wbc_suite.robot.mjcf_export import SENSOR_TYPES
from wbc_suite.robot.mjcf_import_elements import read_actuators, read_shapes
from wbc_suite.robot.poses import joint_motion, pose_at, pose_fields
from wbc_suite.typing import Vector

LOG = logging.getLogger(__name__)

DUMMY = {"mass": 1e-9, "inertia": (1e-13, 1e-13, 1e-13, 0.0, 0.0, 0.0)}
"""Negligible mass and inertia of the links between the joints of one body."""
FREE, BALL = mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL
SLIDE, HINGE = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
SENSOR_KINDS = {int(code): kind for kind, code in SENSOR_TYPES.items()}
"""Kinds of sensors by the numbers of a compiled model."""


def read_mjcf(path: Path | str) -> RobotDescription:
    """Read an MJCF file.

    MuJoCo compiles it. Bodies become links, sites become frames, joint equalities
    become mimic joints, meshes become convex hulls. A body with several joints becomes
    a chain with links of a microgram. Items of the world body (floors, lights) are
    ignored. Groups and end effectors are inferred; `to_toml()` writes the result for
    editing.

    Raises:
        ConfigError: If the file is not MJCF, or refers to files outside its folder.
        DescriptionError: If it has elements that our format does not support, such as
            ball joints, springs or flexible parts, or is unphysical.
    """
    path = Path(path)
    m, _ = compile_mjcf(path)
    faults = list(_faults(m))
    if faults:
        shown = join_first(faults, separator="; ")
        raise DescriptionError(f"{path}: not supported: {shown}.")
    return _Importer(m).robot(path)


def _faults(m: mujoco.MjModel) -> Iterator[str]:
    """Yield elements that the format does not support and that change the dynamics."""
    roots = _world_children(m)
    for j in range(m.njnt):
        name, kind = f"joint '{_joint_name(m, j)}'", m.jnt_type[j]
        if kind == BALL:
            yield f"{name} is a ball joint (use three hinges)"
        elif kind == FREE and len(roots) > 1:
            yield f"{name} is free, but there are several root bodies"
        elif m.jnt_stiffness[j].any():
            yield f"{name} has a spring (stiffness)"
    if m.nflex:
        yield "the model has flexible parts (flex)"
    if not roots:
        yield "the model has no body"
    if m.body_gravcomp.any():
        yield "the model has gravity compensation (gravcomp)"
    yield from _tendon_faults(m)
    yield from _equality_faults(m)


def _tendon_faults(m: mujoco.MjModel) -> Iterator[str]:
    acting = ("stiffness", "damping", "frictionloss", "limited", "armature")
    for t in range(m.ntendon):
        name = m.tendon(t).name or f"number {t}"
        if any(np.any(getattr(m, f"tendon_{key}")[t]) for key in acting):
            yield f"tendon '{name}' has forces"
        else:
            LOG.warning("Tendon '%s' is ignored.", name)


def _equality_faults(m: mujoco.MjModel) -> Iterator[str]:
    for e in range(m.neq):
        name = f"equality '{m.equality(e).name or e}'"
        kind, data = m.eq_type[e], m.eq_data[e]
        if kind == mujoco.mjtEq.mjEQ_JOINT:
            if m.eq_obj2id[e] < 0 or data[2:5].any():
                yield f"{name} is not linear in another joint"
        elif kind != mujoco.mjtEq.mjEQ_CONNECT or (
            m.eq_objtype[e] != mujoco.mjtObj.mjOBJ_BODY
        ):
            yield f"{name} is neither a joint equality nor a connect of two bodies"


def _world_children(m: mujoco.MjModel) -> list[int]:
    return [b for b in range(1, m.nbody) if m.body_parentid[b] == 0]


def _joint_name(m: mujoco.MjModel, j: int) -> str:
    return m.joint(j).name or f"joint{j}"


class _Importer:
    """Converts one compiled model to the fields of a description."""

    def __init__(self, m: mujoco.MjModel) -> None:
        self._m = m
        self._names = NameTable()
        self._bodies: dict[int, str] = {}
        self._joints: dict[int, str] = {}
        self._sites: dict[int, str] = {}
        self._offsets: dict[int, Vector] = {0: np.zeros(3)}
        self._mimics = dict(self._followers())

    def robot(self, path: Path) -> RobotDescription:
        m = self._m
        root, rooted = self._root()
        for b in range(1, m.nbody):
            original = m.body(b).name or f"body{b}"
            self._bodies[b] = self._names.take(original, "link")
        # The joints of the root come first.
        for j in range(int(m.body_jntnum[rooted or 0]), m.njnt):
            self._joints[j] = self._names.take(_joint_name(m, j), "joint")
        efforts, actuators = read_actuators(m, self._joints)
        links: list[LinkFields] = []
        if rooted is None:
            self._bodies[0] = self._names.take("base_link", "link")
            links.append({"name": self._bodies[0]})
        for b in range(1, m.nbody):
            links += self._links(b, first=b == rooted, efforts=efforts)
        keyframes = self._keyframes()
        if "home" in keyframes:
            keyframes.setdefault("ready", keyframes["home"])
        return describe_import(
            name=m.names[: m.names.index(b"\0")].decode() or path.stem,
            source=path,
            root=root,
            links=links,
            frames=list(self._frames()),
            names=self._names,
            keyframes=keyframes,
            cameras=list(self._cameras()),
            sensors=list(self._sensors()),
            actuators=actuators,
            connects=list(self._connects()),
            contacts={"exclude": list(self._excludes())},
        )

    def _root(self) -> tuple[dict[str, Any], int | None]:
        """Return the fields of the root and its body; None if the world is the root."""
        m, bodies = self._m, _world_children(self._m)
        b = bodies[0]
        count = int(m.body_jntnum[b])
        pose = pose_fields(pose_at(m.body_pos[b], m.body_quat[b]))
        if len(bodies) == 1 and count == 0:
            return {"kind": "fixed", **pose}, b
        if len(bodies) == 1 and m.jnt_type[0] == FREE:
            return {"kind": "free", **pose}, b
        if len(bodies) == 1 and count == 3 and self._is_planar():
            damping = [float(m.dof_damping[0]), float(m.dof_damping[2])]
            driven = {int(j) for j in m.actuator_trnid[:, 0]}
            fields = {"kind": "planar", "damping": damping, "actuated": 0 in driven}
            return fields | pose, b
        return {"kind": "fixed"}, None

    def _is_planar(self) -> bool:
        m = self._m
        kinds = [int(kind) for kind in m.jnt_type[:3]]
        still = not m.jnt_pos[:3].any() and not m.qpos0[:3].any()
        free = not m.jnt_limited[:3].any()
        axes = np.array_equal(m.jnt_axis[:3], np.eye(3))
        return kinds == [SLIDE, SLIDE, HINGE] and axes and still and free

    def _links(
        self, b: int, *, first: bool, efforts: dict[int, float]
    ) -> Iterator[LinkFields]:
        """Yield the link of a body, after the dummy links between its joints."""
        m = self._m
        body: LinkFields = {"name": self._bodies[b]}
        parent = int(m.body_parentid[b])
        pose = pose_at(m.body_pos[b] + self._offsets[parent], m.body_quat[b])
        start, count = int(m.body_jntadr[b]), int(m.body_jntnum[b])
        joints = [] if first else list(range(start, start + count))
        above, origin = self._bodies.get(parent), np.zeros(3)
        for j in joints:
            anchor = np.array(m.jnt_pos[j])
            motion = joint_motion(
                m.jnt_axis[j], -_zero(m, j), slide=bool(m.jnt_type[j] == SLIDE)
            )
            step = pin.SE3(np.eye(3), anchor - origin) * motion
            last = j == joints[-1]
            name = body["name"]
            if not last:
                name = self._names.take(f"{name}_{self._joints[j]}", "link")
            fields = {
                "name": name,
                "parent": above,
                **pose_fields(pose * step),
                "joint": self._joint(j, efforts),
            }
            pose, above, origin = pin.SE3.Identity(), name, anchor
            if last:
                body |= fields
            else:
                yield fields | DUMMY
        if not joints and not first:
            body |= {"parent": above, **pose_fields(pose)}
        self._offsets[b] = -origin
        yield body | self._inertia(b) | read_shapes(m, b, -origin)

    def _joint(self, j: int, efforts: dict[int, float]) -> dict[str, Any]:
        m = self._m
        v = int(m.jnt_dofadr[j])
        fields: dict[str, Any] = {
            "name": self._joints[j],
            "type": "slide" if m.jnt_type[j] == SLIDE else "hinge",
            "axis": m.jnt_axis[j].tolist(),
            "armature": float(m.dof_armature[v]),
            "damping": float(m.dof_damping[v].ravel()[0]),
            "frictionloss": float(m.dof_frictionloss[v]),
        }
        if m.jnt_limited[j]:
            fields["range"] = m.jnt_range[j].tolist()
        if efforts.get(j, 0.0) > 0.0:
            fields["effort"] = efforts[j]
        if j in self._mimics:
            leader, ratio, offset = self._mimics[j]
            fields["mimic"] = {
                "joint": self._joints[leader],
                "ratio": ratio,
                "offset": offset,
            }
        return fields

    def _followers(self) -> Iterator[tuple[int, tuple[int, float, float]]]:
        """Yield joint, leader, ratio, offset: q - q0 = c0 + c1 (p - p0)."""
        m = self._m
        for e in range(m.neq):
            if m.eq_type[e] == mujoco.mjtEq.mjEQ_JOINT and m.eq_active0[e]:
                own, leader = int(m.eq_obj1id[e]), int(m.eq_obj2id[e])
                shift, ratio = (float(c) for c in m.eq_data[e, :2])
                offset = shift + _zero(m, own) - ratio * _zero(m, leader)
                yield own, (leader, ratio, offset)

    def _inertia(self, b: int) -> dict[str, Any]:
        m = self._m
        if m.body_mass[b] == 0.0:
            return {}
        pose = pose_at(m.body_ipos[b] + self._offsets[b], m.body_iquat[b])
        R = pose.rotation
        return {
            "mass": float(m.body_mass[b]),
            "com": pose.translation.tolist(),
            "inertia": inertia_fields(R @ np.diag(m.body_inertia[b]) @ R.T),
        }

    def _placed(self, body: int, pos: Vector, quat: Vector) -> dict[str, Any]:
        pose = pose_at(pos + self._offsets[body], quat)
        return {"link": self._bodies[body], **pose_fields(pose)}

    def _frames(self) -> Iterator[dict[str, Any]]:
        m = self._m
        for s in range(m.nsite):
            body, name = int(m.site_bodyid[s]), m.site(s).name
            if name and body in self._bodies:
                placed = self._placed(body, m.site_pos[s], m.site_quat[s])
                self._sites[s] = self._names.take(name, "frame")
                yield {"name": self._sites[s], **placed}

    def _cameras(self) -> Iterator[dict[str, Any]]:
        m, names = self._m, NameTable()
        for c in range(m.ncam):
            body = int(m.cam_bodyid[c])
            if body in self._bodies and m.cam_mode[c] == 0:
                placed = self._placed(body, m.cam_pos[c], m.cam_quat[c])
                name = names.take(m.camera(c).name or f"camera{c}", "camera")
                yield {"name": name, "fovy": float(m.cam_fovy[c]), **placed}

    def _sensors(self) -> Iterator[dict[str, Any]]:
        m, names = self._m, NameTable()
        for s in range(m.nsensor):
            kind, site = SENSOR_KINDS.get(int(m.sensor_type[s])), int(m.sensor_objid[s])
            if kind and site in self._sites:
                name = names.take(m.sensor(s).name or f"sensor{s}", "sensor")
                yield {"name": name, "kind": kind, "frame": self._sites[site]}

    def _connects(self) -> Iterator[dict[str, Any]]:
        m = self._m
        for e in range(m.neq):
            if m.eq_type[e] == mujoco.mjtEq.mjEQ_CONNECT:
                first, second = int(m.eq_obj1id[e]), int(m.eq_obj2id[e])
                anchor = m.eq_data[e, :3] + self._offsets[first]
                yield {
                    "link": self._bodies[first],
                    "other": self._bodies[second],
                    "anchor": anchor.tolist(),
                }

    def _excludes(self) -> Iterator[tuple[str, str]]:
        for signature in self._m.exclude_signature:
            pair = divmod(int(signature), 1 << 16)
            if all(b in self._bodies for b in pair):
                yield self._bodies[pair[0]], self._bodies[pair[1]]

    def _keyframes(self) -> dict[str, dict[str, float]]:
        """Return the postures, with values clipped to their ranges."""
        m, found, names = self._m, dict[str, dict[str, float]](), NameTable()
        for k in range(m.nkey):
            values: dict[str, float] = {}
            for j, name in self._joints.items():
                if j not in self._mimics:
                    value = float(m.key_qpos[k, m.jnt_qposadr[j]])
                    low, high = m.jnt_range[j].tolist()
                    limited = bool(m.jnt_limited[j])
                    values[name] = min(max(value, low), high) if limited else value
            found[names.take(m.key(k).name or f"key{k}", "keyframe")] = values
        return found


def _zero(m: mujoco.MjModel, j: int) -> float:
    """Return the joint value at which the body poses are defined (`ref`)."""
    return float(m.qpos0[m.jnt_qposadr[j]])
