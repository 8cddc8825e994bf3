"""The control laws in NumPy with MuJoCo's own functions: oracles of the kernels.

Each class holds one law of `wbc_suite.control.law` to its formula: matrices are
inverted as they stand there, and QPs are solved by daqp.
"""

import daqp
import mujoco
import numpy as np
import pinocchio as pin

from wbc_suite.compiling import compiled, plain
from wbc_suite.control.ground.acceleration_limits import RATE
from wbc_suite.control.ground.records import LawKind
from wbc_suite.control.law.osc import LEAST_DAMPING, SINGULAR
from wbc_suite.control.law.osc_saturation import POSTURE_COST, SHORTENING_COST
from wbc_suite.control.run.motor_commands import write_commands

UNBOUNDED = 1e30


class Textbook:
    """A law of the package, whose records are read and written."""

    def __init__(self, law):
        self._law = law
        self.kind = LawKind(int(law.record["kind"][0]))

    def __getattr__(self, name):
        return getattr(self._law, name)

    @property
    def is_following(self):
        return self.kind not in (LawKind.TORQUE, LawKind.SERVO)

    def advance(self, state):
        """Let a step's time pass, as the loop does before each step."""
        self.record["since"] += state.model.opt.timestep

    def acceleration(self, state, others):
        """Return the joint accelerations asked for, shape (n,).

        Args:
            state, after `mj_step1`.
            others, shape (nv,).
        """
        raise NotImplementedError

    def within_limits(self, state, a):
        """Return accelerations that keep position and velocity limits, shape (n,).

        At the distance d from a limit the speed towards it may be

            u(d) = min(sqrt(2 b d + (b / r)^2) - b / r, fastest)

        so that the braking b stops the joint in time, by an exponential decay of rate
        r at the end. A joint that obeys has `v' = -u'(d) v`; one that is slower or too
        fast tends to u at the rate r:

            v' <= r (u(d) - v) - u'(d) v.

        The a returned is the nearest in that interval, joint by joint: the minimiser
        of `|| a' - a ||^2`. Beyond a limit u is r d, back inside.
        """
        lower, upper = self.window(state)
        return np.maximum(np.minimum(a, upper), lower)

    def window(self, state):
        """Return the bounds of `within_limits`, shape (n,) each."""
        drives, data = self.drives, state.data
        q, v = data.qpos[drives["qpos"]], data.qvel[drives["dof"]]
        upper = _most(drives["position_max"] - q, v, drives)
        return -_most(q - drives["position_min"], -v, drives), upper

    def command(self, state, force, bias):
        """Return the actuators' commands within their limits, shape (n,).

        Args:
            state, after `mj_step1`.
            force, shape (nv,).
            bias, shape (nv,).
        """
        dofs = self.drives["dof"]
        tau = force[dofs] + self.record["compensation"][0] * bias[dofs]
        return self._clipped(tau - self.drives["disturbance"])

    def _clipped(self, command):
        drives = self.drives
        drives["command"] = np.clip(
            command, drives["command_min"], drives["command_max"]
        )
        drives["saturation"] = drives["command"] - command
        return drives["command"]


class Joint(Textbook):
    def acceleration(self, state, others):
        """Return a, shape (n,), rad/s^2 or m/s^2."""
        q, v, a = self.target()
        drives, data = self.drives, state.data
        position_error = q - data.qpos[drives["qpos"]]
        velocity_error = v - data.qvel[drives["dof"]]
        correction = drives["kp"] * position_error + drives["kd"] * velocity_error
        return a + np.clip(
            correction, -drives["correction_max"], drives["correction_max"]
        )


class Velocity(Joint):
    def advance(self, state):
        """Move the targets by one step."""
        super().advance(state)
        self._v, self._a = self._motion()
        drives, q = self.drives, state.data.qpos[self.drives["qpos"]]
        moved = drives["position"] + state.model.opt.timestep * self._v
        moved = np.clip(moved, q - drives["windup_max"], q + drives["windup_max"])
        drives["position"] = np.clip(
            moved, drives["position_min"], drives["position_max"]
        )

    def target(self):
        """Return position, velocity and acceleration of the target now, (n,) each."""
        return self.drives["position"], self._v, self._a

    def _motion(self):
        """Return velocity and acceleration of the targets in this step."""
        return self.commanded()


class Base(Velocity):
    def _motion(self):
        (forward, sideways, turn), rate = self.commanded()
        yaw = self.drives["position"][2]
        R = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        v_x, v_y = R @ (forward, sideways)
        a_x, a_y = R @ rate[:2] + turn * np.array([-v_y, v_x])
        return np.array([v_x, v_y, turn]), np.array([a_x, a_y, rate[2]])


