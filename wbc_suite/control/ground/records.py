"""Control laws as data: one record for each law, one for each driven joint.

A law owns its records until a simulation gathers the laws of all robots in one table.
"""

from collections.abc import Sequence
from enum import IntEnum
from typing import Annotated, TypeAlias

import numpy as np

from wbc_suite.compiling import Record
from wbc_suite.typing import Records, Vector


class LawKind(IntEnum):
    """Which kernel computes a law; see the classes of `control.law`."""

    JOINT = 0
    OSC = 1
    BASE = 2
    TORQUE = 3
    SERVO = 4
    VELOCITY = 5
    DYNAMICS = 6
    CUSTOM = 100
    """Laws of users: this and larger numbers, see `control.law.register_law`."""


class LawRecord(Record):
    """A law. Laws of joints do not use the fields of operational space.

    Poses there are a rotation, row by row, and a position.
    """

    kind: int
    """`LawKind`."""
    kernel: int
    """Place of its kernel in `LoopKernels`; 0: none."""
    first: int
    """The law's joints are `drives[first:last]`."""
    last: int
    since: float
    """s since the goal was set."""
    duration: float
    """s for which the reference moves after that."""
    compensation: float
    """1: gravity, Coriolis and passive forces are cancelled."""
    observer: float
    """Bandwidth of the disturbance observer, 1/s; 0: none."""
    site: int
    reference: int
    """Body whose axes goals are given in; 0 is the world."""
    start: Annotated[Vector, 12]
    """Pose at which the reference started."""
    shift: Annotated[Vector, 3]
    """Its translation to the goal, m, axes of the reference."""
    turn: Annotated[Vector, 3]
    """Its rotation vector to the goal, axes of the start."""
    kp: Annotated[Vector, 6]
    """1/s^2, linear then angular, axes of the reference."""
    kd: Annotated[Vector, 6]
    """1/s."""
    speed: Annotated[Vector, 2]
    """Velocity limits, m/s and rad/s."""
    turn_weight: float
    """Of angular accelerations, beside 1 of linear ones where joints lack for both."""
    keep_direction: float
    """1: saturated joints keep the hand's direction."""
    parameters: Annotated[Vector, 32]
    """Of users' laws."""


class Drive(Record):
    """A driven joint.

    The reference of a torque law is a torque, that of a servo its setpoint; in a law in
    operational space position, kp and kd hold the posture in the null space. In laws of
    velocities (`VELOCITY`, `BASE`) the position is the reference now, velocity and
    acceleration are those of the commanded velocity, which changes until `duration`.
    """

    qpos: int
    """Index of the joint in qpos."""
    dof: int
    """And in qvel."""
    ctrl: int
    """Its actuator, whose force is `gain u - stiffness q - damping v`."""
    command_min: float
    command_max: float
    gain: float
    stiffness: float
    """N m/rad or N/m; 0 of a motor."""
    damping: float
    """N m s/rad or N s/m."""
    implicit_inertia: float
    """Of damping in a step, kg m^2 or kg."""
    position: float
    """Reference after s seconds: `position + velocity s + acceleration s^2 / 2`."""
    velocity: float
    acceleration: float
    jerk: float
    """`+ jerk s^3 / 6`."""
    kp: float
    """1/s^2."""
    kd: float
    """1/s."""
    correction_max: float
    """Feedback acceleration, rad/s^2 or m/s^2."""
    windup_max: float
    """Distance of an integrated command from its joint, rad or m."""
    command: float
    """Last force of the actuator, or setpoint of a servo law."""
    position_min: float
    """rad or m; see `ground.acceleration_limits`, as the next three."""
    position_max: float
    velocity_max: float
    """rad/s or m/s."""
    deceleration: float
    """rad/s^2 or m/s^2."""
    desired: float
    """Acceleration of the last step; state of the observer, as the next three."""
    last_velocity: float
    saturation: float
    """Command less the torque that `desired` needed."""
    disturbance: float
    """Estimated external force on the joint, N m or N."""


Laws: TypeAlias = Sequence[LawRecord]
Drives: TypeAlias = Sequence[Drive]


def gather(pieces: Sequence[tuple[Records, Records]]) -> tuple[Records, Records]:
    """Return one table of all laws' records, and one of all drives' records.

    Args:
        pieces: Each law's own record, shape (1,), and its drives, shape (n,).
    """
    laws = np.concatenate([LawRecord.zeros(0), *(law for law, _ in pieces)])
    drives = np.concatenate([Drive.zeros(0), *(drive for _, drive in pieces)])
    ends = np.cumsum([len(drive) for _, drive in pieces], dtype=np.int64)
    laws["last"] = ends
    laws["first"][1:] = ends[:-1]
    return laws, drives
