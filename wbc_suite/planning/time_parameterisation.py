"""Time-optimal motions under velocity and acceleration limits, by Ruckig."""

import numpy as np
import ruckig

from wbc_suite.typing import Matrix, Vector

State = tuple[Vector, Vector]
"""Positions and velocities, shape (nv,) each."""

NO_MOTION = 1e-9  # rad or m
SCALES = 60  # velocity scales that are tried between two states of a trail
MAX_SCALE = 50.0  # of recorded velocities


class ProfileGenerator:
    """Generates synchronised profiles: all joints arrive at the same time.

    Velocity and acceleration limits have shape (nv,).

    Source: Berscheid and Kröger (2021), "Jerk-limited Real-time Trajectory Generation
    with Arbitrary Target States", RSS. Jerk is not limited here.
    """

    def __init__(self, *, speed: Vector, acceleration: Vector) -> None:
        self.speed, self.acceleration = speed, acceleration
        self._generator = ruckig.Ruckig(len(speed))

    def between(
        self,
        start: State,
        end: State,
        *,
        min_duration: float | None = None,
        acceleration_scale: float = 1.0,
    ) -> ruckig.Trajectory | None:
        """Return the fastest profile between two states, or None if there is none.

        Velocity limits grow to the velocity of the end where that is greater;
        acceleration limits are scaled.
        """
        given = self._input(start, end)
        given.max_velocity = np.maximum(self.speed, np.abs(end[1]))
        given.max_acceleration = acceleration_scale * self.acceleration
        given.minimum_duration = min_duration
        return self._calculate(given)

    def line(self, start: Vector, end: Vector) -> ruckig.Trajectory:
        """Return the fastest profile from rest to rest on a straight line, (nv,)."""
        moved, still = np.maximum(np.abs(end - start), NO_MOTION), np.zeros_like(start)
        given = self._input((start, still), (end, still))
        given.max_velocity = float((self.speed / moved).min()) * moved
        given.max_acceleration = float((self.acceleration / moved).min()) * moved
        found = self._calculate(given)
        assert found is not None, "a motion from rest to rest always exists"
        return found

    def stop(self, start: State) -> ruckig.Trajectory:
        """Return the profile that stops each joint as soon as it can."""
        given = self._input(start, (start[0], np.zeros_like(start[1])))
        given.control_interface = ruckig.ControlInterface.Velocity
        given.synchronization = ruckig.Synchronization.No
        found = self._calculate(given)
        assert found is not None, "every joint can brake"
        return found

    def _input(self, start: State, end: State) -> ruckig.InputParameter:
        given = ruckig.InputParameter(len(self.speed))
        given.current_position, given.current_velocity = start
        given.target_position, given.target_velocity = end
        given.max_velocity, given.max_acceleration = self.speed, self.acceleration
        return given

    def _calculate(self, given: ruckig.InputParameter) -> ruckig.Trajectory | None:
        found = ruckig.Trajectory(len(self.speed))
        try:
            result = self._generator.calculate(given, found)
        except ruckig.RuckigError:  # a value that is not finite
            return None
        return found if result == ruckig.Result.Working else None


def retrace_scales(
    v: Matrix, steps: Vector, *, speed: Vector, acceleration: Vector
) -> Vector:
    """Return how many times faster a recorded trail can be followed.

    Velocities keep their directions. The scales s are the greatest with

        |s_k v_k| <= speed,
        |s_{k+1} v_{k+1} - s_k v_k| (s_k + s_{k+1}) / 2 <= acceleration dt,

    found forwards and then backwards along the trail; none is below 1, because what the
    robot did before it can do again. The first is 1.

    The recorded states have velocities v, shape (n, nv), and are steps (s), shape
    (n - 1,), apart. Limits have shape (nv,).

    Source: Bobrow, Dubowsky and Gibson (1985), "Time-Optimal Control of Robotic
    Manipulators Along Specified Paths", IJRR 4(3); here on a grid of states.
    """
    scales: Vector = np.ones(len(v))
    most = (speed / np.maximum(np.abs(v), 1e-12)).min(axis=1).clip(1.0, MAX_SCALE)
    for k in range(1, len(v)):
        bound = steps[k - 1] * acceleration
        scales[k] = _greatest_scale(v[k - 1], v[k], scales[k - 1], most[k], bound)
    for k in range(len(v) - 2, 0, -1):
        bound = steps[k] * acceleration
        scales[k] = _greatest_scale(v[k + 1], v[k], scales[k + 1], scales[k], bound)
    return scales


def _greatest_scale(
    v0: Vector, v1: Vector, scale: float, most: float, bound: Vector
) -> float:
    """Return the greatest scale at v1, from 1 to `most`, next to a scale at v0."""
    tried = most ** np.linspace(1.0, 0.0, SCALES)
    change = np.abs(np.outer(tried, v1) - scale * v0) * 0.5 * (tried + scale)[:, None]
    feasible = np.flatnonzero((change <= bound).all(axis=1))
    return float(tried[feasible[0]]) if len(feasible) else 1.0
