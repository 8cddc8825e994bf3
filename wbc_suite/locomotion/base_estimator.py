"""Pose and velocity of a robot's base from an IMU and from the legs that stand.

An error-state Kalman filter over position, velocity and orientation of the base, the
biases of the IMU, and the positions of the feet. Standing feet do not move, which ties
the integrated IMU to the ground; heading and horizontal position drift slowly, as
nothing observes them.

Source: Bloesch et al. (2012), "State estimation for legged robots - consistent fusion
of leg kinematics and IMU", RSS.
"""

from typing import NamedTuple

import numpy as np

from wbc_suite.compiling import compiled, inner, struct
from wbc_suite.linear_algebra import cross, dot, solve
from wbc_suite.qp.lie import exp3
from wbc_suite.typing import Indices, Matrix, Vector

POSITION, VELOCITY, TURN, ACCELERATION_BIAS, GYRO_BIAS, FEET = 0, 3, 6, 9, 12, 15
"""First row of each part of the error state; turns are in the base's axes."""

TOUCHDOWN = 0.03
"""s after which a foot that is put down counts as standing."""

UNKNOWN = 1.0
"""m^2; variance of the position of a foot that has just been put down."""

GATE = 25.0
"""Squared distance, in standard deviations, from which a foot is held to have slipped:
its position is estimated anew."""


class EstimatorNoise(NamedTuple):
    """Standard deviations that the filter assumes.

    Attributes:
        acceleration: Of the accelerometer, m/s^2/sqrt(Hz).
        gyro: Of the gyroscope, rad/s/sqrt(Hz).
        acceleration_bias: Change of its bias, m/s^3/sqrt(Hz).
        gyro_bias: Change of its bias, rad/s^2/sqrt(Hz).
        slip: Motion of standing feet, m/sqrt(s).
        foot: Measured position of a foot in the base's axes, m.
    """

    acceleration: float = 0.02
    gyro: float = 0.002
    acceleration_bias: float = 1e-3
    gyro_bias: float = 1e-4
    slip: float = 2e-3
    foot: float = 2e-3


@struct
class BaseEstimate(NamedTuple):
    """State of the filter, for n feet; the size of the error state is 15 + 3 n.

    Attributes:
        noise: The values of `EstimatorNoise`, shape (6,).
        p: Position of the base, world axes, m, shape (3,).
        v: Its velocity, world axes, m/s, shape (3,).
        R: Its orientation, shape (3, 3).
        acceleration_bias: Of the accelerometer, m/s^2, shape (3,).
        gyro_bias: Of the gyroscope, rad/s, shape (3,).
        feet: Positions of the feet, world axes, m, shape (n, 3).
        standing: Time since each foot was put down, s, negative while it swings, (n,).
        P: Covariance of the error, shape (15 + 3 n, 15 + 3 n).
        F: Scratch: transition of the error.
        H: Scratch: Jacobian of one foot's position in the base, shape (3, 15 + 3 n).
        work: Scratch, shape of P.
    """

    noise: Vector
    p: Vector
    v: Vector
    R: Matrix
    acceleration_bias: Vector
    gyro_bias: Vector
    feet: Matrix
    standing: Vector
    P: Matrix
    F: Matrix
    H: Matrix
    work: Matrix


def make_base_estimate(feet: int, noise: EstimatorNoise) -> BaseEstimate:
    """Return a filter that has not begun."""
    size = FEET + 3 * feet
    return BaseEstimate(
        noise=np.array(noise),
        p=np.zeros(3),
        v=np.zeros(3),
        R=np.eye(3),
        acceleration_bias=np.zeros(3),
        gyro_bias=np.zeros(3),
        feet=np.zeros((feet, 3)),
        standing=np.zeros(feet),
        P=np.zeros((size, size)),
        F=np.zeros((size, size)),
        H=np.zeros((3, size)),
        work=np.zeros((size, size)),
    )


