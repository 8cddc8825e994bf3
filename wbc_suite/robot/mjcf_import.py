"""Read an MJCF file into a robot description."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite import logs
from wbc_suite.errors import DescriptionError, join_first
from wbc_suite.robot.adopt.contact_pairs import exclude_contacts
from wbc_suite.robot.adopt.importing import (
    UNLIMITED_RANGE,
    LinkFields,
    NameTable,
    describe_import,
)
from wbc_suite.robot.description import RobotDescription
from wbc_suite.robot.inertia import inertia_fields
from wbc_suite.robot.mjcf_compile import compile_mjcf
from wbc_suite.robot.mjcf_export import SENSOR_TYPES
from wbc_suite.robot.mjcf_import_constraints import (
    not_represented,
    read_connects,
    read_followers,
    read_tendons,
    zero_of,
)
from wbc_suite.robot.mjcf_import_elements import (
    read_actuators,
    read_excludes,
    read_keyframes,
    read_shapes,
    read_skin,
)
from wbc_suite.robot.poses import joint_motion, pose_at, pose_fields
from wbc_suite.robot.shapes import Drawn
from wbc_suite.typing import Vector

LOG = logs.logger(__name__)

DUMMY = {"mass": 1e-10, "inertia": (1e-13, 1e-13, 1e-13, 0.0, 0.0, 0.0)}
"""Negligible mass and inertia of the links between the joints of one body."""
FREE, BALL = mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL
SLIDE, HINGE = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
SENSOR_KINDS = {int(code): kind for kind, code in SENSOR_TYPES.items()}
"""Kinds of sensors by the numbers of a compiled model."""


def read_mjcf(
    path: Path | str,
    *,
    mesh_root: Path | str | None = None,
    strict: bool = False,
    skin: bool = True,
    contacts: bool = True,
) -> RobotDescription:
    """Read an MJCF file.

    MuJoCo compiles it. Bodies become links, sites become frames, joint equalities
    become mimic joints. Meshes are drawn, and collide as convex hulls. A body with
    several joints becomes a chain with links of 1e-10 kg; a ball joint becomes three
    hinges about x, y and z. Springs, tendons, gravity compensation and closed loops act
    in MuJoCo only. Items of the world body (floors, lights) are ignored, and so are
    free objects beside a robot. Groups and end effectors are inferred; `to_toml()`
    writes the result for editing.

    Args:
        path: The file.
        mesh_root: Folder that all files must lie in; by default the package or model
            folder that encloses the file.
        strict: Refuse what is left out or mended with a warning otherwise.
        skin: Draw links with their meshes, not with the hulls of these.
        contacts: Find the links that must not collide, by simulation.

    Raises:
        ConfigError: If the file is not MJCF, or refers to files outside the folder.
        DescriptionError: If it has no body, or is unphysical, or if it has elements
            that are left out (flexible parts, wrapping tendons) and `strict`.
    """
    path = Path(path)
    m, _ = compile_mjcf(path, root=mesh_root)
    if not _world_children(m):
        raise DescriptionError(f"{path}: the model has no body.")
    importer = _Importer(m, path, strict=strict)
    robot = importer.robot()
    if skin:
        robot = robot.model_copy(update={"skins": importer.skins()})
    return exclude_contacts(robot, path) if contacts else robot


def _robot_roots(m: mujoco.MjModel) -> list[int]:
    """Return the root bodies of the robot: in a scene, without the free objects."""
    roots = _world_children(m)
    free = [int(m.jnt_bodyid[j]) for j in range(m.njnt) if m.jnt_type[j] == FREE]
    if not free or len(roots) == 1:
        return roots
    moving = m.body_rootid[m.jnt_bodyid[m.jnt_type != FREE]].tolist()
    most = max(roots, key=moving.count)
    return [most] if most in free else [b for b in roots if b not in free]


def _world_children(m: mujoco.MjModel) -> list[int]:
    return [b for b in range(1, m.nbody) if m.body_parentid[b] == 0]


def _joint_name(m: mujoco.MjModel, j: int) -> str:
    return m.joint(j).name or f"joint{j}"


class _Step(NamedTuple):
    """One degree of freedom of a joint: a ball joint has three."""

    joint: int
    name: str
    axis: Vector
    zero: float


class _Importer:
    """Converts one compiled model to the fields of a description."""

    def __init__(self, m: mujoco.MjModel, path: Path, *, strict: bool) -> None:
        self._m, self._path, self._strict = m, path, strict
        self._names = NameTable()
        self._bodies: dict[int, str] = {}
        self._joints: dict[int, str] = {}
        self._balls: dict[int, list[str]] = {}
        self._sites: dict[int, str] = {}
        self._offsets: dict[int, Vector] = {0: np.zeros(3)}
        self._mimics = dict(read_followers(m))
        self._roots = _robot_roots(m)

    def robot(self) -> RobotDescription:
        m, names = self._m, NameTable()
        root, rooted = self._root()
        self._name_items(rooted)
        efforts, actuators = read_actuators(m, self._joints)
        links: list[LinkFields] = []
        if rooted is None:
            self._bodies[0] = self._names.take("base_link", "link")
            links.append({"name": self._bodies[0]})
        for b in list(self._bodies):
            links += self._links(b, first=b == rooted, efforts=efforts) if b else []
        keyframes = read_keyframes(m, self._joints, self._balls, set(self._mimics))
        if "home" in keyframes:
            keyframes.setdefault("ready", keyframes["home"])
        frames = list(self._frames())
        self._report()
        return describe_import(
            name=m.names[: m.names.index(b"\0")].decode() or self._path.stem,
            source=self._path,
            root=root,
            links=links,
            frames=frames,
            names=self._names,
            strict=self._strict,
            slabs=self._slabs,
            keyframes=keyframes,
            cameras=list(self._cameras()),
            sensors=list(self._sensors()),
            actuators=actuators,
            connects=list(read_connects(m, self._bodies, self._offsets)),
            tendons=list(
                read_tendons(
                    m, self._joints, self._sites, lambda n: names.take(n, "tendon")
                )
            ),
            contacts={"exclude": list(read_excludes(m, self._bodies))},
        )

    def skins(self) -> dict[str, tuple[Drawn, ...]]:
        """Return what draws the links with meshes, by their names."""
        file = str(self._path.absolute())
        found = {
            name: read_skin(self._m, b, self._offsets[b], file)
            for b, name in self._bodies.items()
            if b
        }
        return {name: drawn for name, drawn in found.items() if drawn}

    def _name_items(self, rooted: int | None) -> None:
        """Name the bodies and joints of the robot; those of the root have no name."""
        m = self._m
        for b in range(1, m.nbody):
            if m.body_rootid[b] in self._roots:
                original = m.body(b).name or f"body{b}"
                self._bodies[b] = self._names.take(original, "link")
        for j in range(m.njnt):
            body = int(m.jnt_bodyid[j])
            if body not in self._bodies or body == rooted:
                continue
            original = _joint_name(m, j)
            if m.jnt_type[j] == BALL:
                own = (f"{original}_{axis}" for axis in "xyz")
                self._balls[j] = [self._names.take(name, "joint") for name in own]
            else:
                self._joints[j] = self._names.take(original, "joint")

    def _report(self) -> None:
        """Log what MuJoCo alone simulates, and what is left out."""
        m, path = self._m, self._path
        others = [
            m.body(b).name or f"body{b}"
            for b in _world_children(m)
            if b not in self._roots
        ]
        if others:
            LOG.warning("%s: objects beside the robot are left out: %s.", path, others)
        if self._balls:
            balls = join_first([_joint_name(m, j) for j in self._balls])
            LOG.warning("%s: ball joints become three hinges each: %s.", path, balls)
        springs = sum(bool(np.any(m.jnt_stiffness[j])) for j in range(m.njnt))
        compensated = int(np.count_nonzero(m.body_gravcomp))
        for count, what in (
            (springs, "joints with springs"),
            (compensated, "bodies with gravity compensation"),
            (m.ntendon, "tendons"),
        ):
            if count:
                LOG.warning("%s: %d %s act in MuJoCo only.", path, count, what)
        faults = list(not_represented(m, self._joints, self._sites))
        for j in self._joints:
            low, high = m.jnt_range[j]
            if low > high:
                text = f"the reversed range from {low:g} to {high:g} of joint"
                faults.append(f"{text} '{_joint_name(m, j)}', endless in MuJoCo, too")
        if faults and self._strict:
            shown = join_first(faults, separator="; ")
            raise DescriptionError(f"{path}: not supported: {shown}.")
        if faults:
            LOG.warning("%s: left out: %s.", path, "; ".join(faults))

    def _root(self) -> tuple[dict[str, Any], int | None]:
        """Return the fields of the root and its body; None if the world is the root."""
        m, bodies = self._m, self._roots
        b = bodies[0]
        start, count = int(m.body_jntadr[b]), int(m.body_jntnum[b])
        pose = pose_fields(pose_at(m.body_pos[b], m.body_quat[b]))
        if len(bodies) == 1 and count == 0:
            return {"kind": "fixed", **pose}, b
        if len(bodies) == 1 and m.jnt_type[start] == FREE:
            return {"kind": "free", **pose}, b
        if len(bodies) == 1 and start == 0 and count == 3 and self._is_planar():
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
        joints = range(start, start + (0 if first else count))
        steps = [step for j in joints for step in self._steps(j)]
        above, origin = self._bodies.get(parent), np.zeros(3)
        for step in steps:
            j = step.joint
            anchor = np.array(m.jnt_pos[j])
            motion = joint_motion(
                step.axis, -step.zero, slide=bool(m.jnt_type[j] == SLIDE)
            )
            moved = pin.SE3(np.eye(3), anchor - origin) * motion
            last = step is steps[-1]
            name = body["name"]
            if not last:
                name = self._names.take(f"{name}_{step.name}", "link")
            fields = {
                "name": name,
                "parent": above,
                **pose_fields(pose * moved),
                "joint": self._joint(step, efforts),
            }
            pose, above, origin = pin.SE3.Identity(), name, anchor
            if last:
                body |= fields
            else:
                yield fields | DUMMY
        if not steps and not first:
            body |= {"parent": above, **pose_fields(pose)}
        self._offsets[b] = -origin
        body["gravcomp"] = float(m.body_gravcomp[b])
        yield body | self._inertia(b) | read_shapes(m, b, -origin)

    def _slabs(self, link: str) -> list[dict[str, Any]]:
        """Return the collision shapes of a link, or else visual ones, cut to slabs."""
        bodies = {name: b for b, name in self._bodies.items()}
        b = bodies.get(link, 0)
        if not b:
            return []
        found = read_shapes(self._m, b, self._offsets[b], cut=True)
        return found["collision"] or found["visual"]

    def _steps(self, j: int) -> Iterator[_Step]:
        if j in self._balls:
            for name, axis in zip(self._balls[j], np.eye(3), strict=True):
                yield _Step(j, name, axis, 0.0)
        else:
            axis = np.array(self._m.jnt_axis[j])
            yield _Step(j, self._joints[j], axis, zero_of(self._m, j))

    def _joint(self, step: _Step, efforts: dict[int, float]) -> dict[str, Any]:
        m, j = self._m, step.joint
        v = int(m.jnt_dofadr[j])
        fields: dict[str, Any] = {
            "name": step.name,
            "type": "slide" if m.jnt_type[j] == SLIDE else "hinge",
            "axis": step.axis.tolist(),
            "armature": float(m.dof_armature[v]),
            "damping": max(0.0, float(m.dof_damping[v].ravel()[0])),
            "frictionloss": float(m.dof_frictionloss[v]),
            "stiffness": float(np.ravel(m.jnt_stiffness[j])[0]),
        }
        if fields["stiffness"] > 0.0 and j not in self._balls:
            fields["springref"] = float(m.qpos_spring[m.jnt_qposadr[j]])
        low, high = np.clip(m.jnt_range[j], -UNLIMITED_RANGE, UNLIMITED_RANGE).tolist()
        if m.jnt_limited[j] and (low, high) != (-UNLIMITED_RANGE, UNLIMITED_RANGE):
            fields["range"] = (-high, high) if j in self._balls else (low, high)
        if efforts.get(j, 0.0) > 0.0:
            fields["effort"] = efforts[j]
        if j in self._mimics and self._mimics[j][0] in self._joints:
            leader, ratio, offset = self._mimics[j]
            fields["mimic"] = {
                "joint": self._joints[leader],
                "ratio": ratio,
                "offset": offset,
            }
        return fields

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
