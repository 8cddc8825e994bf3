"""Rows of the QP of whole-body inverse dynamics: feet, balance, hands, attitude."""

import numpy as np

from wbc_suite.compiling import inner
from wbc_suite.control.contact.arrays import WholeBodyDynamics
from wbc_suite.control.contact.friction import write_edges
from wbc_suite.control.contact.qp_bounds import write_bounds
from wbc_suite.control.contact.terms import (
    eliminate_root,
    write_frame_terms,
)
from wbc_suite.control.ground.physics import Physics
from wbc_suite.control.ground.rigid_body import matrix_product, rotated, rotation
from wbc_suite.linear_algebra import copy_vector
from wbc_suite.locomotion.gait import Mode
from wbc_suite.qp.lie import exp3, log3, saturate
from wbc_suite.typing import Matrix, Vector

_STEP = int(Mode.STEP)

STANCE_FOOT = (100.0, 60.0)
"""Weight of the rows that keep a foot at rest, and their damping, 1/s."""

SWING_FOOT = (6.0, 2.0, 500.0)
"""Weights of position and orientation of a swinging foot, and kp, 1/s^2."""

COM_WEIGHT = 10.0
ANGULAR_MOMENTUM = (0.05, 4.0)
"""Weight of angular momentum, and its decay, 1/s."""

UPRIGHT_GAINS = (150.0, 24.0)
"""kp, 1/s^2, and kd, 1/s, of bodies that stay upright."""

HAND_KP = 600.0
"""1/s^2."""

HAND_ERROR_MAX = (0.015, 0.08)
"""m and rad; errors of hands pull no harder than at these."""

HAND_LEAD_MAX = (0.06, 0.3)
"""m and rad; a reference that is farther ahead leads the hand less."""

RECOVERING_HANDS = 0.3
"""Part of the hands' weights while a robot recovers from a push."""

SUPPORT_MARGINS = (0.02, 0.07)
"""m; margins of the capture point between which attitude, height and hands yield."""

YIELDING_ATTITUDE = 0.05
"""Part of the weights of attitude and angular momentum that remains then: the trunk
turns to keep the centre of mass over the feet."""

YIELDING_HEIGHT, YIELDING_HANDS = 0.1, 0.1
"""Parts of those of height and hands: turning hips needs bent knees."""


@inner
def write_qp(physics: Physics, body: WholeBodyDynamics) -> None:
    """Write the QP of a tick; terms and plan are those of the tick."""
    for k in range(body.site.shape[0]):
        _write_foot_jacobian(physics, body, k)
        write_edges(physics, body, k)
    if body.state[0].is_free == 1:
        eliminate_root(body)
    row = 0
    for k in range(body.site.shape[0]):
        row = _add_foot(physics, body, k, row)
    if body.state[0].is_free == 1:
        row = _add_momentum(physics, body, row)
    if body.state[0].tracks == 1:
        row = _add_tracked_root(body, row)
    for k in range(body.upright.shape[0]):
        row = _add_upright(physics, body, k, row)
    for k in range(body.hand.shape[0]):
        row = _add_hand(physics, body, k, row)
    write_bounds(physics, body)


@inner
def _write_foot_jacobian(physics: Physics, body: WholeBodyDynamics, k: int) -> None:
    link = int(physics.site_bodyid[body.site[k]])
    write_frame_terms(physics, body, link, body.measured.foot[k])


@inner
def _add_row(
    body: WholeBodyDynamics, row: int, A: Vector, wanted: float, weight: float
) -> None:
    """State `weight (A a - wanted)` as a row of the cost, in y."""
    terms, qp = body.terms, body.qp
    edges, size = terms.B.shape[0], body.dofs.shape[0]
    out, last = qp.W[row], terms.root.shape[1] - 1
    for j in range(last):
        out[j] = 0.0
    offset = 0.0
    for i in range(6):
        if A[i] != 0.0:
            part, X = weight * A[i], terms.root[i]
            for j in range(last):
                out[j] += part * X[j]
            offset += A[i] * X[last]
    for j in range(6, size):
        out[edges + j - 6] += weight * A[j]
    qp.e[row] = weight * (wanted - offset)