class Servo(Textbook):
    def acceleration(self, state, others):
        """Ask for nothing: the servo does."""
        return np.zeros(len(self.joints))

    def command(self, state, force, bias):
        """Return the set points."""
        return self._clipped(self.target()[0])


class Torque(Textbook):
    def acceleration(self, state, others):
        """Ask for no acceleration."""
        return np.zeros(len(self.joints))

    def command(self, state, force, bias):
        """Return the torques, shape (n,)."""
        data = state.data
        carried = (data.qfrc_bias - data.qfrc_gravcomp)[self.drives["dof"]]
        return self._clipped(self.target()[0] + self.record["compensation"] * carried)


class Osc(Textbook):
    def acceleration(self, state, others):
        """Return a, shape (n,), rad/s^2 or m/s^2."""
        site, dofs = int(self.record["site"][0]), self.drives["dof"]
        body = int(state.model.site_bodyid[site])
        point = state.data.site_xpos[site]
        J_all = _jacobian(state, point, body)
        wanted = self._wanted(state) - self._carried(state, J_all, others)
        J, M = J_all[:, dofs], state.mass_matrix()[np.ix_(dofs, dofs)]
        J, wanted = self._weights()[:, None] * J, self._weights() * wanted
        rest, L = self._rest(state), np.linalg.cholesky(M)
        C, Q = self.factors(np.linalg.solve(L, J.T).T)
        z = Q.T @ np.linalg.solve(C, wanted - J @ rest)
        a = rest + np.linalg.solve(L.T, z)
        if self.record["keep_direction"][0]:
            a += self.straightened(state, a, others, (L, C, Q))
        return a

    def _weights(self):
        """Return the weights of linear and angular accelerations, shape (6,)."""
        return np.repeat([1.0, self.record["turn_weight"][0]], 3)

    @staticmethod
    def factors(Y):
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
        state,
        a,
        others,
        factors,
    ):
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
            state, after `mj_step1`.
            a, shape (n,).
            others, shape (nv,).
            factors: Of `M = L L^T`, shape (n, n), then C and Q of `factors`.
        """
        L, C, Q = factors
        n, drives, (lower, upper) = len(a), self.drives, self.window(state)
        tau = self._torque(state, a, others)
        low = np.concatenate([lower - a, drives["command_min"] - tau, np.zeros(2)])
        high = np.concatenate([upper - a, drives["command_max"] - tau, np.zeros(2)])
        if (low <= 0.0).all() and (high >= 0.0).all():
            return np.zeros(n)
        pull = self._weights() * self._pull(state)
        halves = np.kron(np.eye(2), np.ones((3, 1))) * pull[:, None]
        halves = np.linalg.solve(C, halves)
        high[-2:] = np.linalg.norm(halves, axis=0)
        W = np.hstack([Q, halves / np.maximum(high[-2:], 1e-12)])
        H = W.T @ W + np.diag([POSTURE_COST] * n + [SHORTENING_COST] * 2)
        rows = np.zeros((2 * n + 2, n + 2))
        to_joints = np.linalg.inv(L.T)
        rows[:n, :n], rows[n : 2 * n, :n], rows[2 * n :, n:] = to_joints, L, np.eye(2)
        x = _least_change(H, rows, low, high)
        return np.zeros(n) if x is None else to_joints @ x[:n]

    def _torque(self, state, a, others):
        """Return the torques that accelerations need, shape (n,)."""
        asked, force = others.copy(), np.empty(state.model.nv)
        dofs = self.drives["dof"]
        asked[dofs] = a
        mujoco.mj_mulM(state.model, state.data, force, asked)
        bias = (state.data.qfrc_bias - state.data.qfrc_passive)[dofs]
        compensation = self.record["compensation"][0]
        return force[dofs] + compensation * bias - self.drives["disturbance"]

    def _rest(self, state):
        """Return a0, the accelerations that hold the posture, shape (n,)."""
        drives, data = self.drives, state.data
        error = drives["position"] - data.qpos[drives["qpos"]]
        return drives["kp"] * error - drives["kd"] * data.qvel[drives["dof"]]

    def _wanted(self, state):
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

    def _pull(self, state):
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

    def _carried(self, state, J, others):
        """Return the site's acceleration by other joints, less what its goal shares."""
        asked = others.copy()
        asked[self.drives["dof"]] = 0.0
        reference = int(self.record["reference"][0])
        shared = _jacobian(state, np.zeros(3), reference).any(axis=0)
        asked[shared] = 0.0
        return J @ asked

    def _reference(self, state):
        """Return the pose of the reference body in the world."""
        body = int(self.record["reference"][0])
        R = state.data.xmat[body].reshape(3, 3)
        return pin.SE3(R, state.data.xpos[body])


