"""Control laws as data: one record per law, one per driven joint.

The compiled loop and the readable forms read the same records. A law owns its records
until a simulation gathers the laws of all its robots into one table.
"""

from collections.abc import Sequence
from enum import IntEnum
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["DRIVE", "LAW", "MOST_FEET", "STANCE", "CompiledRecords", "LawKind"]
__all__ += ["Records", "gather"]

MOST_FEET = 8
"""Feet that one robot may stand on."""

Records: TypeAlias = NDArray[np.void]
"""Structured array of `LAW` or `DRIVE` records."""

CompiledRecords: TypeAlias = Any
"""Such an array, or one record of it, in compiled code: fields are attributes."""


class LawKind(IntEnum):
    """What a law makes of its records; see the class of each in `control.part`."""

    JOINT = 0
    OSC = 1
    BASE = 2
    TORQUE = 3
    SERVO = 4
    VELOCITY = 5
    STANCE = 6  # from here on: of feet; others drive the joints
    BALANCE = 7


STANCE = np.dtype(
    [
        ("qpos", "i8"),  # where the free root is in qpos
        ("dof", "i8"),  # and in qvel
        ("body", "i8"),  # the link that it moves
        ("feet", "i8"),  # how many
        ("site", "i8", (MOST_FEET,)),  # their frames
        ("rows", "i8", (MOST_FEET,)),  # 3: a point, 6: a surface
        ("edges", "f8", (MOST_FEET, 4)),  # heel, toes, right, left of a sole, m
        ("force", "f8", (6 * MOST_FEET,)),  # what feet should give, N and N m, by rows
        # the root's target: `start exp(behind + twist s + curve s^2/2 + bend s^3/6)`
        ("behind", "f8", (6,)),  # linear then angular, in its own axes
        ("twist", "f8", (6,)),
        ("curve", "f8", (6,)),
        ("bend", "f8", (6,)),
        # what the observer remembers of the root
        ("asked", "f8", (6,)),
        ("before", "f8", (6,)),
    ]
)
"""What a law of feet knows besides: root and feet."""


LAW = np.dtype(
    [
        ("kind", "i8"),  # LawKind
        ("first", "i8"),  # the law's drives are drives[first:last]
        ("last", "i8"),
        ("since", "f8"),  # s since the goal was set
        ("duration", "f8"),  # s that the target moves after that
        ("compensation", "f8"),  # 1: gravity, Coriolis and passive forces are cancelled
        ("observer", "f8"),  # 1/s; how fast disturbances are found out, 0: not at all
        # operational space; poses are rotation (row by row) and position
        ("site", "i8"),
        ("reference", "i8"),  # body whose axes goals are given in; 0 is the world
        ("start", "f8", (12,)),  # where the target started, in the reference
        ("shift", "f8", (3,)),  # how far it moves, m, axes of the reference
        ("turn", "f8", (3,)),  # how far it turns, rotation vector in the start's axes
        ("kp", "f8", (6,)),  # 1/s^2, linear then angular, axes of the reference
        ("kd", "f8", (6,)),  # 1/s
        ("speed", "f8", (2,)),  # greatest speeds asked for, m/s and rad/s
        ("straight", "f8"),  # 1: at the joints' limits the direction is kept
        ("stance", STANCE),
    ]
)
"""A law. Joint laws leave the fields of operational space alone; a law of feet uses
start, kp and kd for the root, and its drives' targets for the centre of mass."""

DRIVE = np.dtype(
    [
        ("qpos", "i8"),  # where the joint is in qpos
        ("dof", "i8"),  # and in qvel
        ("ctrl", "i8"),  # its actuator
        ("low", "f8"),  # limits of the actuator's command
        ("high", "f8"),
        ("position", "f8"),  # target after s seconds:
        ("velocity", "f8"),  #   position + velocity s + acceleration s^2 / 2
        ("acceleration", "f8"),  # + jerk s^3 / 6
        ("jerk", "f8"),
        ("kp", "f8"),  # 1/s^2
        ("kd", "f8"),  # 1/s
        ("most", "f8"),  # correction at most, rad/s^2 or m/s^2
        ("leash", "f8"),  # how far a target that speeds move may be from its joint
        ("command", "f8"),  # what the law last asked of the actuator
        # limits that motion must keep; see `loop.window`
        ("lowest", "f8"),  # rad or m
        ("highest", "f8"),
        ("fastest", "f8"),  # rad/s or m/s
        ("braking", "f8"),  # rad/s^2 or m/s^2
        # what the observer remembers of the last step; see `loop.observer`
        ("asked", "f8"),  # acceleration
        ("before", "f8"),  # velocity
        ("lack", "f8"),  # command less the force that the acceleration needs
        ("disturbance", "f8"),  # force of others on the joint, N m or N
    ]
)
"""A driven joint. Of a torque law the target is a torque, of a servo its set point; of
a law in operational space position, kp and kd hold the posture in the null space. Of
laws of speeds (`VELOCITY`, `BASE`) the position is where the target is now, velocity
and acceleration are those of the speed: it changes until `duration`, then stays."""


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
    return laws, drives
