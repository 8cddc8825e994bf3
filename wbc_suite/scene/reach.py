"""Which links of fixed robots can never touch the floor.

MuJoCo looks at a floor and each body in every step, however far they are apart. Whether
they can meet at all is known when a scene is compiled: a link stays within a ball
around the first joint below what is fixed, whatever the joints' angles are.
"""

import mujoco
import numpy as np
from numpy.typing import NDArray

from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["let_floors_ignore_far_links"]

SLACK = 0.05
"""m between such a ball and the floor: joints give way at their stops."""

COMMON, ABOVE = 1, 2
"""Bits of collision: that of all geoms by default, and one that floors lack."""


def let_floors_ignore_far_links(model: mujoco.MjModel) -> None:
    """Let planes of the world collide only with what can reach them.

    All contacts stay as they are. Looked at are trees with actuators, which stand where
    they were compiled; others may be placed anew. A scene with bits of collision or
    pairs of its own is left alone.
    """
    solid = (model.geom_contype | model.geom_conaffinity) > 0
    bits = np.concatenate([model.geom_contype[solid], model.geom_conaffinity[solid]])
    floors = solid & (model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE)
    plain = np.all(bits == COMMON) and not model.npair
    if not plain or not floors.any() or np.any(model.geom_bodyid[floors] != 0):
        return
    links = _far(model, np.flatnonzero(floors))[model.geom_bodyid] & solid
    if not links.any():
        return
    others = solid & ~floors & ~links
    for mask in (model.geom_contype, model.geom_conaffinity):
        mask[links], mask[others] = ABOVE, COMMON | ABOVE
    for bodies, geoms in (
        (model.body_contype, model.geom_contype),
        (model.body_conaffinity, model.geom_conaffinity),
    ):
        bodies[:] = 0
        np.bitwise_or.at(bodies, model.geom_bodyid, geoms)


def _far(model: mujoco.MjModel, floors: Indices) -> NDArray[np.bool_]:
    """Return of each body whether actuators move it and it reaches no floor."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    centres, radii = _balls(model, data)
    size = np.zeros(model.nbody)
    around = np.linalg.norm(model.geom_pos, axis=1) + model.geom_rbound
    np.maximum.at(size, model.geom_bodyid, around)
    up = data.geom_xmat[floors].reshape(-1, 3, 3)[:, :, 2]
    heights = centres @ up.T - np.sum(up * data.geom_xpos[floors], axis=1)
    return heights.min(axis=1) - radii - size > SLACK


def _balls(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Matrix, Vector]:
    """Return balls that bodies' origins stay in: centres (nbody, 3), radii (nbody,).

    The radius is infinite of what is fixed, floats, or has no actuator.
    """
    centres, radii = np.zeros((model.nbody, 3)), np.full(model.nbody, np.inf)
    fixed = np.zeros(model.nbody, dtype=bool)
    fixed[0] = True
    driven = _driven_roots(model)
    for body in range(1, model.nbody):
        parent, first = model.body_parentid[body], model.body_jntadr[body]
        joints = range(first, first + model.body_jntnum[body])
        way = sum(_way(model, joint) for joint in joints)
        fixed[body] = fixed[parent] and not joints and model.body_mocapid[body] < 0
        if fixed[parent] and joints and model.body_treeid[body] in driven:
            centres[body], radii[body] = data.xpos[body], way
        else:
            step = float(np.linalg.norm(model.body_pos[body]))
            centres[body], radii[body] = centres[parent], radii[parent] + step + way
    return centres, radii


def _driven_roots(model: mujoco.MjModel) -> set[int]:
    """Return the kinematic trees that an actuator moves by a joint."""
    by_joint = model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT
    joints = model.actuator_trnid[by_joint, 0]
    return set(model.body_treeid[model.jnt_bodyid[joints]].tolist())


def _way(model: mujoco.MjModel, joint: int) -> float:
    """Return how far a joint carries the origin of its body from where it began, m."""
    kinds, kind = mujoco.mjtJoint, mujoco.mjtJoint(model.jnt_type[joint])
    if kind in (kinds.mjJNT_HINGE, kinds.mjJNT_BALL):
        return 2.0 * float(np.linalg.norm(model.jnt_pos[joint]))
    if kind == kinds.mjJNT_SLIDE and model.jnt_limited[joint]:
        start = model.qpos0[model.jnt_qposadr[joint]]
        return float(np.abs(model.jnt_range[joint] - start).max())
    return float("inf")
