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


class EffortGuard:
    """Slows changes of velocity that the motors cannot give.

    Limits of acceleration bound each joint by itself, for a worst case; together they
    can still ask for more, and so can rows that keep links apart. A joint whose motor
    saturates drags the others along: GR1's waist was carried 0.1 rad past where it
    should have been, into its stop at 3.8 rad/s.

    Torques are linear in the acceleration a,

        tau = M a + h,  |tau| <= share * effort,

    so that the greatest part of a that every motor can give follows at once. With a
    free root contact forces are unknown, and nothing is changed.

    Args:
        robot: The reduced robot.
        configuration: Its configuration; read.
    """

    def __init__(self, robot: RobotDescription, configuration: Configuration) -> None:
        self._configuration = configuration
        self._data = configuration.model.createData()
        self._knows_all = robot.root.kind != "free"
        self._most = SHARE * _efforts(robot, configuration)
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
        part = self._part(v, (v - before) / dt)
        if part == 1.0:
            return v
        q = self._configuration.q
        slowed = before + part * (v - before)
        return np.clip(slowed, (self._low - q) / dt, (self._high - q) / dt)

    def _part(self, v: Vector, a: Vector) -> float:
        model, data, q = self._configuration.model, self._data, self._configuration.q
        tau = pin.rnea(model, data, q, v, a).copy()
        if (np.abs(tau) <= self._most).all():
            return 1.0
        rest = pin.rnea(model, data, q, v, self._still)
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
