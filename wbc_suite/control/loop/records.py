"""Control laws as data: one record for each law, one for each driven joint.

A law owns its records until a simulation gathers the laws of all robots in one table.
"""

from collections.abc import Sequence
from enum import IntEnum

import numpy as np

from wbc_suite.compiling import readable
from wbc_suite.typing import CompiledRecords, Records

__all__ = ["DRIVE", "LAW", "CompiledRecords", "LawKind", "Records", "gather"]
__all__ += ["new_records", "readable"]


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


LAW = np.dtype(
    [
        ("kind", "i8"),  # LawKind
        ("kernel", "i8"),  # place of its kernel in `LoopKernels`; 0: none
        ("first", "i8"),  # the law's joints are drives[first:last]
        ("last", "i8"),
        ("since", "f8"),  # s since the goal was set
        ("duration", "f8"),  # s for which the reference moves after that
        ("compensation", "f8"),  # 1: gravity, Coriolis and passive forces are cancelled
        ("observer", "f8"),  # bandwidth of the disturbance observer, 1/s; 0: none
        # operational space; poses are rotation (row by row) and position
        ("site", "i8"),
        ("reference", "i8"),  # body whose axes goals are given in; 0 is the world
        ("start", "f8", (12,)),  # pose at which the reference started
        ("shift", "f8", (3,)),  # its translation to the goal, m, axes of the reference
        ("turn", "f8", (3,)),  # its rotation vector to the goal, axes of the start
        ("kp", "f8", (6,)),  # 1/s^2, linear then angular, axes of the reference
        ("kd", "f8", (6,)),  # 1/s
        ("speed", "f8", (2,)),  # velocity limits, m/s and rad/s
        ("keep_direction", "f8"),  # 1: saturated joints keep the hand's direction
        ("parameters", "f8", (32,)),  # of users' laws
    ]
)
"""A law. Laws of joints do not use the fields of operational space."""

DRIVE = np.dtype(
    [
        ("qpos", "i8"),  # index of the joint in qpos
        ("dof", "i8"),  # and in qvel
        ("ctrl", "i8"),  # its actuator
        ("command_min", "f8"),
        ("command_max", "f8"),
        # the actuator's force is gain u - stiffness q - damping v
        ("gain", "f8"),
        ("stiffness", "f8"),  # N m/rad or N/m; 0 of a motor
        ("damping", "f8"),  # N m s/rad or N s/m
        ("implicit_inertia", "f8"),  # of damping in a step, kg m^2 or kg
        ("position", "f8"),  # reference after s seconds:
        ("velocity", "f8"),  #   position + velocity s + acceleration s^2 / 2
        ("acceleration", "f8"),  # + jerk s^3 / 6
        ("jerk", "f8"),
        ("kp", "f8"),  # 1/s^2
        ("kd", "f8"),  # 1/s
        ("correction_max", "f8"),  # feedback acceleration, rad/s^2 or m/s^2
        ("windup_max", "f8"),  # distance of an integrated command from its joint
        ("command", "f8"),  # last force of the actuator, or setpoint of a servo law
        # joint limits, see `loop.acceleration_limits`
        ("position_min", "f8"),  # rad or m
        ("position_max", "f8"),
        ("velocity_max", "f8"),  # rad/s or m/s
        ("deceleration", "f8"),  # rad/s^2 or m/s^2
        # state of the disturbance observer
        ("desired", "f8"),  # acceleration of the last step
        ("last_velocity", "f8"),
        ("saturation", "f8"),  # command less the torque that `desired` needed
        ("disturbance", "f8"),  # estimated external force on the joint, N m or N
    ]
)
"""A driven joint. The reference of a torque law is a torque, that of a servo its
setpoint; in a law in operational space position, kp and kd hold the posture in the null
space. In laws of velocities (`VELOCITY`, `BASE`) the position is the reference now,
velocity and acceleration are those of the commanded velocity, which changes until
`duration`."""


def new_records(count: int, kind: np.dtype[np.void]) -> Records:
    """Return records of `LAW` or `DRIVE` kind, all zero."""
    return readable(np.zeros(count, kind))


def gather(pieces: Sequence[tuple[Records, Records]]) -> tuple[Records, Records]:
    """Return one table of all laws' records, and one of all drives' records.

    Args:
        pieces: Each law's own record, shape (1,), and its drives, shape (n,).
    """
    laws = np.concatenate([law for law, _ in pieces] or [np.zeros(0, LAW)])
    drives = np.concatenate([drive for _, drive in pieces] or [np.zeros(0, DRIVE)])
    ends = np.cumsum([len(drive) for _, drive in pieces], dtype=np.int64)
    laws["last"] = ends
    laws["first"][1:] = ends[:-1]
    return readable(laws), readable(drives)
