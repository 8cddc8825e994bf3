"""MuJoCo's arrays as kernels see them."""

from typing import NamedTuple

import mujoco
import numpy as np

from wbc_suite.compiling import struct
from wbc_suite.typing import Indices, Matrix, Vector


@struct
class OscWork(NamedTuple):
    """Intermediate values of one law in operational space, for up to nv joints.

    Attributes:
        dofs: Degrees of freedom of the law's joints.
        posture: Accelerations a0 that hold the posture.
        wanted: `x'' - J' v`, then what of it other joints leave; linear, then angular.
        pull: Its part `kd u` towards the goal.
        column: A column of a Jacobian, or other scratch of size 6.
        J: Jacobian of the site, shape (6, n), then `J C^-T`.
        C: Cholesky factor of the joints' inertia, shape (n, n).
        L: Lower factor of the damped `J C^-T = L Q`, shape (6, 6).
        Q: Its orthonormal rows, shape (6, n + 6).
        z: Solution, shape (n + 6,).
        low: Least changes of accelerations and torques, shape (2 n + 2,).
        high: Greatest changes.
    """

    dofs: Indices
    posture: Vector
    wanted: Vector
    pull: Vector
    column: Vector
    J: Matrix
    C: Matrix
    L: Matrix
    Q: Matrix
    z: Vector
    low: Vector
    high: Vector


@struct
class Physics(NamedTuple):
    """Views of the arrays of a model and its data; names are MuJoCo's.

    Valid as long as model and data live. Arrays of indices are copies.
    """

    timestep: float
    gravity: Vector
    """m/s^2, shape (3,)."""
    qpos: Vector
    qvel: Vector
    ctrl: Vector
    qfrc_bias: Vector
    qfrc_passive: Vector
    qfrc_gravcomp: Vector
    M: Vector
    M_rownnz: Indices
    M_rowadr: Indices
    M_colind: Indices
    site_xpos: Matrix
    site_xmat: Matrix
    xpos: Matrix
    xmat: Matrix
    cdof: Matrix
    cdof_dot: Matrix
    cvel: Matrix
    subtree_com: Matrix
    site_bodyid: Indices
    body_rootid: Indices
    body_last_dof: Indices
    """Last degree of freedom that moves each body, -1 without any, shape (nbody,)."""
    dof_parentid: Indices
    acceleration: Vector
    """Joint accelerations that the laws ask for, shape (nv,)."""
    force: Vector
    """M times these accelerations, shape (nv,)."""
    place: Indices
    """Scratch, shape (nv,)."""
    osc: OscWork


def _osc_work(nv: int) -> OscWork:
    return OscWork(
        dofs=np.zeros(nv, dtype=np.int64),
        posture=np.zeros(nv),
        wanted=np.zeros(6),
        pull=np.zeros(6),
        column=np.zeros(6),
        J=np.zeros((6, nv)),
        C=np.zeros((nv, nv)),
        L=np.zeros((6, 6)),
        Q=np.zeros((6, nv + 6)),
        z=np.zeros(nv + 6),
        low=np.zeros(2 * nv + 2),
        high=np.zeros(2 * nv + 2),
    )


def bind_physics(model: mujoco.MjModel, data: mujoco.MjData) -> Physics:
    """Return the view of a simulation for kernels."""
    computed = {
        "timestep": float(model.opt.timestep),
        "gravity": model.opt.gravity,
        "body_last_dof": _last_dofs(model),
        "acceleration": np.zeros(model.nv),
        "force": np.zeros(model.nv),
        "place": np.zeros(model.nv, dtype=np.int64),
        "osc": _osc_work(model.nv),
    }
    views = {
        name: getattr(data if hasattr(data, name) else model, name)
        for name in Physics._fields
        if name not in computed
    }
    constant = {
        name: array.astype(np.int64)
        for name, array in views.items()
        if array.dtype == np.int32
    }
    return Physics(**{**views, **constant, **computed})


def _last_dofs(model: mujoco.MjModel) -> Indices:
    last = np.full(model.nbody, -1, dtype=np.int64)
    for body in range(1, model.nbody):
        count = int(model.body_dofnum[body])
        own = int(model.body_dofadr[body]) + count - 1
        last[body] = own if count else last[model.body_parentid[body]]
    return last
