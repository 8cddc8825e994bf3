"""Track joint targets of a robot that stands on flat soles, without falling over.

A sole can only push, within its friction cone and with a pressure point inside its
edges. Motions are therefore asked for as contact forces first; what the ground cannot
give is given up, the trunk's attitude before the centre of mass.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import daqp
import numpy as np

from wbc_suite.control.loop.balance import (
    COM_STIFFNESS,
    EDGE,
    FRICTION,
    LEAST_PRESSURE,
    SHARE_COST,
    TORQUE_SHARE,
    TRUNK_COST,
    TRUNK_STIFFNESS,
    TWIST,
)
from wbc_suite.control.loop.table import LawKind
from wbc_suite.control.part.joint import JointLawConfig
from wbc_suite.control.part.stance import (
    StanceContact,
    StanceLaw,
    damped_inverse,
    even_share,
)
from wbc_suite.control.state import RobotState
from wbc_suite.qp import Sole
from wbc_suite.qp.problem import UNBOUNDED
from wbc_suite.typing import Matrix, Vector

__all__ = ["BalanceLaw", "sole_rows"]


def sole_rows(sole: Sole, rotation: Matrix) -> Matrix:
    """Return rows G of what a sole can give, `G (force, torque) <= 0`, world axes.

    Friction as a pyramid inside the cone, the pressure point inside the edges, and a
    bounded torque about the normal; x y z are the sole's axes:

        |f_x|, |f_y| <= mu f_z / sqrt(2),   |t_z| <= TWIST f_z,
        y_min f_z <= t_x <= y_max f_z,      x_min f_z <= -t_y <= x_max f_z.

    Args:
        sole: Its edges.
        rotation: R_ws of its frame.

    Returns:
        Shape (10, 6).
    """
    mu = FRICTION / np.sqrt(2.0)
    (heel, toes), (right, left) = sole.x, sole.y
    local = np.array(
        [
            [1.0, 0.0, -mu, 0.0, 0.0, 0.0],
            [-1.0, 0.0, -mu, 0.0, 0.0, 0.0],
            [0.0, 1.0, -mu, 0.0, 0.0, 0.0],
            [0.0, -1.0, -mu, 0.0, 0.0, 0.0],
            [0.0, 0.0, -(left - EDGE), 1.0, 0.0, 0.0],
            [0.0, 0.0, right + EDGE, -1.0, 0.0, 0.0],
            [0.0, 0.0, -(toes - EDGE), 0.0, -1.0, 0.0],
            [0.0, 0.0, heel + EDGE, 0.0, 1.0, 0.0],
            [0.0, 0.0, -TWIST, 0.0, 0.0, 1.0],
            [0.0, 0.0, -TWIST, 0.0, 0.0, -1.0],
        ]
    )
    return np.hstack([local[:, :3] @ rotation.T, local[:, 3:] @ rotation.T])


@dataclass(frozen=True, kw_only=True, slots=True)
class _Dynamics:
    """Equations of motion with soles at rest; see `BalanceLaw`.

    Attributes:
        M: Inertia of root and joints, shape (n, n).
        h: Coriolis, centrifugal, gravity less passive forces, shape (n,).
        J: Contact Jacobian, shape (m, n).
        S: With s, all accelerations by the root's: `a = S a_r + s`, shape (n, 6).
        s: Shape (n,).
        A: `A a_r + b = J_r^T f`, shape (6, 6).
        b: Shape (6,).
        lift: Inverse of A.
    """

    M: Matrix
    h: Vector
    J: Matrix
    S: Matrix
    s: Vector
    A: Matrix
    b: Vector
    lift: Matrix


class BalanceLaw(StanceLaw):
    """Contact forces of soles that push, with feedback of the centre of mass.

    With soles at rest, the acceleration of the legs follows from the root's, and the
    root's from the contact forces f alone, M being the inertia of everything:

        a_l = a_t - J_l^+ (J_r a_r + J_l a_t + J' v + k J v)
        A a_r + b = J_r^T f,   A = M_rr - M_rl J_l^+ J_r

    a_t is what tracks the legs' joints, and counts only where knees are stretched.
    Wanted are the centre of mass's acceleration `c*'' + k e + d e'`, the trunk's
    likewise, and, of arms, waist and head, what other laws ask for. The f that
    gives both, shared evenly, is taken when all soles can give it and all legs can
    carry it. Otherwise the nearest that they can is, by a QP in f.

    Args:
        state: The robot in the simulation.
        joints: All joints with a motor that follows accelerations; their targets tell
            where the centre of mass should be.
        contacts: The soles' frames.
        config: Not used: the root follows the centre of mass.
        soles: The soles' edges, in the same order.

    Source: Righetti et al. (2013), "Optimal distribution of contact forces with
    inverse-dynamics control", IJRR 32(3).
    """

    def __init__(
        self,
        state: RobotState,
        joints: Sequence[str],
        contacts: Sequence[StanceContact],
        config: JointLawConfig,
        soles: Sequence[Sole],
    ) -> None:
        super().__init__(state, joints, contacts, config, LawKind.BALANCE)
        self._soles = tuple(soles)
        self._stance["edges"][: len(soles)] = [(*s.x, *s.y) for s in soles]

    def stand(self, state: RobotState, asked: Vector) -> None:
        """Do what `StanceLaw.stand` does, for soles."""
        dynamics = self._standing(state, asked[self._dofs])
        root = self._root_acceleration(state, dynamics)
        f = self._forces(state, dynamics, dynamics.A @ root + dynamics.b)
        root = dynamics.lift @ (dynamics.J[:, :6].T @ f - dynamics.b)
        self._give(state, asked, dynamics.S @ root + dynamics.s, dynamics.J, f)

    def _standing(self, state: RobotState, asked: Vector) -> _Dynamics:
        """Express all accelerations by the root's, with soles at rest."""
        legs, (M, h) = self._legs, self._dynamics(state)
        J, moved = self._contacts_now(state)
        J_inverse = damped_inverse(J[:, legs])
        S, s = np.zeros((len(M), 6)), asked.copy()
        S[:6], S[legs], s[:6] = np.eye(6), -J_inverse @ J[:, :6], 0.0
        s[legs] -= J_inverse @ (moved + J[:, legs] @ s[legs])
        A, b = M[:6] @ S, M[:6] @ s + h[:6]
        return _Dynamics(M=M, h=h, J=J, S=S, s=s, A=A, b=b, lift=np.linalg.inv(A))

    def _root_acceleration(self, state: RobotState, dynamics: _Dynamics) -> Vector:
        """Return what moves the centre of mass and turns the trunk as wanted, (6,).

        The root's linear rows of M are m J_c: they turn errors of joints into those of
        the centre of mass.
        """
        position, velocity, root = self._root_errors(state)
        (q, v, a), drives, data = self.target(), self.drives, state.data
        e = np.concatenate([position, q - data.qpos[drives["qpos"]]])
        e_rate = np.concatenate([velocity, v - data.qvel[drives["dof"]]])
        com = np.concatenate([root, a]) + COM_STIFFNESS * e
        com += _damping(COM_STIFFNESS) * e_rate
        force = dynamics.M[:3] @ com + dynamics.h[:3]
        turn = root[3:] + TRUNK_STIFFNESS * position[3:]
        turn = turn + _damping(TRUNK_STIFFNESS) * velocity[3:]
        A = dynamics.A[:3]
        linear = np.linalg.solve(A[:, :3], force - dynamics.b[:3] - A[:, 3:] @ turn)
        return np.concatenate([linear, turn])

    def _forces(self, state: RobotState, dynamics: _Dynamics, wrench: Vector) -> Vector:
        """Return contact forces that soles and legs can bear, for a wrench or near.

            minimise    || J_r^T (f - f_even) ||^2 + c || f - f_even ||^2
            subject to  what soles can give and legs can carry

        with errors of the wrench as accelerations, those of the trunk at a lower cost.
        """
        J_root = dynamics.J[:, :6]
        even = even_share(J_root, self._weights) @ wrench
        rows, low, high = self._bounds(state, dynamics)
        low, high = low - rows @ even, high - rows @ even
        if (low <= 0.0).all() and (high >= 0.0).all():
            return even
        effect = np.concatenate(
            [np.eye(6)[:3] / dynamics.M[0, 0], TRUNK_COST * dynamics.lift[3:]]
        )
        effect = effect @ J_root.T
        H = effect.T @ effect + np.diag(SHARE_COST**2 * self._weights)
        change = _least_change(H, rows, low, high)
        return even if change is None else even + change

    def _bounds(
        self, state: RobotState, dynamics: _Dynamics
    ) -> tuple[Matrix, Vector, Vector]:
        """Return rows of what soles can give and legs can carry, with their bounds."""
        legs, J, m = self._legs, dynamics.J, len(dynamics.J)
        count, drives = len(self._soles), self.drives
        soles, pressed = np.zeros((10 * count, m)), np.zeros((count, m))
        for k, (contact, sole) in enumerate(
            zip(self._contacts, self._soles, strict=True)
        ):
            rotation = state.data.site_xmat[contact.site].reshape(3, 3)
            soles[10 * k : 10 * k + 10, 6 * k : 6 * k + 6] = sole_rows(sole, rotation)
            pressed[k, 6 * k + 2] = 1.0
        M, lift = dynamics.M[legs], dynamics.lift
        carried = M @ dynamics.S @ lift @ J[:, :6].T - J[:, legs].T
        offset = M @ (dynamics.s - dynamics.S @ (lift @ dynamics.b)) + dynamics.h[legs]
        below, above = drives["low"][legs - 6], drives["high"][legs - 6]
        least = np.full(count, LEAST_PRESSURE)
        low = [np.full(10 * count, -np.inf), least, TORQUE_SHARE * below - offset]
        high = [np.zeros(10 * count), np.full(count, np.inf)]
        high.append(TORQUE_SHARE * above - offset)
        rows = np.concatenate([soles, pressed, carried])
        return rows, np.concatenate(low), np.concatenate(high)


def _least_change(H: Matrix, rows: Matrix, low: Vector, high: Vector) -> Vector | None:
    """Minimise `x^T H x` subject to `low <= rows x <= high`; None if nothing obeys.

    In the variables R^T x, with `H = R R^T`, and with rows of length 1.
    """
    R = np.linalg.cholesky(H)
    scaled = np.linalg.solve(R, rows.T).T
    length = np.linalg.norm(scaled, axis=1)
    n, free = len(H), np.zeros(len(rows), dtype=np.intc)
    low, high = low / length, high / length
    low, high = np.maximum(low, -UNBOUNDED), np.minimum(high, UNBOUNDED)
    y, _, flag, _ = daqp.solve(
        np.eye(n),
        np.zeros(n),
        scaled / length[:, None],
        high,
        low,
        free,
        primal_tol=1e-12,
    )
    return np.linalg.solve(R.T, y) if flag > 0 else None


def _damping(stiffness: float) -> float:
    return 2.0 * float(np.sqrt(stiffness))
