"""References between two solves: cubic splines within the limits of the solves."""

from math import ceil
from typing import NamedTuple

import numpy as np

from wbc_suite.compiling import as_argument, compiled, inner, struct
from wbc_suite.control.memory import Parts
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.forward import RobotArrays
from wbc_suite.kinematics.tangent_space import (
    difference,
    integrate,
    integrate_joints,
)
from wbc_suite.linear_algebra import copy_rows, copy_vector
from wbc_suite.typing import Indices, Matrix, Vector

ROUNDING = 1e-9


def window_length(acceleration: float, jerk: float, period: float) -> int:
    """Return over how many solves to take the mean, so that a jerk limit is kept.

    A mean over n solves, which are `period` seconds apart and keep an acceleration
    limit, changes its acceleration by `2 acceleration / n` at most between two.
    """
    return max(1, ceil(2.0 * acceleration / (jerk * period) - ROUNDING))


@struct
class SplineArrays(NamedTuple):
    """A spline through solved configurations; see `SplineReference`.

    Attributes:
        robot: The robot at the configuration solved last.
        q_index: Places of the driven joints in q, shape (m,).
        v_index: Their places in v, shape (m,).
        window: The last n solved configurations, newest last, shape (n, nq).
        points: The last three points, shape (3, nq).
        rates: Velocities of the last three steps of the points, shape (3, nv).
        motion: Output in its first m columns: position, velocity, acceleration and
            jerk of the driven joints, shape (4, m or more).
        root: Output: the same of the first six velocities, as an offset from the first
            of the points, shape (4, 6 or nv).
        since: Time since then, s, which others count, shape (1,).
        period: Time between two solves, s.
    """

    robot: RobotArrays
    q_index: Indices
    v_index: Indices
    window: Matrix
    points: Matrix
    rates: Matrix
    motion: Matrix
    root: Matrix
    since: Vector
    period: float


class SplineReference:
    """A cubic B-spline through means of the solved configurations.

    The points are the means of the last n = `mean` solved configurations, taken in the
    tangent space. Between two solves, with v_1, v_2, v_3 the velocities of the last
    three steps of the points, and p the point before the last two of them,

        q(s) = p + T (v_2 - v_1) / 6 + (v_1 + v_2) / 2 s + a s^2 / 2 + j s^3 / 6
        a = (v_2 - v_1) / T,    j = (v_3 - 2 v_2 + v_1) / T^2,

    so accelerations have no steps and can be fed forward. Position, velocity and
    acceleration are means of solved ones, hence within the limits of those, and the
    jerk is within `2 a_limit / (n T)`. It lags by `(n + 1) T / 2`.

    Args:
        configuration: The robot that is solved for; `extend` moves it.
        q_index: Places of the driven joints, of one parameter each, in q.
        v_index: Their places in v.
        width: Columns of `motion`, if there are more joints than these.

    Attributes:
        argument: The argument of kernels that stands for its arrays.
        motion: p, v, a and j of the driven joints after a solve: they are at
            `p + v s + a s^2 / 2 + j s^3 / 6`, s counted from that solve up to T.
        root: The same of a free root, as an offset from `start` in its axes, (4, 6).
        start: Configuration that the spline is at before that offset, shape (nq,).
        since: Time since that solve, s, which the loop counts, shape (1,).
    """

    def __init__(
        self,
        configuration: Configuration,
        q_index: Indices,
        v_index: Indices,
        period: float,
        *,
        mean: int = 1,
        width: int = 0,
    ) -> None:
        nq, nv = configuration.nq, configuration.nv
        self._configuration = configuration
        self._arrays = SplineArrays(
            robot=configuration.robot,
            q_index=q_index,
            v_index=v_index,
            window=np.zeros((mean, nq)),
            points=np.zeros((3, nq)),
            rates=np.zeros((3, nv)),
            motion=np.zeros((4, max(width, len(q_index)))),
            root=np.zeros((4, min(6, nv))),
            since=np.zeros(1),
            period=float(period),
        )
        self.argument = as_argument(self._arrays)
        self.motion: Matrix = self._arrays.motion
        self.root: Matrix = self._arrays.root
        self.start: Vector = self._arrays.points[0]
        self.since: Vector = self._arrays.since
        self.reset()

    @property
    def memory(self) -> Parts:
        """What outlives a solve, and the motion until the next; views."""
        arrays = self._arrays
        past = arrays.window, arrays.points, arrays.rates
        return *past, arrays.motion, arrays.root, arrays.since

    def reset(self) -> None:
        """Stand still where the robot is."""
        arrays, q = self._arrays, self._configuration.q
        arrays.window[:], arrays.points[:], arrays.rates[:] = q, q, 0.0
        joints = slice(len(arrays.q_index))
        arrays.motion[:, joints] = 0.0
        arrays.motion[0, joints] = q[arrays.q_index]
        arrays.root[:], arrays.since[:] = 0.0, 0.0

    def extend(self, v: Vector) -> None:
        """Move the robot by v over one period, and write `motion`."""
        extend_spline(self.argument, v)

    def targets(self) -> Vector:
        """Return where the driven joints are to be when the next solve is due, (m,)."""
        return _targets(self.argument)


