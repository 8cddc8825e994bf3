"""Track joint targets of a robot that stands on its feet.

A free root has no motor: what carries it are the contact forces at the held frames, so
they are chosen first, and the joint torques follow from them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.control.part.joint_position import JointLawConfig, JointTarget
from wbc_suite.control.state import RobotState
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["StanceContact", "StanceLaw", "contact_forces", "damped_inverse"]

CONTACT_DAMPING = 30.0  # 1/s; stops a foot that slips or tips
SINGULAR = 0.01  # m/rad; below it a leg is stretched

TORQUE_ARM = 0.05
"""m; a contact torque of 0.05 N m counts as much as a force of 1 N: soles are small."""


@dataclass(frozen=True, kw_only=True, slots=True)
class StanceContact:
    """A frame that stands on the ground, by its site in the simulation."""

    site: int
    kind: Literal["point", "surface"]


def contact_forces(
    root_jacobian: Matrix,
    wrench: Vector,
    *,
    weights: Vector,
    contacts: Sequence[slice],
) -> Vector:
    """Share a wrench on the root among contacts that can push but not pull.

        minimise f^T W f  subject to  J_root^T f = wrench,

    whose solution is `f = W^-1 J_root (J_root^T W^-1 J_root)^+ wrench`. The contact
    that would have to pull hardest is left out, and the rest is solved again.

    Args:
        root_jacobian: Columns of the contact Jacobian that belong to the root,
            shape (m, 6).
        wrench: What the contacts must give the root, shape (6,).
        weights: Diagonal of W, shape (m,).
        contacts: Rows of each contact; the third is its vertical force.

    Returns:
        Contact forces, shape (m,), N and N m.
    """
    f: Vector = np.zeros(len(weights))
    kept = np.ones(len(weights))
    normal = np.array([rows.start + 2 for rows in contacts])
    for _ in contacts:
        scaled = root_jacobian * (kept / weights)[:, None]
        f = scaled @ (np.linalg.pinv(root_jacobian.T @ scaled, rcond=1e-9) @ wrench)
        worst = int(np.argmin(f[normal]))
        if f[normal[worst]] >= 0.0:
            break
        kept[contacts[worst]] = 0.0
    return f * kept


class StanceLaw:
    """Inverse dynamics through contacts, on a robot with a free root.

        a     = a* + kp e + kd e'                root and joints alike
        a_l  -= J_l^+ (J a + J' v + k J v)       but legs as feet at rest allow
        f     = contact forces with  J_r^T f = M_r a + h_r
        tau   = M_j a + h_j - J_j^T f

    Legs that tracked their own joints would, once a foot has slipped, press against
    each other and push root and arm aside.

    Args:
        state: The robot in the simulation.
        joints: Driven joints; each has a motor.
        contacts: Frames on the ground.
        config: Gains of joints.

    Attributes:
        joints: The driven joints.
        outputs: Their places among the robot's actuators.

    Source: Righetti et al. (2011), "Inverse dynamics control of floating-base robots
    with external constraints: a unified view", ICRA.
    """

    def __init__(
        self,
        state: RobotState,
        joints: tuple[str, ...],
        contacts: Sequence[StanceContact],
        config: JointLawConfig,
    ) -> None:
        self.joints, self.config = joints, config
        self.q_index, self.v_index = state.joint_addresses(joints)
        root = state.model.joint(state.prefix + "root")
        self._root_q = int(root.qposadr[0])
        first = int(root.dofadr[0])
        self._dofs: Indices = np.concatenate(
            [np.arange(first, first + 6), self.v_index]
        )
        self._block = np.ix_(self._dofs, self._dofs)
        order = {name: i for i, name in enumerate(state.actuators)}
        self.outputs: Indices = np.array([order[j] for j in joints], dtype=np.int64)
        limits = state.model.actuator_ctrlrange[state.actuator_ids[self.outputs]]
        self._low, self._high = limits[:, 0].copy(), limits[:, 1].copy()
        self._contacts = tuple(contacts)
        self._weights = np.concatenate(
            [
                [1.0] * 3 + ([TORQUE_ARM**-2] * 3 if c.kind == "surface" else [])
                for c in contacts
            ]
        )
        ends = np.cumsum([6 if c.kind == "surface" else 3 for c in contacts]).tolist()
        self._rows = [slice(a, b) for a, b in zip([0, *ends], ends, strict=False)]
        self._jacobian = np.zeros((6, state.model.nv))
        self._jacobian_rate = np.zeros((6, state.model.nv))
        self._legs: Indices = 6 + np.flatnonzero(_carrying(state, joints, contacts))

    def torque(self, state: RobotState, target: JointTarget) -> Vector:
        """Return torques within the motors' limits; see `JointPositionLaw.torque`."""
        position_error, velocity_error = self._errors(state, target)
        assert target.root_acceleration is not None
        wanted = np.concatenate([target.root_acceleration, target.acceleration])
        wanted += self.config.kp * position_error + self.config.kd * velocity_error
        J, legs = self._contact_jacobian(state), self._legs
        moved = self._contact_motion(state, J) + J @ wanted
        wanted[legs] -= damped_inverse(J[:, legs]) @ moved
        data = state.data
        bias = (data.qfrc_bias - data.qfrc_passive)[self._dofs]
        force = state.mass_matrix()[self._block] @ wanted + bias
        f = contact_forces(
            J[:, :6], force[:6], weights=self._weights, contacts=self._rows
        )
        return np.clip(force[6:] - J[:, 6:].T @ f, self._low, self._high)

    def _errors(self, state: RobotState, target: JointTarget) -> tuple[Vector, Vector]:
        """Return errors of root (MuJoCo's velocity axes) and joints, (6 + n,) each."""
        assert target.root is not None
        assert target.root_twist is not None
        data, k = state.data, self._root_q
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, data.qpos[k + 3 : k + 7])
        turn = pin.log3(rotation.reshape(3, 3).T @ target.root.rotation)
        position = np.concatenate(
            [
                target.root.translation - data.qpos[k : k + 3],
                turn,
                target.position - data.qpos[self.q_index],
            ]
        )
        velocity = np.concatenate([target.root_twist, target.velocity])
        return position, velocity - data.qvel[self._dofs]

    def _contact_jacobian(self, state: RobotState) -> Matrix:
        rows: list[Matrix] = []
        for contact in self._contacts:
            linear, angular = self._jacobian[:3], self._jacobian[3:]
            mujoco.mj_jacSite(state.model, state.data, linear, angular, contact.site)
            used = self._jacobian if contact.kind == "surface" else linear
            rows.append(used[:, self._dofs])
        return np.concatenate(rows)

    def _contact_motion(self, state: RobotState, J: Matrix) -> Vector:
        """Return J' v + k J v: without joint accelerations, and to come to rest."""
        rows: list[Vector] = []
        model, data = state.model, state.data
        for contact in self._contacts:
            linear, angular = self._jacobian_rate[:3], self._jacobian_rate[3:]
            body = int(model.site_bodyid[contact.site])
            place = data.site_xpos[contact.site]
            mujoco.mj_jacDot(model, data, linear, angular, place, body)
            used = self._jacobian_rate if contact.kind == "surface" else linear
            rows.append(used @ data.qvel)
        return np.concatenate(rows) + CONTACT_DAMPING * (J @ data.qvel[self._dofs])


def damped_inverse(J: Matrix) -> Matrix:
    """Return J^T (J J^T + eps)^-1, which stays finite at stretched knees."""
    return np.linalg.solve(J @ J.T + SINGULAR**2 * np.eye(len(J)), J).T


def _carrying(
    state: RobotState, joints: tuple[str, ...], contacts: Sequence[StanceContact]
) -> np.ndarray:
    """Tell which joints lie between root and a contact, shape (n,)."""
    model, bodies = state.model, set[int]()
    for contact in contacts:
        body = int(model.site_bodyid[contact.site])
        while body:
            bodies.add(body)
            body = int(model.body_parentid[body])
    owners = [int(model.joint(state.prefix + name).bodyid[0]) for name in joints]
    return np.array([owner in bodies for owner in owners])
