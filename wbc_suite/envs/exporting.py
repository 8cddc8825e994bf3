"""Models of environments for other engines: mujoco_warp, `mujoco.rollout`, MJX."""

import copy
from typing import Any, Literal

import mujoco
import numpy as np

GEOMS = mujoco.mjtGeom

MOST_DENSE = 60
"""Degrees of freedom up to which mujoco_warp has dense Jacobians."""

FLAT = 1e-3
"""Least half length of the cylinder in a capsule, m."""


def export_model(
    env: Any, *, variant: Literal["exact", "accelerator"] = "exact"
) -> mujoco.MjModel:
    """Return the present model of an environment for engines other than ours.

    It is a copy: sizes, masses and looks are those of the present episode. Controllers
    are not part of it: `ctrl` are torques of motors and setpoints of servos.

    Args:
        env: An environment of `make` or of Gymnasium.
        variant: `exact` is the model that we simulate, with MuJoCo's automatic reset
            switched on again, and sparse Jacobians above 60 degrees of freedom:
            mujoco_warp refuses models without. `accelerator` has capsules in place of
            long cylinders that collide, and boxes in place of flat ones, since MJX does
            not collide cylinders with boxes; and pyramidal friction cones, since with
            elliptic ones MJX makes a dense matrix of all possible contacts: 10 GB for
            GR1. Damping of servos with a force limit is damping of their joints, since
            MJX's implicit integrator counts it at the limit too, and MuJoCo's does not.
            Masses and inertias stay; contacts differ at the edges, by at most the
            radius, friction by its direction, and servos where they are saturated.
    """
    simulation = env.unwrapped.simulation
    model = copy.deepcopy(simulation.model)
    model.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    if model.nv > MOST_DENSE:
        model.opt.jacobian = mujoco.mjtJacobian.mjJAC_SPARSE
    if variant == "accelerator":
        model.opt.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL
        _replace_cylinders(model)
        _damp_joints(model)
    return model


def _replace_cylinders(model: mujoco.MjModel) -> None:
    """Write capsules or boxes in place of the cylinders that collide."""
    collides = (model.geom_contype | model.geom_conaffinity) > 0
    cylinders = (model.geom_type == GEOMS.mjGEOM_CYLINDER) & collides
    for geom in np.flatnonzero(cylinders).tolist():
        radius, half, _ = model.geom_size[geom]
        if half - radius >= FLAT:
            model.geom_type[geom] = GEOMS.mjGEOM_CAPSULE
            model.geom_size[geom] = radius, half - radius, 0.0
        else:
            side = radius * np.sqrt(np.pi) / 2.0  # a square of the circle's area
            model.geom_type[geom] = GEOMS.mjGEOM_BOX
            model.geom_size[geom] = side, side, half
            model.geom_rbound[geom] = np.linalg.norm(model.geom_size[geom])
        low = model.geom_size[geom].copy()
        if model.geom_type[geom] == GEOMS.mjGEOM_CAPSULE:
            low = np.array([radius, radius, half])
        model.geom_aabb[geom, 3:] = low


def _damp_joints(model: mujoco.MjModel) -> None:
    """Write the damping of servos with a force limit as damping of their joints."""
    of_joints = model.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT
    affine = model.actuator_biastype == mujoco.mjtBias.mjBIAS_AFFINE
    for servo in np.flatnonzero(of_joints & affine & (model.actuator_forcelimited > 0)):
        dof = model.jnt_dofadr[model.actuator_trnid[servo, 0]]
        damping = -model.actuator_biasprm[servo, 2] * model.actuator_gear[servo, 0] ** 2
        model.dof_damping[dof] += damping
        model.actuator_biasprm[servo, 2] = 0.0
