"""Torques of a robot on its feet: planner, QP, accelerations and contact forces."""

import numpy as np

from wbc_suite.compiling import compiled, inner
from wbc_suite.control.contact.arrays import QpStage, WholeBodyDynamics
from wbc_suite.control.contact.qp_rows import write_qp
from wbc_suite.control.contact.terms import (
    measure,
    write_frame_terms,
    write_terms,
)
from wbc_suite.control.contact.tracking import track_motion
from wbc_suite.control.ground.physics import Physics
from wbc_suite.control.ground.rigid_body import rotation
from wbc_suite.linear_algebra import cholesky, dot, solve_lower, solve_upper
from wbc_suite.locomotion.gait import GRAVITY
from wbc_suite.qp.active_set import solve_warm
from wbc_suite.typing import Vector

_WRITTEN, _SOLVED = int(QpStage.WRITTEN), int(QpStage.SOLVED)
_UNSOLVED = int(QpStage.UNSOLVED)

LOAD_BANDWIDTH = 6.0
"""1/s; bandwidth of the observed loads on hands."""

LOAD_DECAY = 0.05
"""1/s; rate at which a load is forgotten."""

LOAD_CHANGE_MAX = 200.0
"""N or N m; greatest change of a load that one step shows."""

LOAD_FORCE_MAX, LOAD_MOMENT_MAX = 120.0, 8.0
"""N and N m; greatest load."""

STOP_DISTANCE, STOP_HORIZON = 0.01, 0.1
"""rad or m, and s; where a joint is so near to its limit now or after this time, its
stop may act, and estimated loads fade: they would push it on."""

LOAD_FADING = 8.0
"""Rate of fading over `LOAD_BANDWIDTH`."""

WRENCH_DAMPING = 1e-3
"""m^2; damps the wrench in directions that the arm does not feel."""

FALL_TILT_COSINE = 0.6
"""Cosine of the tilt from which a robot has fallen: 53 degrees."""

FALLEN_GAINS = (100.0, 40.0)
"""kp, 1/s^2, and kd, 1/s, that hold the joints of a robot that fell."""

FALL_DROP = 0.15
"""m; a robot whose trunk is so much lower than commanded has fallen."""


@compiled
def solve_whole_body(physics: Physics, body: WholeBodyDynamics) -> bool:
    """Plan, state the QP and solve it; return whether its active set is found.

    Where it is not, another solver writes `qp.x`, and sets the stage to `SOLVED`.
    """
    state = body.state[0]
    if state.stage == _SOLVED:
        return True
    write_terms(physics, body)
    measure(physics, body)
    if state.fell >= 0.0:
        _hold_joints(physics, body)
        return True
    _observe_loads(physics, body)
    if state.is_free == 0:
        body.plan.margin[0] = 1.0
    elif state.tracks == 1:
        track_motion(physics, body)
    else:
        body.planner(body.gait, body.measured, body.command, state.dt, body.plan)
    if state.is_free == 1 and state.tracks == 0:
        _watch_fall(physics, body)
    write_qp(physics, body)
    state.ticks += 1
    if solve_warm(body.qp):
        state.stage = _SOLVED
        return True
    state.stage = _UNSOLVED
    state.unsolved += 1
    return False


@inner
def _hold_joints(physics: Physics, body: WholeBodyDynamics) -> None:
    """Ask for no contact forces, and for joints as they were at the fall; no QP."""
    qp, terms = body.qp, body.terms
    edges = terms.B.shape[0]
    body.load[:], qp.x[:edges] = 0.0, 0.0
    for j in range(body.qpos.shape[0]):
        error = body.posture[j] - physics.qpos[body.qpos[j]]
        qp.x[edges + j] = FALLEN_GAINS[0] * error - FALLEN_GAINS[1] * terms.v[6 + j]
    body.state[0].ticks += 1
    body.state[0].stage = _SOLVED


@compiled
def write_whole_body(physics: Physics, body: WholeBodyDynamics) -> None:
    """Write accelerations of root and joints, and torques of contacts and loads."""
    qp, terms = body.qp, body.terms
    body.state[0].stage = _WRITTEN
    edges, size = terms.B.shape[0], qp.x.shape[0]
    for i in range(6):
        terms.a[i] = dot(terms.root[i], qp.x, size) + terms.root[i, size]
        if body.state[0].fell >= 0.0:
            terms.a[i] = 0.0  # it lies
    for j in range(body.qpos.shape[0]):
        terms.a[6 + j] = qp.x[edges + j]
        dof = body.dofs[6 + j]
        held = physics.qfrc_bias[dof] - physics.qfrc_passive[dof] - terms.h[6 + j]
        for k in range(edges):
            held += terms.B[k, 6 + j] * qp.x[k]
        body.torque[j] = held
    for i in range(0 if body.state[0].is_free == 1 else 6, body.dofs.shape[0]):
        physics.acceleration[body.dofs[i]] = terms.a[i]
        body.last_velocity[i] = physics.qvel[body.dofs[i]]


