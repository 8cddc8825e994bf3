"""The law in operational space."""

from collections.abc import Sequence

import daqp
import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.control.loop.osc import LEAST_DAMPING, SINGULAR
from wbc_suite.control.loop.straight import POSTURE_COST, SHORTENING_COST
from wbc_suite.control.loop.table import LawKind
from wbc_suite.control.part.law import Law
from wbc_suite.control.part.osc_step import jump
from wbc_suite.control.state import RobotState
from wbc_suite.typing import Matrix, Vector

__all__ = ["OscLaw"]

UNBOUNDED = 1e30
"""A bound that binds nothing, to daqp."""


class OscLaw(Law):
    """A site follows its goal, and joints a posture where the site leaves them free.

    Among all joint accelerations that move the site as wanted, the nearest to those
    that the posture wants, measured by inertia:

        minimise    (a - a0)^T M (a - a0)
        subject to  J a = x'' - J' v,     x'' = kd (u - v_s),  u = kp / kd e + v*

    Its KKT conditions give, with the inertia L = (J M^-1 J^T)^-1 that the site feels,

        a = a0 + M^-1 J^T L (x'' - J' v - J a0),    tau = M a + h.

    e is the target's pose less the site's (rotation vector of `R_target R^T`), v_s the
    site's velocity and v* the target's, all in the axes of the reference body, in which
    kp and kd may differ by axis: `x'' = kp e + kd e'`. The velocity u that this asks
    for is no longer than `speed`, for linear and angular motion each. A goal in a
    moving reference moves with it. Pushed with a wrench f, the site yields by
    `(L kp)^-1 f`.

    Where a joint cannot do this, see `straightened`.

    Args:
        state: The robot in the simulation.
        joints: Joints that move the site.
        site: The site's name in the robot.

    Source: Khatib (1987), "A unified approach for motion and force control of robot
    manipulators: the operational space formulation", IEEE J. Robotics and Automation.
    """

    def __init__(self, state: RobotState, joints: Sequence[str], site: str) -> None:
        super().__init__(LawKind.OSC, state, joints)
        self.record["site"] = state.model.site(state.prefix + site).id
        self.record["speed"] = np.inf

    def set_goal(
        self, goal: pin.SE3, *, start: pin.SE3 | None = None, duration: float = 0.0
    ) -> None:
        """Set the goal in the reference's axes.

        Args:
            goal: Pose in the end.
            start: Where the target is now; the goal when absent.
            duration: Time that it takes from there, s, at constant speeds.
        """
        start = goal if start is None else start
        record = self.record
        record["start"][0] = (*start.rotation.ravel(), *start.translation)
        record["shift"][0] = goal.translation - start.translation
        record["turn"][0] = pin.log3(start.rotation.T @ goal.rotation)
        record["since"], record["duration"] = 0.0, duration

    def jump(self, goal: Vector) -> None:
        """Set the goal at once: rotation row by row, and position, shape (12,)."""
        jump(self.record, goal)

    def frames(self, state: RobotState) -> tuple[Vector, Vector, Vector, Vector]:
        """Return views of rotation and position of the reference, then of the site."""
        body, site = int(self.record["reference"][0]), int(self.record["site"][0])
        data = state.data
        return (
            data.xmat[body],
            data.xpos[body],
            data.site_xmat[site],
            data.site_xpos[site],
        )

    def target_pose(self) -> tuple[pin.SE3, Vector]:
        """Return the target now, and its twist, in the reference's axes."""
        record = self.record[0]
        duration = float(record["duration"])
        phase = min(1.0, float(record["since"]) / duration) if duration > 0.0 else 1.0
        moving = 1.0 / duration if 0.0 < duration >= record["since"] else 0.0
        start, turn = record["start"][:9].reshape(3, 3), record["turn"]
        pose = pin.SE3(
            start @ pin.exp3(phase * turn),
            record["start"][9:] + phase * record["shift"],
        )
        return pose, moving * np.concatenate([record["shift"], start @ turn])

    def site_pose(self, state: RobotState) -> pin.SE3:
        """Return the site's pose in the reference's axes."""
        site = int(self.record["site"][0])
        data = state.data
        R = data.site_xmat[site].reshape(3, 3)
        return self._reference(state).actInv(pin.SE3(R, data.site_xpos[site]))

    def acceleration(self, state: RobotState, others: Vector) -> Vector:
        """Return a, shape (n,), rad/s^2 or m/s^2."""
        site, dofs = int(self.record["site"][0]), self.drives["dof"]
        body = int(state.model.site_bodyid[site])
        point = state.data.site_xpos[site]
        J_all = _jacobian(state, point, body)
        wanted = self._wanted(state) - self._carried(state, J_all, others)
        J, M = J_all[:, dofs], state.mass_matrix()[np.ix_(dofs, dofs)]
        rest, L = self._rest(state), np.linalg.cholesky(M)
        C, Q = self.factors(np.linalg.solve(L, J.T).T)
        z = Q.T @ np.linalg.solve(C, wanted - J @ rest)
        a = rest + np.linalg.solve(L.T, z)
        if self.record["straight"][0]:
            a += self.straightened(state, a, others, (L, C, Q))
        return a

    @staticmethod
    def factors(Y: Matrix) -> tuple[Matrix, Matrix]:
        """Return C, (6, 6), and Q, (6, n) with orthonormal rows, of `Y = C Q`.

        With `M = L L^T` and `z = L^T (a - a0)` the law is the shortest z with `Y z =
        x'' - J' v - J a0`, where `Y = J L^-T` and `Y Y^T = J M^-1 J^T` is the mobility:
        `z = Q^T C^-1 (x'' - J' v - J a0)`, as exact as Y, where a stretched arm's
        mobility has lost half of the digits.

        Where the least mobility `m = 1 / trace((Y Y^T)^-1)`, which is at most its least
        eigenvalue, is below `SINGULAR`, the law is damped: `Y Y^T + (SINGULAR - m) I`
        takes the place of the mobility, and `[Y, sqrt(SINGULAR - m) I]` that of Y.
        """
        values = np.linalg.svd(Y, compute_uv=False)
        full = Y.shape[1] >= 6 and values[-1] > 0.0
        missing = SINGULAR - (1.0 / np.sum(values**-2) if full else 0.0)
        damping = np.sqrt(max(missing, 0.0)) * np.eye(len(Y))
        Q, R = np.linalg.qr(np.hstack([Y, damping]).T)
        return R.T, Q.T[:, : Y.shape[1]]

    def straightened(
        self,
        state: RobotState,
        a: Vector,
        others: Vector,
        factors: tuple[Matrix, Matrix, Matrix],
    ) -> Vector:
        """Return the change b of the accelerations that keeps the hand's direction.

        Where motors or speeds are at their limits, the speed u that the goal asks for
        becomes less, for linear and angular motion by itself, and the arm's posture
        gives way, before the hand turns aside. At the least the hand brakes, `x'' =
        -kd v_s`:

            minimise    || J b + h_1 x_1 + h_2 x_2 ||^2_L + c_h (h_1^2 + h_2^2)
                        + c_b b^T M b
            subject to  a_min <= a + b <= a_max,  tau_min <= tau + M b <= tau_max,
                        0 <= h_i <= || kd u_i ||_L

        with `x_i = kd u_i / || kd u_i ||_L`, the linear and the angular half of u, and
        the norm `|| x ||^2_L = x^T L x`; a_min and a_max are those of `within_limits`.
        Nothing changes when a and tau are within their limits, nor when these exclude
        each other. In the factors, and the variable z of `b = L^-T z`, the norms are
        `|| J b ||_L = || Q z ||`, `|| x ||_L = || C^-1 x ||` and `b^T M b = z^T z`.

        Args:
            state: The robot, after `mj_step1`.
            a: What the law asks for, shape (n,).
            others: What laws before this one asked of the whole scene, shape (nv,).
            factors: Of `M = L L^T`, shape (n, n), then C and Q of `factors`.
        """
        L, C, Q = factors
        n, drives, (lower, upper) = len(a), self.drives, self.window(state)
        tau = self._torque(state, a, others)
        low = np.concatenate([lower - a, drives["low"] - tau, np.zeros(2)])
        high = np.concatenate([upper - a, drives["high"] - tau, np.zeros(2)])
        if (low <= 0.0).all() and (high >= 0.0).all():
            return np.zeros(n)
        halves = np.kron(np.eye(2), np.ones((3, 1))) * self._pull(state)[:, None]
        halves = np.linalg.solve(C, halves)
        high[-2:] = np.linalg.norm(halves, axis=0)
        W = np.hstack([Q, halves / np.maximum(high[-2:], 1e-12)])
        H = W.T @ W + np.diag([POSTURE_COST] * n + [SHORTENING_COST] * 2)
        rows = np.zeros((2 * n + 2, n + 2))
        to_joints = np.linalg.inv(L.T)
        rows[:n, :n], rows[n : 2 * n, :n], rows[2 * n :, n:] = to_joints, L, np.eye(2)
        x = _least_change(H, rows, low, high)
        return np.zeros(n) if x is None else to_joints @ x[:n]

    def _torque(self, state: RobotState, a: Vector, others: Vector) -> Vector:
        """Return the torques that accelerations need, shape (n,)."""
        asked, force = others.copy(), np.empty(state.model.nv)
        dofs = self.drives["dof"]
        asked[dofs] = a
        mujoco.mj_mulM(state.model, state.data, force, asked)
        bias = (state.data.qfrc_bias - state.data.qfrc_passive)[dofs]
        compensation = self.record["compensation"][0]
        return force[dofs] + compensation * bias - self.drives["disturbance"]

    def _rest(self, state: RobotState) -> Vector:
        """Return a0, the accelerations that hold the posture, shape (n,)."""
        drives, data = self.drives, state.data
        error = drives["position"] - data.qpos[drives["qpos"]]
        return drives["kp"] * error - drives["kd"] * data.qvel[drives["dof"]]

    def _wanted(self, state: RobotState) -> Vector:
        """Return `x'' - J' v`, and what a moving reference adds, shape (6,)."""
        site, data = int(self.record["site"][0]), state.data
        reference = int(self.record["reference"][0])
        goal = self._reference(state) * self.target_pose()[0]
        body = int(state.model.site_bodyid[site])
        moved, turning = _motion(state, goal.translation, reference)
        velocity, drift = _motion(state, data.site_xpos[site], body)
        axes = np.kron(np.eye(2), self._reference(state).rotation)
        kd = np.maximum(self.record[0]["kd"], LEAST_DAMPING)
        braking = axes @ (kd * (axes.T @ (moved - velocity)))
        return self._pull(state) + braking + turning - drift

    def _pull(self, state: RobotState) -> Vector:
        """Return `kd u`, world axes, shape (6,)."""
        record, data = self.record[0], state.data
        reference, site = self._reference(state), int(record["site"])
        pose, twist = self.target_pose()
        goal = reference * pose
        R_ws = data.site_xmat[site].reshape(3, 3)
        turn = pin.log3(goal.rotation @ R_ws.T)
        error = np.concatenate([goal.translation - data.site_xpos[site], turn])
        axes = np.kron(np.eye(2), reference.rotation)
        kp, kd = record["kp"], np.maximum(record["kd"], LEAST_DAMPING)
        u = kp / kd * (axes.T @ error) + twist
        for half in (0, 1):
            part = u[3 * half : 3 * half + 3]
            part *= min(1.0, record["speed"][half] / max(np.linalg.norm(part), 1e-300))
        return axes @ (kd * u)

    def _carried(self, state: RobotState, J: Matrix, others: Vector) -> Vector:
        """Return the site's acceleration by other joints, less what its goal shares."""
        asked = others.copy()
        asked[self.drives["dof"]] = 0.0
        reference = int(self.record["reference"][0])
        shared = _jacobian(state, np.zeros(3), reference).any(axis=0)
        asked[shared] = 0.0
        return J @ asked

    def _reference(self, state: RobotState) -> pin.SE3:
        """Return the pose of the reference body in the world."""
        body = int(self.record["reference"][0])
        R = state.data.xmat[body].reshape(3, 3)
        return pin.SE3(R, state.data.xpos[body])


