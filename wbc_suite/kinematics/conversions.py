"""Conversions of q, v, a, tau, M and J between MuJoCo and Pinocchio.

The engines agree on one-parameter joints and differ on free and ball joints:

=================  ==========================  ==========================
free joint         MuJoCo                      Pinocchio
=================  ==========================  ==========================
position           x y z, quaternion w x y z   x y z, quaternion x y z w
linear velocity    world axes                  body axes
angular velocity   body axes                   body axes
=================  ==========================  ==========================

so that `v_pin = B v_mj` with `B = blkdiag(R^T, I)` for each free joint (R is its
rotation) and `B = I` elsewhere. Power is the same on both sides, hence
`tau_mj = B^T tau_pin`, `M_mj = B^T M_pin B`, `J_mj = J_pin B`. Differentiating
`v_pin = B v_mj` adds a term to accelerations: `R^T a_world - w x v_body`.

The two engines' `integrate` and `difference` are different maps: convert, then use one.

Sources: MuJoCo documentation, "Computation: floating objects"; Pinocchio's
`JointModelFreeFlyer`. Each statement is tested numerically against both engines.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.errors import DescriptionError, UnknownNameError
from wbc_suite.kinematics.configuration import named_joints
from wbc_suite.typing import Indices, Matrix, Vector

if TYPE_CHECKING:
    import mujoco  # QP stacks over a Pinocchio model need no simulator

_Q_ORDER = {7: [0, 1, 2, 4, 5, 6, 3], 4: [1, 2, 3, 0]}
"""Where Pinocchio's parameters of a free joint (7) or a ball (4) stand in MuJoCo's."""
_PARAMETERS = 7, 4, 1, 1
"""Of a joint of each MuJoCo type: free, ball, slide, hinge."""


class _FreeJoint(NamedTuple):
    """The parts of one free joint in MuJoCo's and Pinocchio's arrays."""

    quaternion: slice  # w x y z in qpos
    mujoco: slice  # linear part of qvel
    pinocchio: slice  # linear part of v
    angular: slice  # angular part of v


class Conversion:
    """Conversion between a MuJoCo model and a Pinocchio model of one robot.

    Joints are matched by name, after a prefix on the MuJoCo side ("robot0_"). That
    model may hold more than the robot (objects, a second robot): on its side arrays
    have the full size, and entries that belong to no Pinocchio joint are left at zero,
    or untouched when `out` is given.

    Raises:
        UnknownNameError: A Pinocchio joint has no namesake in the MuJoCo model.
        DescriptionError: Two namesakes have different numbers of parameters.
    """

    def __init__(
        self,
        mujoco_model: "mujoco.MjModel",
        pinocchio_model: pin.Model,
        *,
        prefix: str = "",
    ) -> None:
        self.nq_mujoco, self.nv_mujoco = int(mujoco_model.nq), int(mujoco_model.nv)
        names = {mujoco_model.joint(i).name: i for i in range(int(mujoco_model.njnt))}
        q_index: list[int] = []
        v_index: list[int] = []
        free: list[_FreeJoint] = []
        for name, joint in named_joints(pinocchio_model):
            if prefix + name not in names:
                raise UnknownNameError("MuJoCo joint", prefix + name, names)
            k = names[prefix + name]
            q0 = int(mujoco_model.jnt_qposadr[k])
            v0 = int(mujoco_model.jnt_dofadr[k])
            order = _Q_ORDER.get(_PARAMETERS[int(mujoco_model.jnt_type[k])], [0])
            if (joint.nq, joint.nv) != (len(order), max(1, len(order) - 1)):
                raise DescriptionError(
                    f"Joint '{name}' has {joint.nq} parameters and {joint.nv} "
                    f"velocities in Pinocchio but {len(order)} parameters in MuJoCo. "
                    "Build continuous joints as one-parameter revolute joints."
                )
            if len(order) == 7:
                starts = ((q0 + 3, 4), (v0, 3), (joint.idx_v, 3), (joint.idx_v + 3, 3))
                free.append(_FreeJoint(*(slice(i, i + n) for i, n in starts)))
            q_index += [q0 + i for i in order]
            v_index += [v0 + i for i in range(joint.nv)]
        self.q_index: Indices = np.array(q_index, dtype=np.int64)
        self.v_index: Indices = np.array(v_index, dtype=np.int64)
        self._free = tuple(free)

    def q_to_pinocchio(self, qpos: Vector) -> Vector:
        """Return q, shape (nq,), quaternions x y z w, from MuJoCo's qpos."""
        return qpos[self.q_index]

    def q_to_mujoco(self, q: Vector, out: Vector | None = None) -> Vector:
        """Return qpos, quaternions w x y z, from Pinocchio's q, shape (nq,)."""
        qpos = np.zeros(self.nq_mujoco) if out is None else out
        qpos[self.q_index] = q
        return qpos

    def v_to_pinocchio(self, qpos: Vector, qvel: Vector) -> Vector:
        """Return `v_pin = B v_mj`, shape (nv,)."""
        v = qvel[self.v_index]
        for free in self._free:
            v[free.pinocchio] = _rotation(qpos, free).T @ v[free.pinocchio]
        return v

    def v_to_mujoco(self, qpos: Vector, v: Vector, out: Vector | None = None) -> Vector:
        """Return `v_mj = B^-1 v_pin`, shape (nv of MuJoCo,)."""
        qvel = np.zeros(self.nv_mujoco) if out is None else out
        qvel[self.v_index] = v
        for free in self._free:
            qvel[free.mujoco] = _rotation(qpos, free) @ v[free.pinocchio]
        return qvel

    def a_to_pinocchio(self, qpos: Vector, qvel: Vector, qacc: Vector) -> Vector:
        """Return Pinocchio's acceleration (nv,): `a_lin = R^T a_world - w x v_body`.

        With `qacc = 0`, `pin.rnea` of it gives the bias force: `bias_mj = B^T rnea(q,
        v, a)`.
        """
        v = self.v_to_pinocchio(qpos, qvel)
        a = self.v_to_pinocchio(qpos, qacc)
        for free in self._free:
            a[free.pinocchio] -= np.cross(v[free.angular], v[free.pinocchio])
        return a

    def a_to_mujoco(self, qpos: Vector, qvel: Vector, a: Vector) -> Vector:
        """Return MuJoCo's acceleration (nv,): `a_world = R (a_lin + w x v_body)`."""
        v = self.v_to_pinocchio(qpos, qvel)
        classical = np.array(a, dtype=np.float64)
        for free in self._free:
            classical[free.pinocchio] += np.cross(v[free.angular], v[free.pinocchio])
        return self.v_to_mujoco(qpos, classical)

    tau_to_pinocchio = v_to_pinocchio
    """Convert generalised forces as velocities, `B^-T = B`, since B is orthogonal."""
    tau_to_mujoco = v_to_mujoco
    """Convert generalised forces as velocities."""

    def mass_matrix_to_mujoco(self, qpos: Vector, mass_matrix: Matrix) -> Matrix:
        """Return `M_mj = B^T M_pin B`, full MuJoCo size (nv, nv)."""
        half = self.jacobian_to_mujoco(qpos, mass_matrix)
        return self.jacobian_to_mujoco(qpos, half.T).T

    def jacobian_to_mujoco(self, qpos: Vector, jacobian: Matrix) -> Matrix:
        """Return `J_mj = J_pin B`, shape (m, nv of MuJoCo), from `aligned` axes."""
        out = np.zeros((jacobian.shape[0], self.nv_mujoco))
        out[:, self.v_index] = jacobian
        for free in self._free:
            out[:, free.mujoco] = jacobian[:, free.pinocchio] @ _rotation(qpos, free).T
        return out


def _rotation(qpos: Vector, free: _FreeJoint) -> Matrix:
    """Return the rotation matrix of a free joint, body to world, shape (3, 3)."""
    import mujoco

    out = np.empty(9)
    mujoco.mju_quat2Mat(out, qpos[free.quaternion])
    return out.reshape(3, 3)