@inner
def _add_foot(physics: Physics, body: WholeBodyDynamics, k: int, row: int) -> int:
    """Add the rows of a foot that rests or swings; return the next row."""
    plan, terms, measured = body.plan, body.terms, body.measured
    _write_foot_jacobian(physics, body, k)
    count = 6 if body.is_sole[k] == 1 else 3
    stands = plan.load[k] > 0.0
    turn, R_goal, R_error = np.zeros(3), np.zeros((3, 3)), np.empty((3, 3))
    if count == 6 and not stands:
        R = rotation(physics.site_xmat, body.site[k])
        R_goal[0, 0] = R_goal[1, 1] = np.cos(plan.yaw[k])
        R_goal[1, 0] = np.sin(plan.yaw[k])
        R_goal[0, 1], R_goal[2, 2] = -R_goal[1, 0], 1.0
        matrix_product(R_goal, R.T, R_error)
        log3(R_error, turn)
    if body.rolls[k] == 1:
        _free_roll(physics, body, k, turn)
    kd = 2.0 * np.sqrt(SWING_FOOT[2])
    for i in range(count):
        wanted = -terms.drift[i]
        if stands:
            if i < 2 and body.state[0].glides == 1:  # with the robot's other wheels
                error = plan.position[k, i] - measured.foot[k, i]
                rate = plan.velocity[k, i] - terms.velocity[i]
                wanted += SWING_FOOT[2] * error + kd * rate
            else:
                wanted -= STANCE_FOOT[1] * terms.velocity[i]
            weight = STANCE_FOOT[0]
        elif i < 3:
            error = plan.position[k, i] - measured.foot[k, i]
            rate = plan.velocity[k, i] - terms.velocity[i]
            wanted += plan.acceleration[k, i] + SWING_FOOT[2] * error + kd * rate
            weight = SWING_FOOT[0]
        else:
            wanted += SWING_FOOT[2] * turn[i - 3] - kd * terms.velocity[i]
            weight = SWING_FOOT[1]
        _add_row(body, row + i, terms.J[i], wanted, weight)
    return row + count


@inner
def _free_roll(physics: Physics, body: WholeBodyDynamics, k: int, turn: Vector) -> None:
    """Take rotations about a foot's x axis out of its Jacobian, motion and error."""
    terms, x = body.terms, rotation(physics.site_xmat, body.site[k])[:, 0]
    J, about = terms.J, np.zeros(terms.J.shape[1])
    speed = drift = error = 0.0
    for i in range(3):
        for j in range(about.shape[0]):
            about[j] += x[i] * J[3 + i, j]
        speed += x[i] * terms.velocity[3 + i]
        drift += x[i] * terms.drift[3 + i]
        error += x[i] * turn[i]
    for i in range(3):
        for j in range(about.shape[0]):
            J[3 + i, j] -= x[i] * about[j]
        terms.velocity[3 + i] -= x[i] * speed
        terms.drift[3 + i] -= x[i] * drift
        turn[i] -= x[i] * error


@inner
def _yield(body: WholeBodyDynamics, least: float) -> float:
    """Return the part of a weight that remains near the edge of the feet.

    A biped that steps has the edge of one sole behind it in every step: its steps
    keep the balance.
    """
    if body.site.shape[0] == 2 and body.gait.state[0].mode == _STEP:
        return 1.0
    inside = (body.plan.margin[0] - SUPPORT_MARGINS[0]) / (
        SUPPORT_MARGINS[1] - SUPPORT_MARGINS[0]
    )
    return min(max(inside, least), 1.0)


