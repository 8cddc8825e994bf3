"""Keep a robot with a free root on its feet while other laws move its joints.

A free root has no motor: contact forces at the feet carry it, so they are planned
first, and the joint torques follow from them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pinocchio as pin

from wbc_suite.compiling import compiled
from wbc_suite.control.law.free_root import (
    Flags,
    RootMotion,
    contact_jacobian,
    equations_of_motion,
    law_dofs,
    leg_gram,
    root_reference,
    write_motion,
)
from wbc_suite.control.law.joint_laws import JointLawConfig
from wbc_suite.control.law.law import Law
from wbc_suite.control.loop.physics import Physics
from wbc_suite.control.loop.records import (
    MOST_FEET,
    CompiledRecords,
    LawKind,
    Records,
)
from wbc_suite.control.state import RobotState
from wbc_suite.errors import ConfigError
from wbc_suite.linear_algebra import (
    cholesky,
    pseudo_inverse,
    solve_lower,
    solve_upper,
)
from wbc_suite.qp import Sole
from wbc_suite.typing import Matrix, Vector

TORQUE_ARM = 0.05
"""m; a contact torque of 0.05 N m costs as much as a force of 1 N: soles are small."""

LEAST_PRESSURE = 10.0
"""N; normal force that the arms' accelerations leave at each foot."""

RANK = 1e-9
"""Part of the stiffest direction; in softer ones feet give no force."""


@dataclass(frozen=True, kw_only=True, slots=True)
class StanceContact:
    """A frame on the ground, by its site in the simulation."""

    site: int
    kind: Literal["point", "surface"]


class StanceLaw(Law):
    """Contact forces that let a robot with a free root move as other laws ask.

        a_r   = a_r* + kp e + kd e'              the root tracks its reference
        a_l  -= J_l^+ (J a + J' v + k J v)       legs comply with feet at rest
        a_a  *= s                                arms are scaled
        f     = contact forces with  J_r^T f = M_r a + h_r
        tau   = M_j a + h_j - J_j^T f

    Legs that tracked their own joints would, once a foot has slipped, press against
    each other and push root and arm aside. s is the greatest part of 1 that leaves each
    foot a normal force of 10 N: a hand that is blocked by floor or table presses as
    hard as its arm accelerates, and would lift the robot off its feet.

    It drives no joint itself: `J_j^T f` is subtracted from the torques of other laws.

    Args:
        state: The robot in the simulation.
        joints: All joints with a motor that follows accelerations.
        contacts: Frames on the ground.
        config: Gains of the root.
        soles: Edges of the soles, in the order of the contacts; with them the law
            balances, see `balance_law`, and the root follows the centre of mass.

    Source: Righetti et al. (2011), "Inverse dynamics control of floating-base robots
    with external constraints: a unified view", ICRA.
    """

    def __init__(
        self,
        state: RobotState,
        joints: Sequence[str],
        contacts: Sequence[StanceContact],
        config: JointLawConfig,
        soles: Sequence[Sole] = (),
    ) -> None:
        super().__init__(LawKind.BALANCE if soles else LawKind.STANCE, state, joints)
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
        stance["edges"][: len(soles)] = [(*s.x, *s.y) for s in soles] or 0.0
        self.lead(RootMotion.still(pin.SE3.Identity()))

    def reset(self, state: RobotState) -> None:
        """Reset the disturbance observer."""
        super().reset(state)
        first = int(self._stance["dof"])
        self._stance["desired"] = 0.0
        self._stance["last_velocity"] = state.data.qvel[first : first + 6]

    def lead(self, motion: RootMotion) -> None:
        """Set the root's reference from now on; `aim` sets that of the joints."""
        start, stance = motion.start, self._stance
        self.record["start"] = np.concatenate(
            [start.rotation.ravel(), start.translation]
        )
        stance["behind"], stance["twist"] = motion.behind, motion.twist
        stance["curve"], stance["bend"] = motion.curve, motion.bend
        self.record["since"] = 0.0

    @property
    def _stance(self) -> Records:
        return self.record["stance"][0]


