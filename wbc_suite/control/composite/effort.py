"""Ask no more of motors than they have."""

import numpy as np
import pinocchio as pin

from wbc_suite.control.composite.tasks import planar_joints
from wbc_suite.kinematics import Configuration
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Vector

__all__ = ["EffortGuard"]

SHARE = 0.95  # of the effort; the rest is for errors of tracking
LEAST = 0.2  # of a change of velocity; so much is asked for in any case
ROUNDS = 3  # in which further motors may become too weak
SLACK = 1e-9  # N m or N


class EffortGuard:
    """Slows changes of velocity that the motors cannot give.

    Limits of acceleration bound each joint by itself, for a worst case; together they
    can still ask for more, and so can rows that keep links apart. A joint whose motor
    saturates drags the others along: GR1's waist was carried 0.1 rad past where it
    should have been, into its stop at 3.8 rad/s.

    Torques are linear in the acceleration a,

        tau = M a + h,  |tau| <= share * effort.

    Joints whose motors are asked for too much accelerate as those motors let them,
    with M and tau of these joints alone,

        M da = (tau cut to its bounds) - tau,

    and all others as they were asked to, for they may have to brake. Where a joint
    could then not stop before its end, or its motor cannot even hold it, all changes of
    velocity are made smaller by one factor instead.
    With a free root contact forces are unknown, and nothing is changed.

    Args:
        robot: The reduced robot.
        configuration: Its configuration; read.
        rate: What velocities can accelerate and brake, shape (nv,).
    """

    def __init__(
        self, robot: RobotDescription, configuration: Configuration, rate: Vector
    ) -> None:
        self._configuration = configuration
        self._data = configuration.model.createData()
        self._knows_all = robot.root.kind != "free"
        self._most = SHARE * _efforts(robot, configuration)
        self._rate = rate
        self._still: Vector = np.zeros(configuration.nv)
        model = configuration.model
        low, high = model.lowerPositionLimit, model.upperPositionLimit
        self._low = np.where(low < high, low, -np.inf)  # how Pinocchio says "none"
        self._high = np.where(low < high, high, np.inf)

    def able(self, before: Vector, v: Vector, dt: float) -> Vector:
        """Return a velocity that motors can reach, on the way to the one asked for.

        Args:
            before: Velocity of the last step, shape (nv,).
            v: Velocity asked for, shape (nv,).
            dt: Step, s.
        """
        if not self._knows_all:
            return v
        model, data, q = self._configuration.model, self._data, self._configuration.q
        a = (v - before) / dt
        tau = pin.rnea(model, data, q, v, a)
        if np.count_nonzero(np.abs(tau) <= self._most) == len(tau):
            return v
        tau = tau.copy()  # of data's own
        rest = pin.rnea(model, data, q, v, self._still).copy()
        found = self._yielding(v, tau, rest, dt)
        if found is None:
            found = before + self._part(tau, rest) * (v - before)
        return np.clip(found, (self._low - q) / dt, (self._high - q) / dt)

    def _yielding(
        self, v: Vector, tau: Vector, rest: Vector, dt: float
    ) -> Vector | None:
        """Return velocities with joints of weak motors alone slower, if that helps."""
        M = pin.crba(self._configuration.model, self._data, self._configuration.q)
        M = np.triu(M) + np.triu(M, 1).T
        weak = np.zeros(len(v), dtype=bool)
        torque, change = tau, self._still
        for _ in range(ROUNDS):
            weak |= np.abs(torque) > self._most
            if (np.abs(rest) >= self._most)[weak].any():
                return None
            short = np.clip(tau, -self._most, self._most) - tau
            change = self._still.copy()
            change[weak] = np.linalg.solve(M[np.ix_(weak, weak)], short[weak])
            if (change * tau > 0.0).any():
                return None  # one of them would be faster than asked
            torque = tau + M @ change
            if (np.abs(torque) <= self._most + SLACK).all():
                found = v + dt * change
                return found if self._can_stop(found, v) else None
        return None

    def _can_stop(self, found: Vector, asked: Vector) -> bool:
        """Tell whether joints stop before their ends, or are as slow as was asked."""
        q = self._configuration.q
        room = np.where(found > 0.0, self._high - q, q - self._low)
        most = np.sqrt(2.0 * self._rate * np.maximum(room, 0.0))
        return bool((np.abs(found) <= np.maximum(most, np.abs(asked))).all())

    def _part(self, tau: Vector, rest: Vector) -> float:
        """Return the greatest part of all changes that every motor can give."""
        change = tau - rest
        room = self._most - np.sign(change) * rest
        # A motor that cannot even hold has none to give; the others decide.
        asked = (np.abs(tau) > self._most) & (np.abs(rest) < self._most)
        part = (room[asked] / np.abs(change[asked])).min(initial=1.0)
        return max(float(part), LEAST)


def _efforts(robot: RobotDescription, configuration: Configuration) -> Vector:
    """Return the effort of each velocity's motor; inf where nothing is known."""
    efforts = np.full(configuration.nv, np.inf)
    model = configuration.model
    for joint in robot.joints:
        if joint.effort:
            v = model.joints[configuration.joint_id(joint.name)].idx_v
            efforts[v] = joint.effort
    if robot.root.actuated:
        force, torque = robot.root.effort
        for name, effort in zip(
            planar_joints(robot), (force, force, torque), strict=False
        ):
            efforts[model.joints[configuration.joint_id(name)].idx_v] = effort
    return efforts