@inner
def _add_momentum(physics: Physics, body: WholeBodyDynamics, row: int) -> int:
    """Add rows of the centre of mass and of angular momentum; return the next row.

    Both follow from the contact forces alone: the sum of all forces is the rate of
    linear momentum, that of their moments the rate of angular momentum. What hands
    hold adds to both.
    """
    state, terms, qp, plan = body.state[0], body.terms, body.qp, body.plan
    edges = terms.B.shape[0]
    com, root = terms.com, physics.qpos[state.root_qpos :]
    R = rotation(physics.xmat, state.body)
    x, y, z = com[0] - root[0], com[1] - root[1], com[2] - root[2]
    weight, share = np.full(3, COM_WEIGHT), _yield(body, YIELDING_ATTITUDE)
    turning = ANGULAR_MOMENTUM[0] * share
    weight[2] *= _yield(body, YIELDING_HEIGHT)
    if state.tracks == 1:
        weight[:], turning = state.com_weight, 0.0
    for i in range(6):
        for j in range(qp.W.shape[1]):
            qp.W[row + i, j] = 0.0
    for k in range(edges):
        f, m = terms.B[k, :3], rotated(R, terms.B[k, 3:6])
        for i in range(3):
            qp.W[row + i, k] = weight[i] / state.mass * f[i]
        qp.W[row + 3, k] = turning * (m[0] - (y * f[2] - z * f[1]))
        qp.W[row + 4, k] = turning * (m[1] - (z * f[0] - x * f[2]))
        qp.W[row + 5, k] = turning * (m[2] - (x * f[1] - y * f[0]))
    for i in range(3):
        wanted = (
            plan.com_acceleration[i] - physics.gravity[i] - terms.held[i] / state.mass
        )
        qp.e[row + i] = weight[i] * wanted
        decay = ANGULAR_MOMENTUM[1] * terms.spin[i]
        qp.e[row + 3 + i] = -turning * (decay + terms.held[3 + i])
    return row + 6


