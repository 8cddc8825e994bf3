"""Keep a robot with a free root on its feet while other laws move its joints.

A free root has no motor: what carries it are the contact forces at the held frames, so
they are chosen first, and the joint torques follow from them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.control.loop.stance import (
    CONTACT_DAMPING,
    LEAST_PRESSURE,
    RANK,
    SINGULAR,
    TORQUE_ARM,
)
from wbc_suite.control.loop.table import MOST_FEET, LawKind, Records
from wbc_suite.control.part.joint import JointLawConfig
from wbc_suite.control.part.law import Law
from wbc_suite.control.state import RobotState
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = [
    "RootMotion",
    "StanceContact",
    "StanceLaw",
    "contact_forces",
    "damped_inverse",
    "even_share",
]


@dataclass(frozen=True, kw_only=True, slots=True)
class RootMotion:
    """Where a free root should be.

        start * exp(behind + twist s + curve s^2 / 2 + bend s^3 / 6)

    Attributes:
        start: A pose in the world.
        behind: Linear then angular, in the root's own axes, shape (6,).
        twist: The same per second.
        curve: The same per second squared.
        bend: The same per second cubed.
    """

    start: pin.SE3
    behind: Vector
    twist: Vector
    curve: Vector
    bend: Vector

    @classmethod
    def still(cls, pose: pin.SE3) -> "RootMotion":
        """Stand still at a pose."""
        behind, twist, curve, bend = np.zeros((4, 6))
        return cls(start=pose, behind=behind, twist=twist, curve=curve, bend=bend)


@dataclass(frozen=True, kw_only=True, slots=True)
class StanceContact:
    """A frame that stands on the ground, by its site in the simulation."""

    site: int
    kind: Literal["point", "surface"]


def even_share(root_jacobian: Matrix, weights: Vector) -> Matrix:
    """Return `W^-1 J (J^T W^-1 J)^+`, which makes contact forces of a wrench, (m, 6).

    They are the least by weights that give the wrench, or the nearest to it.

    Args:
        root_jacobian: Columns of the contact Jacobian that belong to the root,
            shape (m, 6).
        weights: Diagonal of W, shape (m,); infinite where nothing is to be given.
    """
    scaled = root_jacobian / weights[:, None]
    return scaled @ np.linalg.pinv(root_jacobian.T @ scaled, rcond=RANK)


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
    weights = weights.copy()
    f: Vector = even_share(root_jacobian, weights) @ wrench
    normal = np.array([rows.start + 2 for rows in contacts])
    for _ in contacts:
        worst = int(np.argmin(f[normal]))
        if f[normal[worst]] >= 0.0:
            break
        weights[contacts[worst]] = np.inf
        f = even_share(root_jacobian, weights) @ wrench
    return f


class StanceLaw(Law):
    """Contact forces that let a robot with a free root move as other laws ask.

        a_r   = a_r* + kp e + kd e'              the root tracks its target
        a_l  -= J_l^+ (J a + J' v + k J v)       legs do as feet at rest allow
        a_a  *= s                                arms do as feet can bear
        f     = contact forces with  J_r^T f = M_r a + h_r
        tau   = M_j a + h_j - J_j^T f

    Legs that tracked their own joints would, once a foot has slipped, press against
    each other and push root and arm aside.

    s is the greatest part of 1 that leaves every foot 10 N to press with. A hand that
    is stopped by floor or table presses as hard as what its arm asks for swings; with
    this the robot neither swings nor presses itself off its feet.

    It drives no joint itself: the forces are taken off the torques of the laws that do.

    Args:
        state: The robot in the simulation.
        joints: All joints with a motor that follows accelerations.
        contacts: Frames on the ground.
        config: Gains of the root.
        kind: Which kernel computes it.

    Source: Righetti et al. (2011), "Inverse dynamics control of floating-base robots
    with external constraints: a unified view", ICRA.
    """

    def __init__(
        self,
        state: RobotState,
        joints: Sequence[str],
        contacts: Sequence[StanceContact],
        config: JointLawConfig,
        kind: LawKind = LawKind.STANCE,
    ) -> None:
        super().__init__(kind, state, joints)
        if len(contacts) > MOST_FEET:
            raise ConfigError(
                f"{state.robot.name}: {len(contacts)} frames are held; a robot stands "
                f"on {MOST_FEET} feet at most."
            )
        self.record["kp"], self.record["kd"] = config.kp, config.kd
        root, stance = state.model.joint(state.prefix + "root"), self._stance
        stance["qpos"], stance["dof"] = root.qposadr[0], root.dofadr[0]
        stance["body"], stance["feet"] = root.bodyid[0], len(contacts)
        rows = [6 if c.kind == "surface" else 3 for c in contacts]
        stance["site"][: len(contacts)] = [c.site for c in contacts]
        stance["rows"][: len(contacts)] = rows
        first, driven = int(root.dofadr[0]), self.drives["dof"]
        self._dofs: Indices = np.concatenate([np.arange(first, first + 6), driven])
        self._contacts = tuple(contacts)
        self._weights = np.concatenate(
            [[1.0] * 3 + [TORQUE_ARM**-2] * (count - 3) for count in rows]
        )
        ends = np.cumsum(rows).tolist()
        self._rows = [slice(a, b) for a, b in zip([0, *ends], ends, strict=False)]
        is_leg = _carrying(state, self.joints, contacts)
        self._legs: Indices = 6 + np.flatnonzero(is_leg)
        self._arms: Indices = 6 + np.flatnonzero(~is_leg)
        self.lead(RootMotion.still(pin.SE3.Identity()))

    def reset(self, state: RobotState) -> None:
        """Forget what the observer remembers."""
        super().reset(state)
        self._stance["asked"] = 0.0
        self._stance["before"] = state.data.qvel[self._dofs[:6]]

    def lead(self, motion: RootMotion) -> None:
        """Set the root's target from now on; `aim` sets that of the joints."""
        start = motion.start
        self.record["start"] = np.concatenate(
            [start.rotation.ravel(), start.translation]
        )
        stance = self._stance
        stance["behind"], stance["twist"] = motion.behind, motion.twist
        stance["curve"], stance["bend"] = motion.curve, motion.bend
        self.record["since"] = 0.0

    def root_target(self) -> tuple[pin.SE3, Vector, Vector]:
        """Return the root's target now, its velocity and acceleration, (6,) each.

        The latter as MuJoCo has them: linear in the world's axes, angular in its own.
        """
        s, stance = float(self.record["since"][0]), self._stance
        rate, curve, bend = stance["twist"], stance["curve"], stance["bend"]
        v, a = rate + s * (curve + 0.5 * s * bend), curve + s * bend
        way = stance["behind"] + s * (rate + s * (0.5 * curve + s / 6.0 * bend))
        start = self.record["start"][0]
        pose = pin.SE3(start[:9].reshape(3, 3), start[9:]) * pin.exp6(way)
        R = pose.rotation
        linear = R @ (a[:3] + np.cross(v[3:], v[:3]))
        twist = np.concatenate([R @ v[:3], v[3:]])
        return pose, twist, np.concatenate([linear, a[3:]])

    def stand(self, state: RobotState, asked: Vector) -> None:
        """Ask root and legs for accelerations as well; note what the feet give.

        Args:
            state: The robot, after `mj_step1`.
            asked: What all other laws ask of the scene, shape (nv,); changed in place.
        """
        position, velocity, root = self._root_errors(state)
        gains = self.record[0]
        a, legs, arms = asked[self._dofs], self._legs, self._arms
        a[:6] = root + gains["kp"] * position + gains["kd"] * velocity
        J, moved = self._contacts_now(state)
        a[legs] -= damped_inverse(J[:, legs]) @ (J @ a + moved)
        M, h = self._dynamics(state)
        swung = M[:6, arms] @ a[arms]
        still = M[:6] @ a + h[:6] - swung
        part = self._bearable(J[:, :6], still, swung)
        a[arms] *= part
        f = contact_forces(
            J[:, :6], still + part * swung, weights=self._weights, contacts=self._rows
        )
        self._give(state, asked, a, J, f)

    def _bearable(self, root_jacobian: Matrix, still: Vector, swung: Vector) -> float:
        """Return the part of a wrench that leaves all feet pressing, beside another."""
        normal = [rows.start + 2 for rows in self._rows]
        give = even_share(root_jacobian, self._weights)[normal]
        force, change = give @ still, give @ swung
        less = change < 0.0
        part = (force[less] - LEAST_PRESSURE) / -change[less]
        return float(np.clip(part, 0.0, 1.0).min(initial=1.0))

    def _give(
        self, state: RobotState, asked: Vector, a: Vector, J: Matrix, f: Vector
    ) -> None:
        """Hand on accelerations, and what contact forces do at the joints."""
        stance = self._stance
        asked[self._dofs] = a
        stance["asked"], stance["before"] = a[:6], state.data.qvel[self._dofs[:6]]
        stance["force"][: len(f)] = f
        self.drives["command"] = J[:, 6:].T @ f

    @property
    def _stance(self) -> Records:
        return self.record["stance"][0]

    def _root_errors(self, state: RobotState) -> tuple[Vector, Vector, Vector]:
        """Return errors of the root's position and velocity, and the target's motion.

        In MuJoCo's velocity axes, shape (6,) each.
        """
        data, stance = state.data, self._stance
        pose, twist, acceleration = self.root_target()
        R, k = data.xmat[stance["body"]].reshape(3, 3), int(stance["qpos"])
        away = pose.translation - data.qpos[k : k + 3]
        position = np.concatenate([away, pin.log3(R.T @ pose.rotation)])
        return position, twist - data.qvel[self._dofs[:6]], acceleration

    def _dynamics(self, state: RobotState) -> tuple[Matrix, Vector]:
        """Return inertia and bias of root and joints, (n, n) and (n,)."""
        bias = state.data.qfrc_bias - state.data.qfrc_passive
        return state.mass_matrix()[np.ix_(self._dofs, self._dofs)], bias[self._dofs]

    def _contacts_now(self, state: RobotState) -> tuple[Matrix, Vector]:
        """Return the contact Jacobian, shape (m, n), and `J' v + k J v`.

        The latter: what feet do without accelerations, and to come to rest.
        """
        model, data, v = state.model, state.data, state.data.qvel
        J, rate = np.zeros((6, model.nv)), np.zeros((6, model.nv))
        rows: list[Matrix] = []
        moved: list[Vector] = []
        for contact in self._contacts:
            body, place = model.site_bodyid[contact.site], data.site_xpos[contact.site]
            mujoco.mj_jac(model, data, J[:3], J[3:], place, body)
            mujoco.mj_jacDot(model, data, rate[:3], rate[3:], place, body)
            count = 6 if contact.kind == "surface" else 3
            rows.append(J[:count, self._dofs])
            moved.append(rate[:count] @ v + CONTACT_DAMPING * (J[:count] @ v))
        return np.concatenate(rows), np.concatenate(moved)


def damped_inverse(J: Matrix) -> Matrix:
    """Return J^T (J J^T + eps)^-1, which stays finite at stretched knees."""
    return np.linalg.solve(J @ J.T + SINGULAR**2 * np.eye(len(J)), J).T


def _carrying(
    state: RobotState, joints: Sequence[str], contacts: Sequence[StanceContact]
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