@compiled
def extend_spline(spline: SplineArrays, v: Vector) -> None:
    """Move the robot by v over a period, and write the motion until the next solve."""
    robot, window = spline.robot, spline.window
    points, rates, period = spline.points, spline.rates, spline.period
    integrate_joints(robot, period * v)
    _append(window, robot.q)
    _append(points, robot.q)
    _append(rates, v)
    if window.shape[0] > 1:
        _write_mean(robot, window, points[2])
        difference(robot, points[1], points[2], rates[2])
        for i in range(v.shape[0]):
            rates[2, i] /= period
    for j in range(spline.q_index.shape[0]):
        q, i = points[0, spline.q_index[j]], spline.v_index[j]
        lead, v_now, a, jerk = _cubic(rates[0, i], rates[1, i], rates[2, i], period)
        spline.motion[0, j], spline.motion[1, j] = q + lead, v_now
        spline.motion[2, j], spline.motion[3, j] = a, jerk
    for i in range(spline.root.shape[1]):
        lead, v_now, a, jerk = _cubic(rates[0, i], rates[1, i], rates[2, i], period)
        spline.root[0, i], spline.root[1, i] = lead, v_now
        spline.root[2, i], spline.root[3, i] = a, jerk
    spline.since[0] = 0.0


@inner
def spline_end(spline: SplineArrays, j: int) -> tuple[float, float]:
    """Return position and velocity of the j-th driven joint when a solve is due."""
    i = spline.v_index[j]
    before, last = spline.rates[1, i], spline.rates[2, i]
    position = spline.points[1, spline.q_index[j]]
    return position + spline.period / 6.0 * (last - before), 0.5 * (before + last)


@compiled
def _targets(spline: SplineArrays) -> Vector:
    """Return the positions of `spline_end`, shape (m,)."""
    found = np.empty(spline.q_index.shape[0])
    for j in range(found.shape[0]):
        found[j], _ = spline_end(spline, j)
    return found


@inner
def _cubic(
    v_1: float, v_2: float, v_3: float, period: float
) -> tuple[float, float, float, float]:
    """Return offset, velocity, acceleration and jerk; see `SplineReference`."""
    return (
        period / 6.0 * (v_2 - v_1),
        0.5 * (v_1 + v_2),
        (v_2 - v_1) / period,
        (v_3 - 2.0 * v_2 + v_1) / period**2,
    )


@inner
def _append(rows: Matrix, new: Vector) -> None:
    """Drop the first row, and put a new one after the last."""
    copy_rows(rows[1:], rows)
    copy_vector(new, rows[-1])


@inner
def _write_mean(robot: RobotArrays, window: Matrix, out: Vector) -> None:
    """Write the mean of configurations, in the tangent space of the first."""
    count, total = window.shape[0], np.zeros(robot.jacobian.shape[0])
    step = np.empty(total.shape[0])
    for row in range(1, count):
        difference(robot, window[0], window[row], step)
        for i in range(total.shape[0]):
            total[i] += step[i] / count
    copy_vector(window[0], out)
    integrate(robot, out, total)