def _jacobian(state: RobotState, point: Vector, body: int) -> Matrix:
    """Return the Jacobian of a point of a body, linear then angular, shape (6, nv)."""
    J = np.zeros((6, state.model.nv))
    mujoco.mj_jac(state.model, state.data, J[:3], J[3:], point, body)
    return J


def _motion(state: RobotState, point: Vector, body: int) -> tuple[Vector, Vector]:
    """Return velocity of a point of a body and `J' v`, world axes, (6,) each."""
    J, rate = _jacobian(state, point, body), np.zeros((6, state.model.nv))
    mujoco.mj_jacDot(state.model, state.data, rate[:3], rate[3:], point, body)
    return J @ state.data.qvel, rate @ state.data.qvel


def _least_change(H: Matrix, rows: Matrix, low: Vector, high: Vector) -> Vector | None:
    """Minimise `x^T H x` subject to `low <= rows x <= high`; None if nothing obeys.

    In the variables R^T x, with `H = R R^T`, and with rows of length 1, for H may be
    ill-conditioned where the arm is stretched.
    """
    R = np.linalg.cholesky(H)
    scaled = np.linalg.solve(R, rows.T).T
    length = np.linalg.norm(scaled, axis=1)
    n, free = len(H), np.zeros(len(rows), dtype=np.intc)
    low, high, rows = low / length, high / length, scaled / length[:, None]
    low, high = np.maximum(low, -UNBOUNDED), np.minimum(high, UNBOUNDED)
    y, _, flag, _ = daqp.solve(
        np.eye(n), np.zeros(n), rows, high, low, free, primal_tol=1e-12
    )
    return np.linalg.solve(R.T, y) if flag > 0 else None
