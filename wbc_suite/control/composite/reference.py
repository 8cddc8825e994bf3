"""The command between two solves: smooth, and never outside what was solved."""

import numpy as np
import pinocchio as pin

from wbc_suite.control.part.joint_position import JointTarget
from wbc_suite.typing import Indices, Vector

__all__ = ["Reference"]


class Reference:
    """A quadratic B-spline through the solved configurations.

    From the middle of one solved step to the middle of the next,

        q(s) = q_k - T v_k / 2 + v_k s + a s^2 / 2,   a = (v_{k+1} - v_k) / T,

    so velocities have no steps, the acceleration can be fed forward, and joints stay
    between solved configurations, that is within limits. It lags by T / 2.

    Args:
        model: Pinocchio model of what is solved for.
        q_index: Places of the driven joints in q.
        v_index: Their places in v.
        period: T, s.
    """

    def __init__(
        self, model: pin.Model, q_index: Indices, v_index: Indices, period: float
    ) -> None:
        self._model, self._period = model, period
        self._q_index, self._v_index = q_index, v_index
        self._is_free = model.nq > model.nv
        self.reset(pin.neutral(model))

    def reset(self, q: Vector) -> None:
        """Stand still at q."""
        self.q = q.copy()
        self.v: Vector = np.zeros(self._model.nv)
        self._before = self.v

    def extend(self, v: Vector) -> Vector:
        """Move on by one period at v; return the configuration that leads to."""
        self.q = pin.integrate(self._model, self.q, self._period * self.v)
        self._before, self.v = self.v, v
        return pin.integrate(self._model, self.q, self._period * v)

    def sample(self, s: float, rigid: Vector) -> JointTarget:
        """Return the target s seconds after the last solve.

        Args:
            s: Between 0 and the period.
            rigid: Positions of further joints, which stand still; they come last.
        """
        acceleration = (self.v - self._before) / self._period
        velocity = self._before + s * acceleration
        behind = (s - 0.5 * self._period) * self._before + 0.5 * s**2 * acceleration
        q = pin.integrate(self._model, self.q, behind)
        still = np.zeros_like(rigid)
        root, twist, rate = self._root(q, velocity, acceleration)
        return JointTarget(
            position=np.concatenate([q[self._q_index], rigid]),
            velocity=np.concatenate([velocity[self._v_index], still]),
            acceleration=np.concatenate([acceleration[self._v_index], still]),
            root=root,
            root_twist=twist,
            root_acceleration=rate,
        )

    def _root(
        self, q: Vector, v: Vector, a: Vector
    ) -> tuple[pin.SE3 | None, Vector | None, Vector | None]:
        """Return a free root's motion, linear in world axes, angular in its own."""
        if not self._is_free:
            return None, None, None
        root = pin.XYZQUATToSE3(q[:7])
        R = root.rotation
        linear = R @ (a[:3] + np.cross(v[3:6], v[:3]))
        twist = np.concatenate([R @ v[:3], v[3:6]])
        return root, twist, np.concatenate([linear, a[3:6]])