@inner
def _add_tracked_root(body: WholeBodyDynamics, row: int) -> int:
    """Add the rows of the accelerations that a tracked root needs."""
    A, weights = np.zeros(body.dofs.shape[0]), body.state[0].root_weight
    for i in range(6):
        weight = weights[i // 3]
        A[i] = 1.0
        _add_row(body, row + i, A, body.tracked.wanted[i], weight)
        A[i] = 0.0
    return row + 6


@inner
def _add_upright(physics: Physics, body: WholeBodyDynamics, k: int, row: int) -> int:
    """Add the rows of a body that keeps its orientation in heading axes."""
    terms, gait = body.terms, body.gait.state[0]
    link = body.upright[k]
    write_frame_terms(physics, body, link, physics.xpos[link])
    heading, R_goal, R_error = np.zeros((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    _write_heading(gait.yaw, heading)
    matrix_product(heading, body.upright_pose[k].reshape((3, 3)), R_goal)
    matrix_product(R_goal, rotation(physics.xmat, link).T, R_error)
    turn, share = np.empty(3), _yield(body, YIELDING_ATTITUDE)
    log3(R_error, turn)
    for i in range(3):
        rate = gait.velocity[2] if i == 2 and gait.mode == 1 else 0.0
        damping = UPRIGHT_GAINS[1] * (rate - terms.velocity[3 + i])
        wanted = UPRIGHT_GAINS[0] * turn[i] + damping - terms.drift[3 + i]
        weight = body.upright_weight[k] * (1.0 if i == 2 else share)
        _add_row(body, row + i, terms.J[3 + i], wanted, weight)
    return row + 3


@inner
def _write_heading(yaw: float, R: Matrix) -> None:
    """Write a rotation about the vertical, shape (3, 3), into zeros."""
    R[0, 0] = R[1, 1] = np.cos(yaw)
    R[1, 0] = np.sin(yaw)
    R[0, 1], R[2, 2] = -R[1, 0], 1.0


@inner
def _add_hand(physics: Physics, body: WholeBodyDynamics, k: int, row: int) -> int:
    """Add the rows of a hand; return the next row."""
    terms, state, gait = body.terms, body.state[0], body.gait.state[0]
    site = body.hand[k]
    p = physics.site_xpos[site]
    write_frame_terms(physics, body, int(physics.site_bodyid[site]), p)
    R_goal, p_goal = np.empty((3, 3)), np.empty(3)
    lead, twist = np.zeros(6), np.zeros(6)
    _advance_reference(body, k, R_goal, p_goal, twist)
    if state.hand_frame == 1:
        heading, own = np.zeros((3, 3)), R_goal.copy()
        _write_heading(gait.yaw, heading)
        matrix_product(heading, own, R_goal)
        p_goal = rotated(heading, p_goal)
        copy_vector(rotated(heading, twist), twist)
        copy_vector(rotated(heading, twist[3:]), twist[3:])
        for i in range(2):
            p_goal[i] += terms.com[i]
            lead[i] = body.measured.com_velocity[i]
        turn = gait.velocity[2] if gait.mode == 1 else 0.0
        lead[0] -= turn * (p_goal[1] - terms.com[1])
        lead[1] += turn * (p_goal[0] - terms.com[0])
        p_goal[2] += gait.ground + gait.height
        lead[5] = turn
    R_error, error = np.empty((3, 3)), np.empty(6)
    matrix_product(R_goal, rotation(physics.site_xmat, site).T, R_error)
    log3(R_error, error[3:])
    for i in range(3):
        error[i] = p_goal[i] - p[i]
    for i in range(2):
        part, far = error[3 * i : 3 * i + 3], HAND_ERROR_MAX[i]
        length = np.sqrt(part[0] ** 2 + part[1] ** 2 + part[2] ** 2)
        saturate(part, far)
        for j in range(3):  # a hand that is held back is not led either
            lead[3 * i + j] += twist[3 * i + j] * min(
                1.0, HAND_LEAD_MAX[i] / max(length, 1e-9)
            )
    kd = 2.0 * np.sqrt(HAND_KP)
    share = RECOVERING_HANDS if gait.time < gait.until else 1.0
    share = min(share, _yield(body, YIELDING_HANDS))
    for i in range(6):
        wanted = HAND_KP * error[i] + kd * (lead[i] - terms.velocity[i])
        weight = share * body.hand_weight[k, i // 3]
        _add_row(body, row + i, terms.J[i], wanted - terms.drift[i], weight)
    return row + 6


@inner
def _advance_reference(
    body: WholeBodyDynamics, k: int, R: Matrix, p: Vector, twist: Vector
) -> None:
    """Move the reference of a hand towards its goal; write its pose and velocity.

    Args:
        body: The robot.
        k: The hand.
        R: Output: orientation, shape (3, 3).
        p: Output: position, m, shape (3,).
        twist: Output: velocity, linear then angular, in the axes of goals.
    """
    start, goal = body.start[k].reshape((3, 4)), body.goal[k].reshape((3, 4))
    out, travel = body.reference[k].reshape((3, 4)), body.travel[k]
    travel[0] = min(travel[0] + body.state[0].dt, travel[1])
    s, moves = travel[0] / travel[1], travel[0] < travel[1]
    R_way, R_part, turn = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    R_start, R_goal = start[:, :3].copy(), goal[:, :3].copy()
    matrix_product(R_goal, R_start.T, R_way)
    log3(R_way, turn)
    exp3(s * turn[0], s * turn[1], s * turn[2], R_part)
    matrix_product(R_part, R_start, R)
    for i in range(3):
        way = goal[i, 3] - start[i, 3]
        p[i] = out[i, 3] = start[i, 3] + s * way
        if moves:
            twist[i], twist[3 + i] = way / travel[1], turn[i] / travel[1]
        for j in range(3):
            out[i, j] = R[i, j]
