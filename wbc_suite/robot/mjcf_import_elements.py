"""Read geoms and actuators of a compiled MuJoCo model as fields of a description."""

import math
from collections.abc import Collection, Iterator, Mapping
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
from pydantic import TypeAdapter

from wbc_suite import logs
from wbc_suite.robot.adopt.importing import NameTable
from wbc_suite.robot.poses import pose_at, pose_fields
from wbc_suite.robot.shape_geometry import fit_hull
from wbc_suite.robot.shapes import Drawn
from wbc_suite.robot.slab_hulls import slab_hulls
from wbc_suite.robot.surfaces import surfaces_of_triangles, texels
from wbc_suite.typing import Matrix, Vector

LOG = logs.logger(__name__)

_DRAWN: TypeAdapter[Drawn] = TypeAdapter(Drawn)

VISUAL_GROUPS = 3  # groups 0, 1 and 2 are drawn, as in MuJoCo's own viewer
GEOM = mujoco.mjtGeom
TERRAINS = (GEOM.mjGEOM_PLANE, GEOM.mjGEOM_HFIELD, GEOM.mjGEOM_SDF)
"""Geoms that robots do not have."""
DEFAULTS = {"friction": (1.0, 0.005, 0.0001), "solref": (0.02, 1.0)}
"""MuJoCo's defaults of contacts; `solref` is a time in s and a damping ratio."""


def read_shapes(
    m: mujoco.MjModel, body: int, offset: Vector, *, cut: bool = False
) -> dict[str, list[dict[str, Any]]]:
    """Return the visual and the collision shapes of a body, placed in its link.

    The offset is the origin of the body in the link's frame, m. Meshes to `cut` become
    hulls of slabs.
    """
    visual: list[dict[str, Any]] = []
    collision: list[dict[str, Any]] = []
    drawn = _drawn_geoms(m, body)
    for g in _geoms(m, body):
        is_mesh = m.geom_type[g] == GEOM.mjGEOM_MESH
        for shape in _cut(m, g) if cut and is_mesh else [_shape(m, g)]:
            own = pin.SE3(np.eye(3), np.asarray(shape.pop("pos", np.zeros(3))))
            pose = pose_at(m.geom_pos[g] + offset, m.geom_quat[g]) * own
            placed = shape | pose_fields(pose)
            if g in drawn:
                visual.append(placed | {"color": _color(m, g)})
            if m.geom_contype[g] or m.geom_conaffinity[g]:
                collision.append(placed | _contact(m, g))
    return {"visual": visual, "collision": collision}


def _geoms(m: mujoco.MjModel, body: int) -> list[int]:
    own = np.flatnonzero(m.geom_bodyid == body).tolist()
    return [g for g in own if int(m.geom_type[g]) not in TERRAINS]


def _drawn_geoms(m: mujoco.MjModel, body: int) -> list[int]:
    """Return the geoms of a body that are drawn.

    If a body has groups of geoms that never collide, those of its groups that only
    collide are not drawn.
    """
    drawn = [g for g in _geoms(m, body) if m.geom_group[g] < VISUAL_GROUPS]
    free = {
        int(m.geom_group[g])
        for g in drawn
        if not (m.geom_contype[g] or m.geom_conaffinity[g])
    }
    return [g for g in drawn if not free or int(m.geom_group[g]) in free]


def read_skin(
    m: mujoco.MjModel, body: int, offset: Vector, file: str
) -> tuple[Drawn, ...]:
    """Return what draws a body with meshes, placed in its link; empty without one."""
    drawn: list[dict[str, Any]] = []
    for g in _drawn_geoms(m, body):
        own = [{"shape": "skin", "file": file, **fields} for fields in _surfaces(m, g)]
        pose = pose_at(m.geom_pos[g] + offset, m.geom_quat[g])
        if not own:
            own = [_shape(m, g) | {"color": _color(m, g)}]
            pose = pose * pin.SE3(np.eye(3), np.asarray(own[0].pop("pos", np.zeros(3))))
        drawn += [fields | pose_fields(pose) for fields in own]
    if all(shape["shape"] != "skin" for shape in drawn):
        return ()
    return tuple(map(_DRAWN.validate_python, drawn))


