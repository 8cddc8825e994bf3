"""Reduce accelerations that the motors cannot produce."""

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.compiling import as_argument, compiled, struct
from wbc_suite.control.ik.reduced_robot import joint_indices, planar_joints
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.forward import RobotArrays
from wbc_suite.kinematics.inverse_dynamics import (
    InertiaArrays,
    compute_torques,
    inertia_arrays,
)
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Vector

EFFORT_SHARE = 0.95  # of the effort; the rest is for tracking errors
CHANGE_SHARE_MIN = 0.2  # of a change of velocity; so much is commanded in any case
SATURATION_ROUNDS = 3  # in which further motors may saturate
TORQUE_TOLERANCE = 1e-9  # N m or N


@struct
class TorqueArrays(NamedTuple):
    """Motors of a robot, with scratch for `motors_suffice`; vectors have shape (nv,).

    Attributes:
        inertias: Inertia of the links.
        max_torque: Greatest torque or force of each motor.
        torque: What a motion needs.
        acceleration: Its acceleration.
        is_grounded: Whether no contact forces are needed to move.
    """

    inertias: InertiaArrays
    max_torque: Vector
    torque: Vector
    acceleration: Vector
    is_grounded: bool


@compiled
def motors_suffice(
    motors: TorqueArrays, robot: RobotArrays, before: Vector, v: Vector, dt: float
) -> bool:
    """Return whether no motor saturates when a velocity becomes v within dt.

    The torques that this needs are written.
    """
    if not motors.is_grounded:
        return True
    torque, acceleration = motors.torque, motors.acceleration
    for i in range(v.shape[0]):
        acceleration[i] = (v[i] - before[i]) / dt
    compute_torques(robot, motors.inertias, v, acceleration, torque)
    suffice = True
    for i in range(v.shape[0]):
        suffice &= abs(torque[i]) <= motors.max_torque[i]
    return suffice


class TorqueLimiter:
    """Reduces changes of velocity that would saturate motors.

    Acceleration limits, shape (nv,), bound each joint by itself, for a worst case;
    together, and with rows that keep links apart, they can still ask for more. A
    saturated joint drags the others along: GR1's waist was carried 0.1 rad past its
    target, into its stop at 3.8 rad/s.

    Torques are `tau = M a + h`, |tau| <= share * effort. Saturated joints accelerate as
    their motors permit, with M and tau of these joints,

        M da = (tau cut to its bounds) - tau,

    and all others as commanded, because they may have to brake. Where a joint could
    then not stop before its end, or its motor cannot hold it, one factor reduces all
    changes of velocity. With a free root contact forces are unknown, and nothing is
    changed.

    Attributes:
        argument: The argument of kernels that stands for the motors.
    """

    def __init__(
        self,
        robot: RobotDescription,
        configuration: Configuration,
        accelerations: Vector,
    ) -> None:
        self._configuration = configuration
        self._data = configuration.model.createData()
        self._most = EFFORT_SHARE * _efforts(robot, configuration)
        self._arrays = TorqueArrays(
            inertias=as_argument(inertia_arrays(configuration.model)),
            max_torque=self._most,
            torque=np.zeros(configuration.nv),
            acceleration=np.zeros(configuration.nv),
            is_grounded=robot.root.kind != "free",
        )
        self.argument = as_argument(self._arrays)
        self._accelerations = accelerations
        self._still: Vector = np.zeros(configuration.nv)
        model = configuration.model
        low, high = model.lowerPositionLimit, model.upperPositionLimit
        self._low = np.where(low < high, low, -np.inf)  # Pinocchio has none
        self._high = np.where(low < high, high, np.inf)

    def apply(self, before: Vector, v: Vector, dt: float) -> Vector:
        """Return a velocity that motors can reach within dt seconds, near v.

        The velocity before has shape (nv,) as well.
        """
        if motors_suffice(self.argument, self._configuration.robot, before, v, dt):
            return v
        model, data, q = self._configuration.model, self._data, self._configuration.q
        tau = self._arrays.torque.copy()
        rest = pin.rnea(model, data, q, v, self._still).copy()
        found = self._with_saturated(v, tau, rest, dt)
        if found is None:
            found = before + self._feasible_share(tau, rest) * (v - before)
        return np.clip(found, (self._low - q) / dt, (self._high - q) / dt)

    def _with_saturated(
        self, v: Vector, tau: Vector, rest: Vector, dt: float
    ) -> Vector | None:
        """Return velocities with only the saturated joints slower, if that suffices."""
        M = pin.crba(self._configuration.model, self._data, self._configuration.q)
        M = np.triu(M) + np.triu(M, 1).T
        saturated = np.zeros(len(v), dtype=bool)
        torque, change = tau, self._still
        for _ in range(SATURATION_ROUNDS):
            saturated |= np.abs(torque) > self._most
            if (np.abs(rest) >= self._most)[saturated].any():
                return None
            short = np.clip(tau, -self._most, self._most) - tau
            change = self._still.copy()
            change[saturated] = np.linalg.solve(
                M[np.ix_(saturated, saturated)], short[saturated]
            )
            if (change * tau > 0.0).any():
                return None  # one of them would be faster than asked
            torque = tau + M @ change
            if (np.abs(torque) <= self._most + TORQUE_TOLERANCE).all():
                found = v + dt * change
                return found if self._can_stop(found, v) else None
        return None

    def _can_stop(self, found: Vector, asked: Vector) -> bool:
        """Whether joints stop before their ends, or are no faster than asked."""
        q = self._configuration.q
        space = np.where(found > 0.0, self._high - q, q - self._low)
        most = np.sqrt(2.0 * self._accelerations * np.maximum(space, 0.0))
        return bool((np.abs(found) <= np.maximum(most, np.abs(asked))).all())

    def _feasible_share(self, tau: Vector, rest: Vector) -> float:
        """Return the greatest share of all changes that every motor can produce."""
        change = tau - rest
        margin = self._most - np.sign(change) * rest
        # Motors that cannot hold the joint have no margin; the others decide.
        asked = (np.abs(tau) > self._most) & (np.abs(rest) < self._most)
        share = (margin[asked] / np.abs(change[asked])).min(initial=1.0)
        return max(float(share), CHANGE_SHARE_MIN)


def _efforts(robot: RobotDescription, configuration: Configuration) -> Vector:
    """Return the effort of the motor of each velocity; inf where it is unknown."""
    known = {joint.name: joint.effort for joint in robot.joints if joint.effort}
    if robot.root.actuated:
        force, torque = robot.root.effort
        known |= dict(zip(planar_joints(robot), (force, force, torque), strict=False))
    _, v = joint_indices(configuration.model, tuple(known))
    efforts = np.full(configuration.nv, np.inf)
    efforts[v] = list(known.values())
    return efforts