@inner
def _observe_loads(physics: Physics, body: WholeBodyDynamics) -> None:
    """Estimate the wrench on each hand, and count it to the bias and to the weight.

    What the arm did since the last step, less what it was asked to do, is the
    acceleration of a force that the model does not know:

        M (dv / dt - a) = J^T (f - f_hat)

    solved for the joints of the arm, and averaged over 1/6 s. What hangs on a hand
    belongs to the centre of mass.
    """
    terms, state, measured = body.terms, body.state[0], body.measured
    size = body.dofs.shape[0]
    missed, residual = np.zeros(size), np.empty(size)
    if state.ticks > 0:
        for i in range(0 if state.is_free == 1 else 6, size):
            change = physics.qvel[body.dofs[i]] - body.last_velocity[i]
            missed[i] = change / state.dt - terms.a[i]
    for i in range(size):
        residual[i] = dot(terms.M[i], missed, size)
    mass, moment, rate = state.mass, np.zeros(2), np.zeros(2)
    terms.held[:] = 0.0
    for k in range(body.hand.shape[0]):
        p, load = physics.site_xpos[body.hand[k]], body.load[k]
        write_frame_terms(physics, body, int(physics.site_bodyid[body.hand[k]]), p)
        change, stopped = (
            _missing_wrench(body, k, residual),
            _is_at_stop(physics, body, k),
        )
        for r in range(6):
            part = -LOAD_FADING * load[r] if stopped else change[r]
            part = min(max(part, -LOAD_CHANGE_MAX), LOAD_CHANGE_MAX)
            most = LOAD_FORCE_MAX if r < 3 else LOAD_MOMENT_MAX
            load[r] += state.dt * (LOAD_BANDWIDTH * part - LOAD_DECAY * load[r])
            load[r] = min(max(load[r], -most), most)
            terms.held[r] += load[r]
            for j in range(size):
                terms.h[j] -= terms.J[r, j] * load[r]
        x, y, z = p[0] - terms.com[0], p[1] - terms.com[1], p[2] - terms.com[2]
        terms.held[3] += y * load[2] - z * load[1]
        terms.held[4] += z * load[0] - x * load[2]
        terms.held[5] += x * load[1] - y * load[0]
        held = max(-load[2] / GRAVITY, 0.0)
        mass += held
        for i in range(2):
            moment[i] += held * (p[i] - terms.com[i])
            rate[i] += held * (terms.velocity[i] - measured.com_velocity[i])
    for i in range(2 if state.is_free == 1 else 0):
        measured.com[i] += moment[i] / mass
        measured.com_velocity[i] += rate[i] / mass


@inner
def _is_at_stop(physics: Physics, body: WholeBodyDynamics, k: int) -> bool:
    """Return whether the stop of a joint may soon act on the arm of a hand."""
    low, high, at_stop = body.limits[0], body.limits[1], False
    for j in range(body.qpos.shape[0]):
        q = physics.qpos[body.qpos[j]]
        ahead = q + STOP_HORIZON * physics.qvel[body.dofs[6 + j]]
        outside = (
            min(q, ahead) < low[j] + STOP_DISTANCE
            or max(q, ahead) > high[j] - STOP_DISTANCE
        )
        at_stop = at_stop or (outside and body.is_arm[k, j] == 1)
    return at_stop


@inner
def _missing_wrench(body: WholeBodyDynamics, k: int, residual: Vector) -> Vector:
    """Return the wrench at a hand that explains the residual of its arm, (6,).

    Args:
        body: The robot; `terms.J` is the Jacobian of the hand.
        k: The hand.
        residual: Generalised forces that the model does not know, shape (6 + n,).
    """
    J, A, x = body.terms.J, np.zeros((6, 6)), np.zeros(6)
    for r in range(6):
        A[r, r] = WRENCH_DAMPING
        for j in range(6, J.shape[1]):
            if body.is_arm[k, j - 6] == 1:
                x[r] += J[r, j] * residual[j]
                for s in range(r + 1):
                    A[r, s] += J[r, j] * J[s, j]
    cholesky(A, 6, 0.0)
    solve_lower(A, x, 6)
    solve_upper(A, x, 6)
    return x


@inner
def _watch_fall(physics: Physics, body: WholeBodyDynamics) -> None:
    """Note when and why the robot falls."""
    state, gait = body.state[0], body.gait.state[0]
    upright = rotation(physics.xmat, state.body)[2, 2]
    lower = gait.nominal_height - gait.height
    height = physics.xpos[state.body, 2] - gait.ground
    drop = state.trunk_height - lower - height
    if state.fell < 0.0 and (upright < FALL_TILT_COSINE or drop > FALL_DROP):
        state.fell, state.drop = gait.time, drop
        state.tilt = np.arccos(min(max(upright, -1.0), 1.0))
        state.fell_by_tilt = 1 if upright < FALL_TILT_COSINE else 0
        for j in range(body.qpos.shape[0]):
            body.posture[j] = physics.qpos[body.qpos[j]]