@compiled
def stance_law(physics: Physics, law: CompiledRecords, drives: CompiledRecords) -> None:
    """Write accelerations and contact forces of `StanceLaw`."""
    dofs = law_dofs(law, drives)
    M, h, a = equations_of_motion(physics, dofs)
    position, velocity, acceleration = root_reference(physics, law)
    a[:6] = acceleration + law.kp * position + law.kd * velocity
    J, drift, is_leg = contact_jacobian(physics, law, dofs)
    _comply_with_feet(J, drift, is_leg, a)
    fixed, arms = h[:6].copy(), np.zeros(6)  # wrench for root and legs, and for arms
    for i in range(6):
        for j in range(dofs.shape[0]):
            if j < 6 or is_leg[j]:
                fixed[i] += M[i, j] * a[j]
            else:
                arms[i] += M[i, j] * a[j]
    part, f = _contact_forces(law, J, fixed, arms)
    for j in range(6, dofs.shape[0]):
        if not is_leg[j]:
            a[j] *= part
    write_motion(physics, law, drives, J, a, f)


@compiled
def _comply_with_feet(J: Matrix, drift: Vector, is_leg: Flags, a: Vector) -> None:
    """Subtract `J_l^+ (J a + drift)` from the legs' accelerations."""
    m, size = J.shape
    x = drift.copy()
    for r in range(m):
        for j in range(size):
            x[r] += J[r, j] * a[j]
    A = leg_gram(J, is_leg)
    cholesky(A, m, 0.0)
    solve_lower(A, x, m)
    solve_upper(A, x, m)
    for j in range(6, size):
        if is_leg[j]:
            for r in range(m):
                a[j] -= J[r, j] * x[r]


@compiled
def _contact_forces(
    law: CompiledRecords, J: Matrix, fixed: Vector, arms: Vector
) -> tuple[float, Vector]:
    """Share a wrench on the root among contacts that push but do not pull.

        minimise f^T W f  subject to  J_r^T f = fixed + s arms,

    whose solution is `f = W^-1 J_r (J_r^T W^-1 J_r)^+ wrench`. The contact that would
    pull hardest is left out, and the rest is solved again.

    Args:
        law: The law.
        J: Jacobian of all feet.
        fixed: Wrench that root and legs need, shape (6,).
        arms: Wrench that the arms' accelerations add.

    Returns:
        s and f, shape (m,).
    """
    m, feet = J.shape[0], law.stance.feet
    weight, first = np.empty(m), np.zeros(feet + 1, dtype=np.int64)
    for k in range(feet):
        first[k + 1] = first[k] + law.stance.rows[k]
        for i in range(law.stance.rows[k]):
            weight[first[k] + i] = 1.0 if i < 3 else TORQUE_ARM**2
    f, change = _share(J, weight, fixed), _share(J, weight, arms)
    part = 1.0
    for k in range(feet):
        normal = first[k] + 2
        if change[normal] < 0.0:
            room = (float(f[normal]) - LEAST_PRESSURE) / -float(change[normal])
            part = min(part, max(room, 0.0))
    wrench = fixed + part * arms
    f = _share(J, weight, wrench)
    for _ in range(feet):
        worst = 0
        for k in range(feet):
            if f[first[k] + 2] < f[first[worst] + 2]:
                worst = k
        if f[first[worst] + 2] >= 0.0:
            break
        weight[first[worst] : first[worst + 1]] = 0.0
        f = _share(J, weight, wrench)
    return part, f


@compiled
def _share(J: Matrix, weight: Vector, wrench: Vector) -> Vector:
    """Return `W^-1 J_r (J_r^T W^-1 J_r)^+ wrench`; weight is the diagonal of W^-1."""
    m = J.shape[0]
    A, P = np.zeros((6, 6)), np.empty((6, 6))
    for i in range(6):
        for j in range(6):
            for r in range(m):
                A[i, j] += J[r, i] * weight[r] * J[r, j]
    pseudo_inverse(A, RANK, P)
    f = np.zeros(m)
    for r in range(m):
        for i in range(6):
            for j in range(6):
                f[r] += weight[r] * J[r, i] * P[i, j] * wrench[j]
    return f
