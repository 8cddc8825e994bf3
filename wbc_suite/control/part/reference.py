"""The command between two solves: smooth, and never outside what was solved."""

from collections import deque
from math import ceil

import numpy as np
import pinocchio as pin

from wbc_suite.control.part.joint_step import write_motion
from wbc_suite.control.part.stance import RootMotion
from wbc_suite.kinematics.tangent import TangentSpace
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["Reference", "mean_over"]

ROUNDING = 1e-9


def mean_over(acceleration: float, jerk: float, period: float) -> int:
    """Return over how many solves to take the mean, so that a jerk is kept.

    A mean over n solves changes its acceleration by `2 acceleration / n` at most from
    one solve to the next.

    Args:
        acceleration: Limit of what is solved, rad/s^2 or m/s^2.
        jerk: Limit to keep, rad/s^3 or m/s^3.
        period: Time between solves, s.
    """
    return max(1, ceil(2.0 * acceleration / (jerk * period) - ROUNDING))


class Reference:
    """A cubic B-spline through means of the solved configurations.

    The points are the means of the last n solved configurations, `n = mean_over(...)`,
    taken in the tangent space where joints are no plain numbers. Between two solves,
    with v_1, v_2, v_3 the velocities of the last three steps of the points, and p the
    point before the last two of them,

        q(s) = p + T (v_2 - v_1) / 6 + (v_1 + v_2) / 2 s + a s^2 / 2 + j s^3 / 6
        a = (v_2 - v_1) / T,    j = (v_3 - 2 v_2 + v_1) / T^2,

    so accelerations have no steps and can be fed forward. Position, velocity and
    acceleration are means of solved ones, hence within the limits of those, and the
    jerk is within `2 a_limit / (n T)`. It lags by `(n + 1) T / 2`.

    Args:
        model: Pinocchio model of what is solved for.
        q_index: Places of the driven joints in q.
        v_index: Their places in v.
        period: T, s.
        mean: n.

    Attributes:
        solved: The configuration that was solved last, shape (nq,).
    """

    def __init__(
        self,
        model: pin.Model,
        q_index: Indices,
        v_index: Indices,
        period: float,
        *,
        mean: int = 1,
    ) -> None:
        self._tangent, self._period = TangentSpace(model), period
        self._q_index, self._v_index = q_index, v_index
        self._window: deque[Vector] = deque(maxlen=mean)
        self._points: deque[Vector] = deque(maxlen=3)
        self._rates: Matrix = np.zeros((3, model.nv))
        self.reset(pin.neutral(model))

    def reset(self, q: Vector) -> None:
        """Stand still at q."""
        self.solved: Vector = q.copy()
        self._window.extend([self.solved] * (self._window.maxlen or 1))
        self._points.extend([self.solved] * 3)
        self._rates[:] = 0.0

    def extend(self, v: Vector) -> Vector:
        """Move on by one period at v; return the configuration that leads to."""
        self.solved = self._tangent.integrate(self.solved, self._period * v)
        self._window.append(self.solved)
        self._rates[:-1] = self._rates[1:]
        if len(self._window) == 1:
            self._points.append(self.solved)
            self._rates[2] = v
        else:
            before, point = self._points[-1], self._mean()
            self._points.append(point)
            step = self._tangent.difference(before, point)
            self._rates[2] = step / self._period
        return self.solved

    def polynomial(self) -> tuple[Vector, Vector, Vector, Vector]:
        """Return p, v, a, j of the driven joints after a solve.

        They are at `p + v s + a s^2 / 2 + j s^3 / 6`, s counted from that solve up to
        the period; for joints of one parameter.
        """
        motion = np.empty((4, len(self._q_index)))
        self.write(motion)
        return motion[0], motion[1], motion[2], motion[3]

    def write(self, motion: Matrix) -> None:
        """Write `polynomial` into the first columns of a buffer, (4, n or more)."""
        q, rates, period = self._points[0], self._rates, self._period
        write_motion(q, rates, self._q_index, self._v_index, period, motion)

    def targets(self) -> Vector:
        """Return where the driven joints are to be when the next solve is due, (n,)."""
        change = self._rates[2] - self._rates[1]
        lead = self._period / 6.0 * change[self._v_index]
        return self._points[1][self._q_index] + lead

    def root_motion(self) -> RootMotion:
        """Return the polynomial of a free root, which comes first in v."""
        first, second, third = self._rates[:, :6]
        return RootMotion(
            start=pin.XYZQUATToSE3(self._points[0][:7]),
            behind=self._period / 6.0 * (second - first),
            twist=0.5 * (first + second),
            curve=(second - first) / self._period,
            bend=(third - 2.0 * second + first) / self._period**2,
        )

    def _mean(self) -> Vector:
        """Return the mean of the window, in the tangent space of its oldest."""
        oldest, steps = self._window[0], np.zeros(self._rates.shape[1])
        for q in self._window:
            steps += self._tangent.difference(oldest, q)
        return self._tangent.integrate(oldest, steps / len(self._window))
