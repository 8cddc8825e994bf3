"""Control laws: references of joints, and the records that the loop reads."""

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from wbc_suite.compiling import inner
from wbc_suite.control.ground.records import Drive, Drives, LawKind, LawRecord, Laws
from wbc_suite.control.memory import Parts
from wbc_suite.control.state import RobotState
from wbc_suite.errors import ConfigError
from wbc_suite.registry import Registry
from wbc_suite.typing import Indices, Matrix, Records, Vector

DECELERATION = 10.0
"""rad/s^2 or m/s^2; joints stop at their limits with it unless the robot's description
gives another. Arms of the catalogue can do so carrying themselves."""

LEAST_SHARE = 0.1
"""Of a joint's inertia; less that implicit damping adds is left out."""

FOREVER = np.inf
"""s; a reference that moves until it is replaced."""

LAWS: Registry[Any] = Registry("law")
"""Kernels `(physics, law, drives) -> None` of `wbc_suite.compiling.compiled`, by name.

A kernel writes the accelerations of the law's joints, `drives[law.first : law.last]`,
to `physics.acceleration[drive.dof]`. The loop then applies the limits of the joints and
computes the torques.
"""

register_law = LAWS.register


def law_kind(name: str) -> int:
    """Return the number of a registered law in records; raises UnknownNameError."""
    return int(LawKind.CUSTOM) + list(LAWS).index(LAWS.spelled(name))


def law_kernel(kind: int) -> Any:
    """Return the kernel of a registered law."""
    return LAWS[list(LAWS)[kind - int(LawKind.CUSTOM)]]


@inner
def reference_at(law: LawRecord, drive: Drive) -> tuple[float, float, float]:
    """Return position, velocity and acceleration of a drive's reference now."""
    s = min(law.since, law.duration)
    v, a, j = drive.velocity, drive.acceleration, drive.jerk
    position = drive.position + s * (v + s * (0.5 * a + s / 6.0 * j))
    if law.since > law.duration:
        return position, 0.0, 0.0
    return position, v + s * (a + 0.5 * s * j), a + s * j


@inner
def set_reference(record: Laws, drives: Drives, motion: Matrix) -> None:
    """Set the reference of a law's record, shape (1,), and drives; see `Law.aim`.

    The motion has positions, velocities, accelerations and jerks, shape (4, n).
    """
    for j in range(len(drives)):
        drive = drives[j]
        drive.position, drive.velocity = motion[0, j], motion[1, j]
        drive.acceleration, drive.jerk = motion[2, j], motion[3, j]
    record[0].since, record[0].duration = 0.0, np.inf


_TIMES = ("since", "duration")
_HAND = ("reference", "start", "shift", "turn")
_REFERENCES = ("position", "velocity", "acceleration", "jerk")
_OBSERVER = ("desired", "last_velocity", "saturation", "disturbance")
"""Fields of records that a goal or a step changes."""