def begin_estimate(estimate: BaseEstimate, p: Vector, R: Matrix, v: Vector) -> None:
    """Start at a known pose and velocity of the base; no foot stands yet.

    Args:
        estimate: The filter.
        p: Position, world axes, m, shape (3,).
        R: Orientation, shape (3, 3).
        v: Velocity, world axes, m/s, shape (3,).
    """
    estimate.p[:], estimate.R[:], estimate.v[:] = p, R, v
    estimate.acceleration_bias[:] = estimate.gyro_bias[:] = 0.0
    estimate.standing[:] = -1.0
    estimate.P[:] = 0.0
    start = np.repeat([1e-4, 1e-2, 1e-4, 0.05**2, 0.005**2], 3)
    np.fill_diagonal(estimate.P[:FEET, :FEET], start)


@compiled
def propagate(
    estimate: BaseEstimate, force: Vector, rate: Vector, gravity: Vector, dt: float
) -> None:
    """Integrate one reading of the IMU, which lies in the base's origin.

    Args:
        estimate: The filter.
        force: Specific force (acceleration less gravity) over the step, base axes at
            its start, m/s^2, shape (3,).
        rate: Angular velocity over the step, base axes, rad/s, shape (3,).
        gravity: World axes, m/s^2, shape (3,).
        dt: Duration of the step, s.
    """
    R, P, noise = estimate.R, estimate.P, estimate.noise
    f, w = force - estimate.acceleration_bias, rate - estimate.gyro_bias
    turn = np.empty((3, 3))
    exp3(dt * w[0], dt * w[1], dt * w[2], turn)
    _write_transition(estimate, f, turn, dt)
    for i in range(3):
        acceleration = gravity[i] + dot(R[i], f, 3)
        estimate.v[i] += dt * acceleration
        estimate.p[i] += dt * estimate.v[i]
    _turn(R, turn)
    _propagate_covariance(estimate)
    for i in range(3):
        P[VELOCITY + i, VELOCITY + i] += dt * noise[0] ** 2
        P[TURN + i, TURN + i] += dt * noise[1] ** 2
        P[ACCELERATION_BIAS + i, ACCELERATION_BIAS + i] += dt * noise[2] ** 2
        P[GYRO_BIAS + i, GYRO_BIAS + i] += dt * noise[3] ** 2
    for i in range(FEET, P.shape[0]):
        P[i, i] += dt * noise[4] ** 2


@inner
def _write_transition(
    estimate: BaseEstimate, f: Vector, turn: Matrix, dt: float
) -> None:
    """Write how the error of the base changes in a step that turns the base."""
    R, F = estimate.R, estimate.F
    F[:] = 0.0
    for i in range(F.shape[0]):
        F[i, i] = 1.0
    for i in range(3):
        F[POSITION + i, VELOCITY + i] = dt
        F[TURN + i, GYRO_BIAS + i] = -dt
        across = cross(R[i], f)  # row i of R [f]x
        for j in range(3):
            F[VELOCITY + i, TURN + j] = -dt * across[j]
            F[VELOCITY + i, ACCELERATION_BIAS + j] = -dt * R[i, j]
            F[TURN + i, TURN + j] = turn[j, i]


@compiled
def _turn(R: Matrix, turn: Matrix) -> None:
    """Write R turn into R, shapes (3, 3)."""
    for i in range(3):
        x, y, z = R[i, 0], R[i, 1], R[i, 2]
        for j in range(3):
            R[i, j] = x * turn[0, j] + y * turn[1, j] + z * turn[2, j]


@inner
def _propagate_covariance(estimate: BaseEstimate) -> None:
    """Write F P F^T into P; feet have no transition of their own."""
    F, P, work = estimate.F, estimate.P, estimate.work
    size = P.shape[0]
    for i in range(FEET):
        for j in range(size):
            total = 0.0
            for k in range(FEET):
                total += F[i, k] * P[k, j]
            work[i, j] = total
    for i in range(FEET):
        for j in range(size):
            P[i, j] = P[j, i] = work[i, j]
    for i in range(FEET):
        for j in range(i + 1):
            P[i, j] = P[j, i] = dot(work[i], F[j], FEET)


