"""Laws in joint space."""

from collections.abc import Sequence

import numpy as np
from pydantic import Field, PositiveFloat

from wbc_suite.control.loop.table import LawKind
from wbc_suite.control.part.law import Law
from wbc_suite.control.state import RobotState
from wbc_suite.tomlfile import FrozenModel
from wbc_suite.typing import Vector

__all__ = ["BaseLaw", "JointLaw", "JointLawConfig", "VelocityLaw"]


class JointLawConfig(FrozenModel):
    """Gains of a joint law.

    Attributes:
        kp: Stiffness of the error dynamics, 1/s^2; 900 is a bandwidth of 30 rad/s.
        damping_ratio: 1 is critically damped; `kd = 2 damping_ratio sqrt(kp)`, 1/s.
    """

    kp: PositiveFloat = 900.0
    damping_ratio: float = Field(default=1.0, ge=0.0)

    @property
    def kd(self) -> float:
        """Damping of the error dynamics, 1/s."""
        return 2.0 * self.damping_ratio * self.kp**0.5


class JointLaw(Law):
    """Joints follow their targets by computed torque.

        a = a* + kp (q* - q) + kd (v* - v),    tau = M a + h

    It is the minimiser of `|| M^-1 (tau - h) - (a* + kp e + kd e') ||^2`; errors decay
    alike, whatever the inertia, as long as no torque saturates.

    Args:
        state: The robot in the simulation.
        joints: Driven joints.
        kp: Stiffness of the error dynamics, 1/s^2, for all or each.
        kd: Their damping, 1/s.

    Source: Siciliano et al. (2009), "Robotics", section 8.5.2.
    """

    def __init__(
        self,
        state: RobotState,
        joints: Sequence[str],
        *,
        kp: Vector | float,
        kd: Vector | float,
        kind: LawKind = LawKind.JOINT,
    ) -> None:
        super().__init__(kind, state, joints)
        self.set_gains(kp, kd)

    def set_gains(self, kp: Vector | float, kd: Vector | float) -> None:
        """Set stiffness, 1/s^2, and damping, 1/s, for all joints or each."""
        self.drives["kp"], self.drives["kd"] = kp, kd

    def acceleration(self, state: RobotState, others: Vector) -> Vector:
        """Return a, shape (n,), rad/s^2 or m/s^2."""
        q, v, a = self.target()
        drives, data = self.drives, state.data
        position_error = q - data.qpos[drives["qpos"]]
        velocity_error = v - data.qvel[drives["dof"]]
        correction = drives["kp"] * position_error + drives["kd"] * velocity_error
        return a + np.clip(correction, -drives["most"], drives["most"])


class VelocityLaw(JointLaw):
    """Joints follow speeds: PI control, stated as a target that moves on.

    The target of a joint moves by `v* dt` each step and is followed like any other, so

        a = a* + kd (v* - v) + kp (integral of v* - v),

    and a joint told to stand still stands still, whatever pushes. The integral cannot
    wind up: a target is never further than its leash from the joint, and never outside
    the joint's range.

    Args:
        state: The robot in the simulation.
        joints: Driven joints.
        kp: Integral gain, 1/s^2.
        kd: Proportional gain, 1/s.
        leash: Greatest distance between target and joint, rad or m.
    """

    def __init__(
        self,
        state: RobotState,
        joints: Sequence[str],
        *,
        kp: Vector | float,
        kd: Vector | float,
        leash: Vector | float = np.inf,
        kind: LawKind = LawKind.VELOCITY,
    ) -> None:
        super().__init__(state, joints, kp=kp, kd=kd, kind=kind)
        self.drives["leash"] = leash
        self.halt(state)

    def halt(self, state: RobotState) -> None:
        """Stand still where the joints are."""
        self.aim(state.data.qpos[self.drives["qpos"]])
        self._v = self._a = np.zeros(len(self.joints))

    def set_speed(self, speed: Vector, *, duration: float = 0.0) -> None:
        """Let the speed change to a new one, at a constant rate or at once.

        At once, targets start behind by `(change of speed) / r`, with r the faster root
        of `s^2 + kd s + kp`: the joints' speeds then go to the new one by `exp(-r s)`,
        without overshoot, and come to rest without turning back.

        Args:
            speed: Shape (n,), rad/s or m/s.
            duration: Time that it takes, s.
        """
        now, _ = self.asked()
        drives = self.drives
        if duration > 0.0:
            rate = (speed - now) / duration
            self.aim(drives["position"], now, rate, duration=duration)
        else:
            half = 0.5 * drives["kd"]
            root = half + np.sqrt(np.maximum(half**2 - drives["kp"], 0.0))
            self.aim(drives["position"] - (speed - now) / root, speed)

    def asked(self) -> tuple[Vector, Vector]:
        """Return speed and acceleration asked for now, shape (n,) each."""
        since, duration = float(self.record["since"][0]), self.record["duration"][0]
        rate = self.drives["acceleration"]
        now = self.drives["velocity"] + min(since, duration) * rate
        return now, float(since <= duration) * rate

    def advance(self, state: RobotState) -> None:
        """Move the targets by one step."""
        super().advance(state)
        self._v, self._a = self._motion()
        drives, q = self.drives, state.data.qpos[self.drives["qpos"]]
        moved = drives["position"] + state.model.opt.timestep * self._v
        moved = np.clip(moved, q - drives["leash"], q + drives["leash"])
        drives["position"] = np.clip(moved, drives["lowest"], drives["highest"])

    def target(self) -> tuple[Vector, Vector, Vector]:
        """Return position, velocity and acceleration of the target now, (n,) each."""
        return self.drives["position"], self._v, self._a

    def _motion(self) -> tuple[Vector, Vector]:
        """Return velocity and acceleration of the targets in this step."""
        return self.asked()


class BaseLaw(VelocityLaw):
    """A planar base drives along its own heading.

    A base that something stops would ask for ever more, and other parts prepare for
    accelerations that do not come: the arm on it swings ahead. So its correction is
    bounded.

    A `VelocityLaw` of x, y and yaw whose speeds are forward, sideways and around, in
    the target's axes: `v* = R(yaw*) u`.

    Args:
        state: The robot in the simulation.
        joints: Its joints x, y and yaw.
        kp: Stiffness of the error dynamics, 1/s^2.
        kd: Its damping, 1/s.
        leash: Greatest distance between target and base, m and rad.
        most: Greatest acceleration that makes up for errors, m/s^2 and rad/s^2.
    """

    def __init__(
        self,
        state: RobotState,
        joints: Sequence[str],
        *,
        kp: float,
        kd: float,
        leash: Vector | float = np.inf,
        most: Vector | float = np.inf,
    ) -> None:
        super().__init__(state, joints, kp=kp, kd=kd, leash=leash, kind=LawKind.BASE)
        self.drives["most"] = most

    def _motion(self) -> tuple[Vector, Vector]:
        (forward, sideways, turn), rate = self.asked()
        yaw = self.drives["position"][2]
        R = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        v_x, v_y = R @ (forward, sideways)
        a_x, a_y = R @ rate[:2] + turn * np.array([-v_y, v_x])
        return np.array([v_x, v_y, turn]), np.array([a_x, a_y, rate[2]])
