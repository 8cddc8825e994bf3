"""Track joint targets by computed torque: the law under every whole-body controller."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from pydantic import Field, PositiveFloat

from wbc_suite.control.state import RobotState
from wbc_suite.tomlfile import FrozenModel
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["JointLawConfig", "JointPositionLaw", "JointTarget", "computed_torque"]


class JointLawConfig(FrozenModel):
    """Gains of the joint-position law.

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


def computed_torque(
    *,
    mass_matrix: Matrix,
    bias: Vector,
    acceleration: Vector,
    position_error: Vector,
    velocity_error: Vector,
    kp: float,
    kd: float,
) -> Vector:
    """Return torques that make the tracking error obey e'' + kd e' + kp e = 0.

        tau = M (a + kp e + kd e') + h

    It is the minimiser of `|| M^-1 (tau - h) - (a + kp e + kd e') ||^2`; errors
    decay alike, whatever the inertia, as long as no torque saturates.

    Args:
        mass_matrix: M of the driven joints, shape (n, n).
        bias: h, Coriolis, centrifugal, gravity less passive forces, shape (n,).
        acceleration: a, of the target, shape (n,).
        position_error: e, target less measured, shape (n,).
        velocity_error: e', shape (n,).
        kp: Stiffness, 1/s^2.
        kd: Damping, 1/s.

    Returns:
        Torques and forces, shape (n,), N m and N.

    Source: Siciliano et al. (2009), "Robotics", section 8.5.2.
    """
    wanted = acceleration + kp * position_error + kd * velocity_error
    return mass_matrix @ wanted + bias


@dataclass(frozen=True, kw_only=True, slots=True)
class JointTarget:
    """Where the robot should be, and how fast it should move.

    Attributes:
        position: Of the driven joints, rad or m.
        velocity: Of the driven joints, rad/s or m/s.
        acceleration: Of the driven joints, rad/s^2 or m/s^2.
        root: Pose of a free root; None for the others.
        root_twist: Velocity of a free root, linear in world axes and angular in its
            own, shape (6,).
        root_acceleration: Its derivative, in the same axes, shape (6,).
    """

    position: Vector
    velocity: Vector
    acceleration: Vector
    root: pin.SE3 | None = None
    root_twist: Vector | None = None
    root_acceleration: Vector | None = None


class JointPositionLaw:
    """Computed torque on a set of torque-driven joints.

    Args:
        state: The robot in the simulation.
        joints: Driven joints; each has a motor.
        config: Gains.

    Attributes:
        joints: The driven joints.
        outputs: Their places among the robot's actuators.
    """

    def __init__(
        self, state: RobotState, joints: tuple[str, ...], config: JointLawConfig
    ) -> None:
        self.joints, self.config = joints, config
        self.q_index, self.v_index = state.joint_addresses(joints)
        order = {name: i for i, name in enumerate(state.actuators)}
        self.outputs: Indices = np.array([order[j] for j in joints], dtype=np.int64)
        limits = state.model.actuator_ctrlrange[state.actuator_ids[self.outputs]]
        self._low, self._high = limits[:, 0].copy(), limits[:, 1].copy()
        self._block = np.ix_(self.v_index, self.v_index)

    def torque(self, state: RobotState, target: JointTarget) -> Vector:
        """Return torques within the motors' limits.

        Args:
            state: The robot, after `mj_step1`.
            target: Where the joints should be.
        """
        data = state.data
        tau = computed_torque(
            mass_matrix=state.mass_matrix()[self._block],
            bias=(data.qfrc_bias - data.qfrc_passive)[self.v_index],
            acceleration=target.acceleration,
            position_error=target.position - data.qpos[self.q_index],
            velocity_error=target.velocity - data.qvel[self.v_index],
            kp=self.config.kp,
            kd=self.config.kd,
        )
        return np.clip(tau, self._low, self._high)