def _surfaces(m: mujoco.MjModel, g: int) -> list[dict[str, Any]]:
    """Return the mesh of a geom by its colours; empty for other geoms."""
    mesh = int(m.geom_dataid[g])
    if m.geom_type[g] != GEOM.mjGEOM_MESH or m.mesh_facenum[mesh] == 0:
        return []
    first, count = m.mesh_vertadr[mesh], m.mesh_vertnum[mesh]
    start, end = m.mesh_faceadr[mesh], m.mesh_faceadr[mesh] + m.mesh_facenum[mesh]
    vertices, faces = m.mesh_vert[first : first + count], m.mesh_face[start:end]
    stated, pixels = _color(m, g), _pixels(m, int(m.geom_matid[g]))
    colors = None
    if pixels is not None and m.mesh_texcoordadr[mesh] >= 0:
        corners = m.mesh_texcoordadr[mesh] + m.mesh_facetexcoord[start:end]
        # MuJoCo counts rows of a picture from below
        centres = m.mesh_texcoord[corners].mean(axis=1) * (1.0, -1.0)
        colors = texels(pixels, centres) * stated[:3]
    elif pixels is not None:
        mean = pixels.mean(axis=(0, 1)) / 255.0
        stated = [*(mean * stated[:3]).tolist(), stated[3]]
    try:
        found = surfaces_of_triangles(vertices, faces, colors)
    except ValueError:  # MuJoCo draws what has no area, too
        return []
    return [{"surface": own, "color": own.color or stated} for own in found]


def _pixels(m: mujoco.MjModel, material: int) -> Any:
    """Return the flat texture of a material, shape (height, width, 3); None without."""
    role = mujoco.mjtTextureRole.mjTEXROLE_RGB
    texture = -1 if material < 0 else int(m.mat_texid[material, role])
    if texture < 0 or m.tex_nchannel[texture] < 3:
        return None
    if m.tex_type[texture] != mujoco.mjtTexture.mjTEXTURE_2D:
        return None
    first, channels = m.tex_adr[texture], int(m.tex_nchannel[texture])
    shape = int(m.tex_height[texture]), int(m.tex_width[texture]), channels
    return m.tex_data[first : first + math.prod(shape)].reshape(shape)[..., :3]


def _shape(m: mujoco.MjModel, g: int) -> dict[str, Any]:
    size = m.geom_size[g].tolist()
    match m.geom_type[g]:
        case GEOM.mjGEOM_BOX:
            return {"shape": "box", "size": size}
        case GEOM.mjGEOM_SPHERE:
            return {"shape": "sphere", "radius": size[0]}
        case GEOM.mjGEOM_ELLIPSOID:
            return {"shape": "ellipsoid", "size": size}
        case GEOM.mjGEOM_CAPSULE | GEOM.mjGEOM_CYLINDER:
            capsule = m.geom_type[g] == GEOM.mjGEOM_CAPSULE
            return {
                "shape": "capsule" if capsule else "cylinder",
                "from": [0.0, 0.0, -size[1]],
                "to": [0.0, 0.0, size[1]],
                "radius": size[0],
            }
        case _:
            return fit_hull(_vertices(m, int(m.geom_dataid[g])))


def _vertices(m: mujoco.MjModel, mesh: int) -> Matrix:
    first, count = m.mesh_vertadr[mesh], m.mesh_vertnum[mesh]
    return np.array(m.mesh_vert[first : first + count], dtype=np.float64)


def _cut(m: mujoco.MjModel, g: int) -> list[dict[str, Any]]:
    mesh = int(m.geom_dataid[g])
    first, count = m.mesh_faceadr[mesh], m.mesh_facenum[mesh]
    faces = np.array(m.mesh_face[first : first + count], dtype=np.int64)
    return slab_hulls(_vertices(m, mesh), faces)


def _color(m: mujoco.MjModel, g: int) -> list[float]:
    material = m.geom_matid[g]
    rgba = m.mat_rgba[material] if material >= 0 else m.geom_rgba[g]
    return [round(min(max(float(c), 0.0), 1.0), 4) for c in rgba]


def _contact(m: mujoco.MjModel, g: int) -> dict[str, Any]:
    """Return the contact parameters of a geom that are not MuJoCo's defaults."""
    fields: dict[str, Any] = {
        key: values
        for key, default in DEFAULTS.items()
        if (values := getattr(m, f"geom_{key}")[g].tolist()) != list(default)
    }
    if m.geom_condim[g] != 3:
        fields["condim"] = int(m.geom_condim[g])
    if m.geom_margin[g] != 0.0:
        fields["margin"] = float(m.geom_margin[g])
    return fields