def _jacobian(state, point, body):
    """Return the Jacobian of a point of a body, linear then angular, shape (6, nv)."""
    J = np.zeros((6, state.model.nv))
    mujoco.mj_jac(state.model, state.data, J[:3], J[3:], point, body)
    return J


def _motion(state, point, body):
    """Return velocity of a point of a body and `J' v`, world axes, (6,) each."""
    J, rate = _jacobian(state, point, body), np.zeros((6, state.model.nv))
    mujoco.mj_jacDot(state.model, state.data, rate[:3], rate[3:], point, body)
    return J @ state.data.qvel, rate @ state.data.qvel


def _least_change(H, rows, low, high):
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


_CLASSES = {
    LawKind.JOINT: Joint,
    LawKind.VELOCITY: Velocity,
    LawKind.BASE: Base,
    LawKind.TORQUE: Torque,
    LawKind.SERVO: Servo,
    LawKind.OSC: Osc,
}


@compiled
def _write(loop, kernels):
    return write_commands(loop, kernels)


def write_once(simulation):
    """Compute commands in the present state; return whether that is done."""
    write = plain(write_commands) if simulation._runs_plain else _write
    return write(*simulation.loop_arguments)


def kernel_commands(simulation, state):
    """Return one command per actuator by the kernels."""
    write_once(simulation)
    return state.data.ctrl[state.actuator_ids].copy()


def textbook(law):
    """Return the oracle of a law."""
    return _CLASSES[LawKind(int(law.record["kind"][0]))](law)


def commands(state, laws):
    """Return one command per actuator, `M a + h - d - J^T f`."""
    laws = [textbook(law) for law in laws]
    model, data = state.model, state.data
    _observe(state, laws)
    asked = accelerations(state, laws)
    force = np.empty(model.nv)
    mujoco.mj_mulM(model, data, force, asked)
    bias = data.qfrc_bias - data.qfrc_passive
    command = np.zeros(len(state.actuators))
    for law in laws:
        command[law.outputs] = law.command(state, force, bias)
    return command


def observe(state, laws):
    """Update the estimated disturbances by one step."""
    _observe(state, [textbook(law) for law in laws])


def _observe(state, laws):
    """`M (v' - a) - s`, low-passed; see `control.run.disturbance_observer`."""
    dt, deviation = state.model.opt.timestep, np.zeros(state.model.nv)
    following = [law for law in laws if law.is_following]
    for law in following:
        drives = law.drives
        change = (state.data.qvel[drives["dof"]] - drives["last_velocity"]) / dt
        deviation[drives["dof"]] = change - drives["desired"]
    force = np.empty(state.model.nv)
    mujoco.mj_mulM(state.model, state.data, force, deviation)
    for law in following:
        drives, bandwidth = law.drives, law.record["observer"][0]
        if bandwidth <= 0.0:
            continue
        part = 1.0 - np.exp(-bandwidth * dt)
        estimate = drives["disturbance"] + part * (
            force[drives["dof"]] - drives["saturation"]
        )
        drives["disturbance"] = np.clip(
            estimate, drives["command_min"], drives["command_max"]
        )


def _most(distance, speed, drives):
    """Return the greatest accelerations towards limits, shape (n,)."""
    b, inside = drives["deceleration"], np.maximum(distance, 0.0)
    root = np.sqrt(2.0 * b * inside + (b / RATE) ** 2)
    allowed = np.where(distance > 0.0, root - b / RATE, RATE * distance)
    slope = np.where(np.abs(allowed) < drives["velocity_max"], b / root, 0.0)
    allowed = np.clip(allowed, -drives["velocity_max"], drives["velocity_max"])
    return RATE * (allowed - speed) - slope * speed


def accelerations(state, laws):
    """Let time pass for all laws; return what they ask of the scene, shape (nv,)."""
    asked = np.zeros(state.model.nv)
    for law in laws:
        law.advance(state)
    for law in sorted(laws, key=lambda law: law.record["kind"][0] == LawKind.OSC):
        if law.is_following:
            a = law.within_limits(state, law.acceleration(state, asked))
            asked[law.drives["dof"]] = a
    for law in laws:
        if law.is_following:
            law.drives["desired"] = asked[law.drives["dof"]]
            law.drives["last_velocity"] = state.data.qvel[law.drives["dof"]]
    return asked
