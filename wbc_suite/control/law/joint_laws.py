"""Laws in joint space: positions, velocities, and planar bases."""

from collections.abc import Sequence

import numpy as np
from pydantic import Field, PositiveFloat

from wbc_suite.compiling import compiled, inner
from wbc_suite.config_files import FrozenModel
from wbc_suite.control.ground.physics import Physics
from wbc_suite.control.ground.records import Drive, Drives, LawKind, LawRecord
from wbc_suite.control.law.law import Law, reference_at
from wbc_suite.control.state import RobotState
from wbc_suite.typing import Vector


@inner
def joint_law(physics: Physics, law: LawRecord, drives: Drives) -> None:
    """Write `a* + kp (q* - q) + kd (v* - v)` of each joint; see `JointLaw`."""
    for j in range(law.first, law.last):
        q, v, a = reference_at(law, drives[j])
        _track(physics, drives[j], q, v, a)


@compiled
def velocity_law(physics: Physics, law: LawRecord, drives: Drives) -> None:
    """Integrate the references by one step, and track them; see `VelocityLaw`."""
    for j in range(law.first, law.last):
        v, a = _commanded_velocity(law, drives[j])
        _integrate(physics, drives[j], v)
        _track(physics, drives[j], drives[j].position, v, a)


@compiled
def base_law(physics: Physics, law: LawRecord, drives: Drives) -> None:
    """Integrate a base's reference by one step, and track it; see `VelocityLaw`."""
    x, y, yaw = drives[law.first], drives[law.first + 1], drives[law.first + 2]
    forward, forward_rate = _commanded_velocity(law, x)
    sideways, sideways_rate = _commanded_velocity(law, y)
    turn, turn_rate = _commanded_velocity(law, yaw)
    c, s = np.cos(yaw.position), np.sin(yaw.position)
    v_x, v_y = c * forward - s * sideways, s * forward + c * sideways
    a_x = c * forward_rate - s * sideways_rate - turn * v_y
    a_y = s * forward_rate + c * sideways_rate + turn * v_x
    _integrate(physics, x, v_x)
    _integrate(physics, y, v_y)
    _integrate(physics, yaw, turn)
    _track(physics, x, x.position, v_x, a_x)
    _track(physics, y, y.position, v_y, a_y)
    _track(physics, yaw, yaw.position, turn, turn_rate)


@inner
def _track(physics: Physics, drive: Drive, q: float, v: float, a: float) -> None:
    """Write `a + kp (q - q_now) + kd (v - v_now)` with a bounded correction."""
    error = q - physics.qpos[drive.qpos]
    correction = drive.kp * error + drive.kd * (v - physics.qvel[drive.dof])
    correction = min(max(correction, -drive.correction_max), drive.correction_max)
    physics.acceleration[drive.dof] = a + correction


@inner
def _commanded_velocity(law: LawRecord, drive: Drive) -> tuple[float, float]:
    """Return the commanded velocity of a drive now, and its rate."""
    velocity = drive.velocity + min(law.since, law.duration) * drive.acceleration
    return velocity, drive.acceleration if law.since <= law.duration else 0.0


@inner
def _integrate(physics: Physics, drive: Drive, v: float) -> None:
    """Move a reference by one step, near its joint and within the joint's range."""
    q = physics.qpos[drive.qpos]
    position = drive.position + physics.timestep * v
    position = min(max(position, q - drive.windup_max), q + drive.windup_max)
    drive.position = min(max(position, drive.position_min), drive.position_max)


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
    """Joints track their references by computed torque.

        a = a* + kp (q* - q) + kd (v* - v),    tau = M a + h

    It is the minimiser of `|| M^-1 (tau - h) - (a* + kp e + kd e') ||^2`; errors decay
    alike, whatever the inertia, as long as no torque saturates.

    Stiffness kp, 1/s^2, and damping kd, 1/s, are those of all joints or of each.

    Source: Siciliano et al. (2009), "Robotics", section 8.5.2.
    """

    def __init__(
        self,
        state: RobotState,
        joints: Sequence[str],
        *,
        kp: Vector | float,
        kd: Vector | float,
    ) -> None:
        super().__init__(LawKind.JOINT, state, joints)
        self.set_gains(kp, kd)

    def set_gains(self, kp: Vector | float, kd: Vector | float) -> None:
        """Set stiffness, 1/s^2, and damping, 1/s, for all joints or each."""
        self.drives["kp"], self.drives["kd"] = kp, kd


class VelocityLaw(Law):
    """Joints follow velocities: PI control, stated as a reference that moves.

    The reference of a joint moves by `v* dt` in each step and is tracked, so

        a = a* + kd (v* - v) + kp (integral of v* - v),

    and a joint at zero velocity keeps its position under load. The integral cannot wind
    up: a reference stays within `windup` of its joint, and within the joint's range.

    The law of a planar base, kind `BASE`, has the joints x, y and yaw; its velocities
    are forward, sideways and around, in the axes of the reference: `v* = R(yaw*) u`.
    Its correction should be bounded: a base that is blocked would ask for ever more
    acceleration, and an arm on it would compensate for what does not happen.

    Args:
        kp: Integral gain, 1/s^2.
        kd: Proportional gain, 1/s.
        windup: Greatest distance between reference and joint, rad or m.
        correction: Greatest feedback acceleration, rad/s^2 or m/s^2.
        kind: `VELOCITY` or `BASE`.
    """

    def __init__(
        self,
        state: RobotState,
        joints: Sequence[str],
        *,
        kp: Vector | float,
        kd: Vector | float,
        windup: Vector | float = np.inf,
        correction: Vector | float = np.inf,
        kind: LawKind = LawKind.VELOCITY,
    ) -> None:
        super().__init__(kind, state, joints)
        drives = self.drives
        drives["kp"], drives["kd"] = kp, kd
        drives["windup_max"], drives["correction_max"] = windup, correction
        self.halt(state)

    def halt(self, state: RobotState) -> None:
        """Stand still where the joints are."""
        self.aim(state.data.qpos[self.drives["qpos"]])

    def set_speed(self, speed: Vector, *, duration: float = 0.0) -> None:
        """Change the commanded velocity, at a constant rate or at once.

        At once, references start behind by `(change of velocity) / r`, with r the
        faster root of `s^2 + kd s + kp`: the joints' velocities then go to the new one
        by `exp(-r s)`, without overshoot, and come to rest without turning back.

        Args:
            speed: Shape (n,), rad/s or m/s.
            duration: Time of the change, s; 0 is at once.
        """
        now, _ = self.commanded()
        drives = self.drives
        if duration > 0.0:
            rate = (speed - now) / duration
            self.aim(drives["position"], now, rate, duration=duration)
        else:
            half = 0.5 * drives["kd"]
            root = half + np.sqrt(np.maximum(half**2 - drives["kp"], 0.0))
            self.aim(drives["position"] - (speed - now) / root, speed)

    def commanded(self) -> tuple[Vector, Vector]:
        """Return the commanded velocity now and its rate, shape (n,) each."""
        now = [_commanded_velocity(self.record[0], drive) for drive in self.drives]
        velocity, rate = np.reshape(now, (-1, 2)).T
        return velocity, rate