def read_actuators(
    m: mujoco.MjModel, joints: dict[int, str]
) -> tuple[dict[int, float], list[dict[str, Any]]]:
    """Return the largest effort by joint id, and the fields of special actuators.

    With gain g, bias b0 + b1 l + b2 dl/dt and gear r, the effort at a joint q = l / r
    is r (g u + b0 + b1 r q + b2 r dq/dt): a servo of stiffness -b1 r^2 and damping
    -b2 r^2, or a motor when b1 = b2 = 0.
    """
    efforts: dict[int, float] = {}
    special: list[dict[str, Any]] = []
    driven: set[int] = set()
    for a in range(m.nactuator):
        joint = int(m.actuator_trnid[a, 0])
        name = m.actuator(a).name or f"number {a}"
        if m.actuator_trntype[a] != mujoco.mjtTrn.mjTRN_JOINT or joint not in joints:
            LOG.warning("Actuator '%s' does not drive a single joint; ignored.", name)
            continue
        if joint in driven:
            LOG.warning("Actuator '%s' is the second of its joint; ignored.", name)
            continue
        driven.add(joint)
        fields, effort = _actuator_kind(m, a), _largest_effort(m, a)
        if effort is not None:
            efforts[joint] = effort
        if fields["kind"] != "motor" or effort is None:
            special.append({"joint": joints[joint], **fields})
    return efforts, special


def _largest_effort(m: mujoco.MjModel, a: int) -> float | None:
    """Return the smallest limit of the effort at the joint; None without a limit."""
    gear = abs(float(m.actuator_gear[a, 0]))
    joint = int(m.actuator_trnid[a, 0])
    bounds: list[float] = []
    if m.actuator_forcelimited[a]:
        bounds.append(gear * float(np.abs(m.actuator_forcerange[a]).max()))
    control = int(m.actuator_ctrladr[a])
    if m.actuator_ctrllimited[control] and _actuator_kind(m, a)["kind"] == "motor":
        gain = abs(float(m.actuator_gainprm[a, 0]))
        bounds.append(gear * gain * float(np.abs(m.actuator_ctrlrange[control]).max()))
    if m.jnt_actfrclimited[joint]:
        bounds.append(float(np.abs(m.jnt_actfrcrange[joint]).max()))
    return min(bounds, default=None)


def _actuator_kind(m: mujoco.MjModel, a: int) -> dict[str, Any]:
    gear = float(m.actuator_gear[a, 0])
    _, stiffness, damping = (float(b) for b in m.actuator_biasprm[a, :3])
    if m.actuator_biastype[a] != mujoco.mjtBias.mjBIAS_AFFINE:
        return {"kind": "motor"}
    kd = max(0.0, -damping * gear**2)
    if stiffness < 0.0:
        return {"kind": "position", "kp": -stiffness * gear**2, "kd": kd}
    return {"kind": "velocity", "kd": kd}


def read_excludes(
    m: mujoco.MjModel, bodies: Mapping[int, str]
) -> Iterator[tuple[str, str]]:
    """Yield the pairs of bodies of the robot that never collide."""
    for signature in m.exclude_signature:
        first, second = divmod(int(signature), 1 << 16)
        if first in bodies and second in bodies:
            yield bodies[first], bodies[second]


def read_keyframes(
    m: mujoco.MjModel,
    joints: Mapping[int, str],
    balls: Mapping[int, list[str]],
    followers: Collection[int],
) -> dict[str, dict[str, float]]:
    """Return the postures by name, with values clipped to their ranges.

    Ball joints have three names of hinges about x, y and z.
    """
    found, names = dict[str, dict[str, float]](), NameTable()
    for k in range(m.nkey):
        values: dict[str, float] = {}
        for j, name in joints.items():
            if j not in followers:
                value = float(m.key_qpos[k, m.jnt_qposadr[j]])
                low, high = m.jnt_range[j].tolist()
                limited = bool(m.jnt_limited[j])
                values[name] = min(max(value, low), high) if limited else value
        for j, own in balls.items():
            start = int(m.jnt_qposadr[j])
            quat = m.key_qpos[k, start : start + 4]
            limit = float(m.jnt_range[j, 1]) if m.jnt_limited[j] else np.inf
            R = pose_at(np.zeros(3), quat).rotation  # R_x(a) R_y(b) R_z(c)
            angles = -pin.rpy.matrixToRpy(R.T)
            values |= dict(zip(own, angles.clip(-limit, limit).tolist(), strict=True))
        found[names.take(m.key(k).name or f"key{k}", "keyframe")] = values
    return found
