"""The input limiter: speed, acceleration and jerk of targets."""

import math

import numpy as np
import pinocchio as pin

from wbc_suite.devices.pipeline.config import RatesConfig
from wbc_suite.typing import Vector

BISECTIONS = 20  # to 1e-6 of the way between two accelerations
STILL = 1e-12  # units, units / s and / s^2; smaller values count as zero


class LimitedMotion:
    """A point that follows a goal, within bounds of speed, acceleration and jerk.

    Every tick chooses the next acceleration a' such that

        |a' - a| <= J dt,   |a'| <= A,   |v + a' dt| + |a'|^2 / 2J <= V,

    in the Euclidean norm. The last condition keeps the speed within V while the
    acceleration is reduced to zero at full jerk. Reducing a by J dt satisfies all three
    if they held before, so there is always a solution. They are convex: the best
    acceleration between that one and the desired one is found by bisection. Differences
    of the positions over dt, s, are exactly v, a and j. The rates are V, A and J.
    """

    def __init__(self, size: int, rates: RatesConfig, dt: float) -> None:
        self._rates, self._dt = rates, dt
        self._v, self._a, self._still = np.zeros(size), np.zeros(size), True

    @property
    def at_limit(self) -> bool:
        """Whether the last tick moved at nearly the greatest speed."""
        return bool(_norm(self._v) > 0.97 * self._rates.speed)

    def stop(self) -> None:
        """Set velocity and acceleration to zero, as after a reset."""
        self._v[:], self._a[:], self._still = 0.0, 0.0, True

    def step(self, error: Vector, pace: float = 1.0) -> Vector:
        """Return the step of this tick, shape (size,), towards a goal `error` away.

        `pace` is the share of the speed limit that is permitted.
        """
        dt = self._dt
        if self._still and float(error @ error) < STILL**2:
            return np.zeros_like(self._v)
        calm = self._a * max(
            0.0, 1.0 - self._rates.jerk * dt / (_norm(self._a) + STILL)
        )
        wanted = self._wanted(error, pace)
        low, high = 0.0, 1.0
        if not self._allowed(wanted):
            for _ in range(BISECTIONS):
                middle = 0.5 * (low + high)
                if self._allowed(calm + middle * (wanted - calm)):
                    low = middle
                else:
                    high = middle
            wanted = calm + low * (wanted - calm)
        self._a = wanted
        self._v = self._v + wanted * dt
        self._still = float(self._v @ self._v + wanted @ wanted) < STILL**2
        return self._v * dt

    def _allowed(self, a: Vector) -> bool:
        limit, dt = self._rates, self._dt
        size = _norm(a)
        return (
            size <= limit.acceleration
            and _norm(a - self._a) <= limit.jerk * dt
            and _norm(self._v + a * dt) + size * size / (2.0 * limit.jerk)
            <= limit.speed
        )

    def _wanted(self, error: Vector, pace: float) -> Vector:
        """Return the acceleration that leads to the goal and stops there."""
        limit, dt = self._rates, self._dt
        far = _norm(error)
        speed = min(pace * limit.speed, self._stoppable(far), far / (3.0 * dt))
        change = error * (speed / (far + STILL)) - self._v
        size = _norm(change)
        gentle = min(
            limit.acceleration,
            0.8 * math.sqrt(2.0 * limit.jerk * size),
            size / (2 * dt),
        )
        return change * (gentle / (size + STILL))

    def _stoppable(self, distance: float) -> float:
        """Return a speed from which `distance` is enough to stop, with a margin."""
        A, J = 0.5 * self._rates.acceleration, 0.25 * self._rates.jerk
        ramped = (distance * math.sqrt(J)) ** (2.0 / 3.0)
        if ramped <= A * A / J:
            return ramped
        half = 0.5 * A * A / J
        return -half + math.sqrt(half * half + 2.0 * A * distance)


class MotionLimit:
    """A pose that follows another one within linear and angular limits."""

    def __init__(self, linear: RatesConfig, angular: RatesConfig, dt: float) -> None:
        self._linear = LimitedMotion(3, linear, dt)
        self._angular = LimitedMotion(3, angular, dt)
        self.pose: pin.SE3 = pin.SE3.Identity()

    @property
    def at_speed_limit(self) -> bool:
        """Whether the last tick moved at nearly the greatest speed."""
        return self._linear.at_limit or self._angular.at_limit

    def reset(self, pose: pin.SE3) -> None:
        """Stop at a pose."""
        self.pose = pose.copy()
        self._linear.stop()
        self._angular.stop()

    def apply(self, target: pin.SE3, pace: float = 1.0) -> pin.SE3:
        """Move towards the target by one tick; return the new pose, in the world."""
        away = target.translation - self.pose.translation
        turn = pin.log3(target.rotation @ self.pose.rotation.T)
        step = self._linear.step(away, pace)
        rotation = pin.exp3(self._angular.step(turn, pace)) @ self.pose.rotation
        self.pose = pin.SE3(rotation, self.pose.translation + step)
        return self.pose


def _norm(x: Vector) -> float:
    return math.sqrt(float(x @ x))