class Law:
    """A law for some driven joints; its numbers are in records that the loop reads.

    The kernel of each kind stands beside its class; `run.motor_commands` computes
    torques from the accelerations that all laws ask for.

    The kind selects the kernel: a `LawKind`, or the name of a registered law.

    Attributes:
        record: Its `LawRecord`, shape (1,).
        drives: Its `Drive` records, shape (n,).
        index: Its place in the table of a simulation.

    Raises:
        ConfigError: If a joint has no actuator.
        UnknownNameError: If there is no law of a name.
    """

    index: int = 0

    def __init__(
        self, kind: int | str, state: RobotState, joints: Sequence[str]
    ) -> None:
        kind = law_kind(kind) if isinstance(kind, str) else kind
        self.joints = tuple(joints)
        places = {name: i for i, name in enumerate(state.actuators)}
        for name in joints:
            if name not in places:
                raise ConfigError(f"{state.robot.name}: joint '{name}' has no motor.")
        self.outputs: Indices = np.array([places[j] for j in joints], dtype=np.int64)
        self.record: Records = LawRecord.zeros()
        self.drives: Records = Drive.zeros(len(self.joints))
        self.record["kind"], self.record["compensation"] = kind, 1.0
        self.record["duration"] = FOREVER
        drives = self.drives
        drives["qpos"], drives["dof"] = state.joint_addresses(self.joints)
        drives["ctrl"] = state.actuator_ids[self.outputs]
        limits = state.model.actuator_ctrlrange[drives["ctrl"]]
        limited = state.model.actuator_ctrllimited[drives["ctrl"]].astype(bool)
        drives["command_min"] = np.where(limited, limits[:, 0], -np.inf)
        drives["command_max"] = np.where(limited, limits[:, 1], np.inf)
        drives["gain"] = 1.0
        if kind != LawKind.SERVO:
            self._read_servos(state.model)
        drives["position_min"], drives["position_max"] = -np.inf, np.inf
        drives["velocity_max"], drives["deceleration"] = np.inf, DECELERATION
        drives["windup_max"], drives["correction_max"] = np.inf, np.inf

    def _read_servos(self, m: mujoco.MjModel) -> None:
        """Read how servos make forces, and the damping that a step treats implicitly.

        In a step h, a joint of damping D moves as if it had h D more inertia. That is
        left out where it is small beside the joint's own.
        """
        drives = self.drives
        ctrl, dof = drives["ctrl"], drives["dof"]
        servo = m.actuator_biastype[ctrl] == mujoco.mjtBias.mjBIAS_AFFINE
        bias = np.where(servo[:, None], -m.actuator_biasprm[ctrl, 1:3], 0.0)
        drives["stiffness"], drives["damping"] = bias.T
        drives["gain"] = np.where(servo, m.actuator_gainprm[ctrl, 0], 1.0)
        limits = m.actuator_forcerange[ctrl]
        limits[m.actuator_forcelimited[ctrl] == 0] = -np.inf, np.inf
        low, high = drives["command_min"], drives["command_max"]
        drives["command_min"] = np.where(servo, limits[:, 0], low)
        drives["command_max"] = np.where(servo, limits[:, 1], high)
        damping = m.dof_damping.reshape(m.nv, -1)[dof, 0] + drives["damping"]
        added = m.opt.timestep * damping
        drives["implicit_inertia"] = np.where(
            added > LEAST_SHARE * m.dof_M0[dof], added, 0.0
        )

    @property
    def memory(self) -> Parts:
        """Fields of its records that outlive a step; views.

        Gains are settings: a controller whose actions set them adds `gains` to its own.
        """
        record, kind = self.record, int(self.record["kind"][0])
        fields = _TIMES
        if kind == LawKind.OSC or kind >= LawKind.CUSTOM:
            fields = *fields, *_HAND
        if kind >= LawKind.CUSTOM:
            fields = *fields, "parameters"
        drives = [self.drives[name] for name in (*_REFERENCES, *_OBSERVER)]
        return *(record[name] for name in fields), *drives

    @property
    def gains(self) -> Parts:
        """Stiffness and damping; views of its records."""
        return self.drives["kp"], self.drives["kd"]

    def reset(self, state: RobotState) -> None:
        """Reset the disturbance observer."""
        drives = self.drives
        drives["desired"] = drives["saturation"] = drives["disturbance"] = 0.0
        drives["last_velocity"] = state.data.qvel[drives["dof"]]

    def keep_limits(self, state: RobotState) -> None:
        """Keep the robot's position and velocity limits; see `acceleration_limits`.

        Positions end where the joint's stop begins to act. Joints of a planar root have
        none.
        """
        for drive, name in zip(self.drives, self.joints, strict=True):
            if name in state.robot.root_joint_names:
                continue
            joint = state.robot.joint(name)
            margin = state.model.joint(state.prefix + name).margin.item()
            low, high = joint.range or (-np.inf, np.inf)
            drive["position_min"], drive["position_max"] = low + margin, high - margin
            drive["velocity_max"] = joint.velocity or np.inf
            drive["deceleration"] = joint.acceleration or DECELERATION

    def adopt(self, record: Records, drives: Records, index: int = 0) -> None:
        """Use records that hold the same values: those of a simulation's table."""
        self.record, self.drives, self.index = record, drives, index

    def aim(
        self,
        position: Vector,
        velocity: Vector | float = 0.0,
        acceleration: Vector | float = 0.0,
        jerk: Vector | float = 0.0,
        *,
        duration: float = FOREVER,
    ) -> None:
        """Set the reference from now on, rad or m (N m or N of a torque law).

            position + velocity s + acceleration s^2 / 2 + jerk s^3 / 6

        All have shape (n,). It stands still after `duration` seconds.
        """
        drives = self.drives
        drives["position"], drives["velocity"] = position, velocity
        drives["acceleration"], drives["jerk"] = acceleration, jerk
        self.record["since"], self.record["duration"] = 0.0, duration

    def move(self, position: Vector, duration: float) -> None:
        """Move the reference to a position, shape (n,), at constant velocity.

        At a duration of 0 s it jumps.
        """
        if duration > 0.0:
            now, _, _ = self.target()
            self.aim(now, (position - now) / duration, duration=duration)
        else:
            self.aim(position)

    def target(self) -> tuple[Vector, Vector, Vector]:
        """Return position, velocity and acceleration of the reference, (n,) each."""
        now = [reference_at(self.record[0], drive) for drive in self.drives]
        position, velocity, acceleration = np.reshape(now, (-1, 3)).T
        return position, velocity, acceleration


class ServoLaw(Law):
    """Setpoints of actuators that are servos themselves, such as fingers'."""

    def __init__(self, state: RobotState, joints: Sequence[str]) -> None:
        super().__init__(LawKind.SERVO, state, joints)


class TorqueLaw(Law):
    """Torques on top of those that compensate gravity and Coriolis forces.

        tau = tau* + h

    It minimises `|| tau - h - tau* ||^2`. The joints' own friction stays, so motion
    decays; other laws' accelerations have no effect, so joints at rest stay at rest.
    """

    def __init__(self, state: RobotState, joints: Sequence[str]) -> None:
        super().__init__(LawKind.TORQUE, state, joints)
