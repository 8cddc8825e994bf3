"""Carry compiled MuJoCo geoms into the fields of our shapes."""

from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.robot.placing import pose_fields
from wbc_suite.robot.point_clouds import enclosing_shape
from wbc_suite.typing import Vector

__all__ = ["UNREADABLE", "pose_at", "shapes_of"]

DRAWN_GROUPS = 3
"""Groups 0, 1 and 2 are drawn, as in MuJoCo's own viewer."""
UNREADABLE = (
    mujoco.mjtGeom.mjGEOM_PLANE,
    mujoco.mjtGeom.mjGEOM_HFIELD,
    mujoco.mjtGeom.mjGEOM_SDF,
)
"""Geoms that belong to worlds and not to robots."""
DEFAULTS = {"friction": (1.0, 0.005, 0.0001), "solref": (0.02, 1.0)}


def pose_at(pos: Vector, quat: Vector) -> pin.SE3:
    """Return the pose of MuJoCo's pos and quat (w x y z)."""
    return pin.SE3(pin.Quaternion(*quat).matrix(), np.array(pos))


def shapes_of(
    m: mujoco.MjModel, body: int, offset: Vector
) -> dict[str, list[dict[str, Any]]]:
    """Return the visual and the collision shapes of a body.

    Args:
        m: The compiled model.
        body: Id of the body.
        offset: Origin of the body in the link's frame, m.
    """
    visual: list[dict[str, Any]] = []
    collision: list[dict[str, Any]] = []
    first, count = int(m.body_geomadr[body]), int(m.body_geomnum[body])
    for g in range(first, first + count):
        if m.geom_type[g] in UNREADABLE:
            continue
        shape = _shape(m, g)
        own = pin.SE3(np.eye(3), np.asarray(shape.pop("pos", np.zeros(3))))
        pose = pose_at(m.geom_pos[g] + offset, m.geom_quat[g]) * own
        shape |= pose_fields(pose)
        if m.geom_group[g] < DRAWN_GROUPS:
            visual.append(shape | {"color": _color(m, g)})
        if m.geom_contype[g] or m.geom_conaffinity[g]:
            collision.append(shape | _contact(m, g))
    return {"visual": visual, "collision": collision}


def _shape(m: mujoco.MjModel, g: int) -> dict[str, Any]:
    kinds = mujoco.mjtGeom
    size = m.geom_size[g].tolist()
    match m.geom_type[g]:
        case kinds.mjGEOM_BOX:
            return {"shape": "box", "size": size}
        case kinds.mjGEOM_SPHERE:
            return {"shape": "sphere", "radius": size[0]}
        case kinds.mjGEOM_ELLIPSOID:
            return {"shape": "ellipsoid", "size": size}
        case kinds.mjGEOM_CAPSULE | kinds.mjGEOM_CYLINDER:
            capsule = m.geom_type[g] == kinds.mjGEOM_CAPSULE
            return {
                "shape": "capsule" if capsule else "cylinder",
                "from": [0.0, 0.0, -size[1]],
                "to": [0.0, 0.0, size[1]],
                "radius": size[0],
            }
        case _:
            mesh = m.geom_dataid[g]
            first, count = m.mesh_vertadr[mesh], m.mesh_vertnum[mesh]
            points = np.array(m.mesh_vert[first : first + count], dtype=np.float64)
            return enclosing_shape(points)


def _color(m: mujoco.MjModel, g: int) -> list[float]:
    material = m.geom_matid[g]
    rgba = m.mat_rgba[material] if material >= 0 else m.geom_rgba[g]
    return [round(min(max(float(c), 0.0), 1.0), 4) for c in rgba]


def _contact(m: mujoco.MjModel, g: int) -> dict[str, Any]:
    """Return how a geom touches, where it is not MuJoCo's default."""
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
