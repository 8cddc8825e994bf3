"""Differential IK from a configuration to the targets of a stack's frames, compiled."""

import numpy as np

from wbc_suite.compiling import compiled, inner
from wbc_suite.kinematics.tangent_space import integrate_joints
from wbc_suite.linear_algebra import copy_rows, inverse_trace, lq_factor
from wbc_suite.qp.tick import TickArrays, TickStatus, solve_tick
from wbc_suite.typing import Matrix, Vector

STEP = 0.1  # s, time of one iteration
ITERATIONS = 60  # for each pose at most
STUCK = 2e-3  # rad or m, of joints in an iteration
CLOSE = 1e-3  # m, with 0.1 m for each rad
SPAN = 3  # iterations, over which progress is measured
SINGULAR = 0.05  # dexterity below which controllers lag

_SOLVED = TickStatus.SOLVED.value


@inner
def cost_of(duration: float, error: float, margin: float, dexterity: float) -> float:
    """Return the cost of a `Prediction`, s.

    It is the duration, with penalties of what is out of reach, near limits or singular.
    """
    near = max(0.0, 0.2 - margin)
    singular = 20.0 * max(0.0, SINGULAR - dexterity)
    far = 100.0 * max(0.0, error - CLOSE)
    return duration + far + 10.0 * near + singular


@compiled
def descend(
    tick: TickArrays,
    speed: Vector,
    times: Vector,
    error: float,
    margin: float,
    dexterity: float,
    most: float,
) -> tuple[float, float]:
    """Move a robot to the targets of frames; return the error there and the dexterity.

    It ends where joints hardly move, where a tick needs more than its kernel, or once
    the cost will be above `most`, if errors decrease as fast as now.

    Args:
        tick: A stack of a `FrameTask` for each hand, and of tasks on joints.
        speed: Greatest velocity of each joint, rad/s or m/s.
        times: Time of each joint at that velocity, s; what this takes is added.
        error: Of the `Prediction` up to here, m; its margin and dexterity likewise.
        margin: See `error`.
        dexterity: See `error`.
        most: A cost.
    """
    level, x, left, earlier = tick.parts.levels[0], tick.x, np.inf, np.inf
    distances, jacobian = level.distances, level.jacobian
    for k in range(ITERATIONS + 1):
        if solve_tick(tick, STEP, 0)[0] != _SOLVED:
            break
        left = longest = 0.0
        for t in range(distances.shape[0]):
            left = max(left, distances[t, 0] + 0.1 * distances[t, 1])
            own = jacobian[6 * t : 6 * (t + 1)]
            dexterity = min(dexterity, _dexterity(own))
        for i in range(x.shape[0]):
            longest = max(longest, abs(x[i]))
        if left < CLOSE or longest < STUCK or k == ITERATIONS:
            break
        if most < np.inf and k > 0 and k % SPAN == 0:
            end = max(error, left - (ITERATIONS - k) * (earlier - left) / SPAN)
            if cost_of(times.max(), end, margin, dexterity) > most:
                break
            earlier = left
        integrate_joints(tick.robot, x)
        for i in range(x.shape[0]):
            times[i] += abs(x[i]) / speed[i]
    return left, dexterity


@inner
def _dexterity(J: Matrix) -> float:
    """Return a lower bound of the least singular value of a Jacobian, shape (6, n)."""
    Q, L = np.empty(J.shape), np.zeros((6, 6))
    copy_rows(J, Q)
    lq_factor(Q, J.shape[1], L)
    return np.sqrt(inverse_trace(L, np.zeros(6)))