@compiled
def correct(estimate: BaseEstimate, feet: Matrix, stands: Indices, dt: float) -> None:
    """Correct the estimate by the feet that stand.

    Args:
        estimate: The filter.
        feet: Positions of the feet in the base's axes, by the joints, m, (n, 3).
        stands: Whether each foot stands, shape (n,).
        dt: Time since the last call, s.
    """
    for k in range(feet.shape[0]):
        if stands[k] == 0:
            estimate.standing[k] = -1.0
            continue
        if estimate.standing[k] < 0.0:
            estimate.standing[k] = 0.0
        estimate.standing[k] += dt
        if estimate.standing[k] - dt < TOUCHDOWN <= estimate.standing[k]:
            _put_down(estimate, feet, k)
        if estimate.standing[k] >= TOUCHDOWN and not _correct_by_foot(
            estimate, feet, k
        ):
            _put_down(estimate, feet, k)


@inner
def _put_down(estimate: BaseEstimate, feet: Matrix, k: int) -> None:
    """Estimate the position of a foot anew."""
    P, first = estimate.P, FEET + 3 * k
    for i in range(3):
        estimate.feet[k, i] = estimate.p[i] + dot(estimate.R[i], feet[k], 3)
        P[first + i, :] = 0.0
        P[:, first + i] = 0.0
        P[first + i, first + i] = UNKNOWN


@inner
def _correct_by_foot(estimate: BaseEstimate, feet: Matrix, k: int) -> bool:
    """Correct by the position of one foot; return whether it is plausible."""
    P, H, work = estimate.P, estimate.H, estimate.work
    size, u = P.shape[0], np.empty(3)
    _write_foot_jacobian(estimate, k, u)
    S, gain, scaled = np.empty((3, 3)), np.empty((3, size)), np.empty((3, 1))
    for i in range(3):
        for j in range(size):
            gain[i, j] = work[i, j] = dot(H[i], P[j], size)
        scaled[i, 0] = feet[k, i] - u[i]
    for i in range(3):
        for j in range(3):
            S[i, j] = dot(work[i], H[j], size)
        S[i, i] += estimate.noise[5] ** 2
    residual = scaled[:, 0].copy()
    solve(S.copy(), scaled, 3)
    if dot(residual, scaled[:, 0].copy(), 3) > GATE:
        return False
    solve(S, gain, 3)
    change = np.zeros(size)
    for j in range(size):
        for i in range(3):
            change[j] += gain[i, j] * residual[i]
        for m in range(j + 1):
            for i in range(3):
                P[j, m] -= gain[i, j] * work[i, m]
            P[m, j] = P[j, m]
    _apply(estimate, change)
    return True


@compiled
def _write_foot_jacobian(estimate: BaseEstimate, k: int, u: Vector) -> None:
    """Write the estimated position u of a foot in the base, and its Jacobian H."""
    H, R, first = estimate.H, estimate.R, FEET + 3 * k
    way = estimate.feet[k] - estimate.p
    for i in range(3):
        u[i] = R[0, i] * way[0] + R[1, i] * way[1] + R[2, i] * way[2]
    H[:] = 0.0
    for i in range(3):
        for j in range(3):
            H[i, POSITION + j] = -R[j, i]
            H[i, first + j] = R[j, i]
    H[0, TURN + 1], H[0, TURN + 2] = -u[2], u[1]
    H[1, TURN], H[1, TURN + 2] = u[2], -u[0]
    H[2, TURN], H[2, TURN + 1] = -u[1], u[0]


@inner
def _apply(estimate: BaseEstimate, change: Vector) -> None:
    """Add an error state to the estimate."""
    turn = np.empty((3, 3))
    exp3(change[TURN], change[TURN + 1], change[TURN + 2], turn)
    for i in range(3):
        estimate.p[i] += change[POSITION + i]
        estimate.v[i] += change[VELOCITY + i]
        estimate.acceleration_bias[i] += change[ACCELERATION_BIAS + i]
        estimate.gyro_bias[i] += change[GYRO_BIAS + i]
    _turn(estimate.R, turn)
    for k in range(estimate.feet.shape[0]):
        for i in range(3):
            estimate.feet[k, i] += change[FEET + 3 * k + i]
