"""Track joint targets of a robot that stands on flat soles, without falling over.

A sole can only push, within its friction cone and with a pressure point inside its
edges. Motions are therefore asked for as contact forces first; what the ground cannot
give is given up, the trunk's attitude before the centre of mass.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wbc_suite.control.part.joint_position import JointLawConfig, JointTarget
from wbc_suite.control.part.stance import StanceContact, StanceLaw, damped_inverse
from wbc_suite.control.state import RobotState
from wbc_suite.qp import Problem, Sole
from wbc_suite.qp.solver import DaqpSolver
from wbc_suite.typing import Matrix, Vector

__all__ = ["BalanceLaw", "sole_rows"]

COM_STIFFNESS = 60.0  # 1/s^2; well above g / h = 12, or the pendulum falls
TRUNK_STIFFNESS = 150.0  # 1/s^2
TRUNK_COST = 0.05  # [cost] s^2/rad against 1 [cost] s^2/m: the trunk gives way first
SHARE_COST = 1e-4  # [cost]/N; keeps forces near the even share
FRICTION = 0.6  # below that of rubber on most floors, 0.8 to 1
TWIST = 0.03  # m; friction torque about the normal over normal force, of a sole
LEAST_PRESSURE = 20.0  # N; a sole never lets go
EDGE = 0.008  # m; how far pressure points stay from a sole's edge
TORQUE_SHARE = 0.95  # of the motors' limits that planned forces may ask for


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
    """Inverse dynamics through soles that push, with feedback of the centre of mass.

    With soles at rest, the acceleration of the legs follows from the root's, and the
    root's from the contact forces f alone, M being the inertia of everything:

        a_l = a_t - J_l^+ (J_r a_r + J_l a_t + J' v + k J v)
        A a_r + b = J_r^T f,   A = M_rr - M_rl J_l^+ J_r

    a_t is what tracks the legs' joints, and counts only where knees are stretched.
    Wanted are the centre of mass's acceleration `c*'' + k e + d e'`, the trunk's
    likewise, and, of arms, waist and head, what `JointPositionLaw` asks for. The f that
    gives both, shared evenly, is taken when all soles can give it and all legs can
    carry it. Otherwise the nearest that they can is, by a QP in f.

    Args:
        state: The robot in the simulation.
        joints: Driven joints; each has a motor.
        contacts: The soles' frames.
        config: Gains of joints.
        soles: The soles' edges, in the same order.

    Source: Righetti et al. (2013), "Optimal distribution of contact forces with
    inverse-dynamics control", IJRR 32(3).
    """

    def __init__(
        self,
        state: RobotState,
        joints: tuple[str, ...],
        contacts: Sequence[StanceContact],
        config: JointLawConfig,
        soles: Sequence[Sole],
    ) -> None:
        super().__init__(state, joints, contacts, config)
        self._soles = tuple(soles)
        self._problem = Problem(6 * len(soles), 10 * len(soles) + len(self._legs))
        self._solver = DaqpSolver()

    def torque(self, state: RobotState, target: JointTarget) -> Vector:
        """Return torques within the motors' limits; see `JointPositionLaw.torque`."""
        errors = self._errors(state, target)
        joints = target.acceleration + self.config.kp * errors[0][6:]
        joints += self.config.kd * errors[1][6:]
        dynamics = self._dynamics(state, joints)
        root = self._root_acceleration(dynamics, target, errors)
        f = self._forces(state, dynamics, dynamics.A @ root + dynamics.b)
        root = dynamics.lift @ (dynamics.J[:, :6].T @ f - dynamics.b)
        a = dynamics.S @ root + dynamics.s
        tau = dynamics.M[6:] @ a + dynamics.h[6:] - dynamics.J[:, 6:].T @ f
        return np.clip(tau, self._low, self._high)

    def _dynamics(self, state: RobotState, joints: Vector) -> _Dynamics:
        """Express all accelerations by the root's, with soles at rest."""
        data, legs = state.data, self._legs
        M = state.mass_matrix()[self._block]
        h = (data.qfrc_bias - data.qfrc_passive)[self._dofs]
        J = self._contact_jacobian(state)
        J_inverse = damped_inverse(J[:, legs])
        S, s = np.zeros((len(M), 6)), np.zeros(len(M))
        S[:6], S[legs] = np.eye(6), -J_inverse @ J[:, :6]
        s[6:] = joints
        moved = self._contact_motion(state, J)
        s[legs] -= J_inverse @ (moved + J[:, legs] @ s[legs])
        A, b = M[:6] @ S, M[:6] @ s + h[:6]
        return _Dynamics(M=M, h=h, J=J, S=S, s=s, A=A, b=b, lift=np.linalg.inv(A))

    def _root_acceleration(
        self, dynamics: _Dynamics, target: JointTarget, errors: tuple[Vector, Vector]
    ) -> Vector:
        """Return what moves the centre of mass and turns the trunk as wanted, (6,).

        The root's linear rows of M are m J_c: they turn errors of joints into those of
        the centre of mass.
        """
        assert target.root_acceleration is not None
        position, velocity = errors
        ahead = np.concatenate([target.root_acceleration, target.acceleration])
        com = ahead + COM_STIFFNESS * position + _damping(COM_STIFFNESS) * velocity
        force = dynamics.M[:3] @ com + dynamics.h[:3]
        turn = target.root_acceleration[3:] + TRUNK_STIFFNESS * position[3:6]
        turn = turn + _damping(TRUNK_STIFFNESS) * velocity[3:6]
        A = dynamics.A[:3]
        linear = np.linalg.solve(A[:, :3], force - dynamics.b[:3] - A[:, 3:] @ turn)
        return np.concatenate([linear, turn])

    def _forces(self, state: RobotState, dynamics: _Dynamics, wrench: Vector) -> Vector:
        """Return contact forces that soles and legs can bear, for a wrench or near."""
        J_root = dynamics.J[:, :6]
        even = _even_share(J_root, wrench, self._weights)
        problem = self._problem
        self._write_bounds(state, dynamics)
        if problem.violation(even) <= 0.0:
            return even
        effect = np.concatenate(
            [np.eye(6)[:3] / dynamics.M[0, 0], TRUNK_COST * dynamics.lift[3:]]
        )
        effect = effect @ J_root.T
        problem.H[:] = effect.T @ effect + np.diag(SHARE_COST**2 * self._weights)
        problem.c[:] = -problem.H @ even
        answer = self._solver.solve(problem)
        return even if answer is None else answer[0]

    def _write_bounds(self, state: RobotState, dynamics: _Dynamics) -> None:
        """Fill in what soles can give and legs can carry."""
        problem, count = self._problem, len(self._soles)
        for k, (contact, sole) in enumerate(
            zip(self._contacts, self._soles, strict=True)
        ):
            rotation = state.data.site_xmat[contact.site].reshape(3, 3)
            rows, columns = slice(10 * k, 10 * k + 10), slice(6 * k, 6 * k + 6)
            problem.G[rows, columns] = sole_rows(sole, rotation)
            problem.lb[6 * k + 2] = LEAST_PRESSURE
        problem.h[: 10 * count] = 0.0
        legs, M = self._legs, dynamics.M[self._legs]
        J = dynamics.J
        problem.G[10 * count :] = M @ dynamics.S @ dynamics.lift @ J[:, :6].T
        problem.G[10 * count :] -= J[:, legs].T
        offset = M @ (dynamics.s - dynamics.S @ (dynamics.lift @ dynamics.b))
        offset += dynamics.h[legs]
        problem.h[10 * count :] = TORQUE_SHARE * self._high[legs - 6] - offset
        problem.lower[problem.nv + 10 * count :] = (
            TORQUE_SHARE * self._low[legs - 6] - offset
        )


def _even_share(J_root: Matrix, wrench: Vector, weights: Vector) -> Vector:
    """Return the least f, by weights, with J_root^T f = wrench; see `contact_forces`.

    Here a sole may have to pull: what it cannot give, a QP makes up for.
    """
    scaled = J_root / weights[:, None]
    return scaled @ np.linalg.solve(J_root.T @ scaled, wrench)


def _damping(stiffness: float) -> float:
    return 2.0 * float(np.sqrt(stiffness))
