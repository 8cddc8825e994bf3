"""What a gait is given and what it answers, and the numbers that it keeps.

Planners know no engine and no QP. Each is a function

    plan(gait, measured, command, dt, out)

that reads where the centre of mass and the feet are and writes which feet stand, where
the others swing, and how the centre of mass has to accelerate.
"""

from collections.abc import Sequence
from enum import IntEnum
from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat

from wbc_suite.compiling import inner, record_type, struct
from wbc_suite.config_files import FrozenModel
from wbc_suite.typing import CompiledRecords, Indices, Matrix, Records, Vector

GRAVITY = 9.81
"""m/s^2."""


class Mode(IntEnum):
    """Whether feet are lifted."""

    STAND = 0
    STEP = 1


class GaitConfig(FrozenModel):
    """Numbers of a gait; those of your own derive from it.

    A subclass has `type: Literal[NAME] = NAME`, and floats or whether to do something:
    its planner reads them from the gait's `settings`.
    """

    type: str

    def misfit(self, soles: Sequence[bool]) -> str:
        """Return which feet it needs if these do not fit; told which are soles."""
        del soles
        return ""


class TrotConfig(GaitConfig):
    """A trot: diagonal pairs of feet swing in turn.

    Attributes:
        period: Duration of a cycle, s.
        duty: Part of the cycle for which a foot stands.
        apex: Height of a swinging foot over the ground, m.
        reach: Greatest distance of a foothold from under its hip, m.
        acceleration: Greatest change of the commanded velocity, m/s^2 and rad/s^2.
        margin: Distance of the capture point from the edge of the feet at which the
            robot steps by itself, m.
        speed: Speed of the centre of mass at which it does, m/s.
        recover: Whether it does.
    """

    type: Literal["trot"] = "trot"  # pyright: ignore[reportIncompatibleVariableOverride] - narrower
    period: PositiveFloat = 0.5
    duty: float = Field(default=0.5, gt=0.0, lt=1.0)
    apex: PositiveFloat = 0.07
    reach: PositiveFloat = 0.38
    acceleration: PositiveFloat = 1.0
    margin: NonNegativeFloat = 0.03
    speed: PositiveFloat = 0.25
    recover: bool = True

    def misfit(self, soles: Sequence[bool]) -> str:
        """Return that it needs four feet, if there are not four."""
        return (
            "" if len(soles) == 4 else f"a gait of type '{self.type}' needs four feet"
        )


class WalkConfig(GaitConfig):
    """A walk of two feet that tracks the divergent component of motion.

    Attributes:
        step: Duration of a step, s.
        shortest: Duration of the shortest step, s.
        double_support: Time for which both feet stand after a step, s.
        apex: Height of a swinging foot over the ground, m.
        narrowest: Least distance of the feet from each other, m.
        widest: Greatest distance to the side, m.
        forward: Longest step forward, m.
        backward: Longest step backward, m.
        acceleration: Greatest change of the commanded velocity, m/s^2 and rad/s^2.
        ahead: How far in front of the middle of the soles the centre of mass stands, m.
        lower: How much lower than at `ready` the centre of mass is carried, m.
        margin: Distance of the centre of pressure from the edges of soles, m.
        gain: Feedback on the divergent component of motion, 1/s.
        recover: Whether the robot steps by itself when the capture point leaves its
            soles.
    """

    type: Literal["walk"] = "walk"  # pyright: ignore[reportIncompatibleVariableOverride] - narrower
    step: PositiveFloat = 0.5
    shortest: PositiveFloat = 0.22
    double_support: PositiveFloat = 0.08
    apex: PositiveFloat = 0.05
    narrowest: PositiveFloat = 0.13
    widest: PositiveFloat = 0.55
    forward: PositiveFloat = 0.6
    backward: PositiveFloat = 0.4
    acceleration: PositiveFloat = 0.4
    ahead: float = 0.0
    lower: NonNegativeFloat = 0.02
    margin: NonNegativeFloat = 0.006
    gain: PositiveFloat = 4.0
    recover: bool = True

    def misfit(self, soles: Sequence[bool]) -> str:
        """Return that it needs two soles, if there are not two."""
        if list(soles) == [True, True]:
            return ""
        return (
            f"a gait of type '{self.type}' needs two feet, left and right, with a "
            "'sole' each: heel, toes, right, left, in m"
        )


def settings_of(config: GaitConfig) -> np.dtype[np.void]:
    """Return the fields of all configs; those that a config lacks are zero.

    Gaits whose configs add no field share the machine code of ours.
    """
    fields = {*TrotConfig.model_fields, *WalkConfig.model_fields}
    fields |= {*type(config).model_fields}
    return record_type(*((name, "f8") for name in sorted(fields - {"type"})))


STATE = record_type(
    ("mode", "i8"),  # `Mode`
    ("time", "f8"),  # s since the reset
    ("until", "f8"),  # time until which the robot steps without a command, s
    ("yaw", "f8"),  # heading, rad
    ("velocity", "f8", (3,)),  # forward, left (m/s), turn (rad/s)
    ("height", "f8"),  # centre of mass over the ground as commanded, m
    ("nominal_height", "f8"),  # the same at the reset, m
    ("ground", "f8"),  # height of the ground, m
    ("reference", "f8", (2,)),  # of the centre of mass, m
    ("phase", "f8"),  # trot: part of the cycle
    ("stance", "i8"),  # walk: the foot that stands, 0 left, 1 right
    ("since", "f8"),  # walk: time since the step began; trot: when it last stood, s
    ("duration", "f8"),  # walk: of this step, s
    ("shift", "f8"),  # walk: part of the way from standing to the first step
    ("waiting", "f8"),  # walk: time since then, s
    ("width", "f8"),  # walk: distance of the feet at the reset, m
    ("progress", "f8"),  # walk: part of the swing
    ("steps", "i8"),  # steps since the reset
)


@struct
class Measured(NamedTuple):
    """Where the robot is; world axes.

    Attributes:
        com: Centre of mass, m, shape (3,); on a slope see `control.contact.terms`.
        com_velocity: Its velocity, m/s, shape (3,).
        foot: Middle of the contact of each foot, m, shape (n, 3).
        foot_yaw: Heading of each foot, rad, shape (n,).
        slip: Horizontal speed of each foot, m/s, shape (n,).
        rise: Vertical velocity of each foot, m/s, shape (n,).
    """

    com: Vector
    com_velocity: Vector
    foot: Matrix
    foot_yaw: Vector
    slip: Vector
    rise: Vector


@struct
class Plan(NamedTuple):
    """What the planner asks for; world axes.

    Attributes:
        load: Part of the weight that each foot may carry, 0 for a swinging foot; 1 for
            any load, shape (n,).
        position: Position of swinging feet, m, shape (n, 3).
        velocity: Their velocity, m/s, shape (n, 3).
        acceleration: Their acceleration, m/s^2, shape (n, 3).
        yaw: Their heading, rad, shape (n,).
        com_acceleration: Acceleration of the centre of mass, m/s^2, shape (3,).
        zmp: Centre of pressure that it needs, m, shape (2,).
        footstep: Where the next foot lands, m, shape (2,).
        margin: Distance of the capture point from the edge of what the robot stands
            on, positive inside, m, shape (1,).
    """

    load: Vector
    position: Matrix
    velocity: Matrix
    acceleration: Matrix
    yaw: Vector
    com_acceleration: Vector
    zmp: Vector
    footstep: Vector
    margin: Vector


@struct
class Gait(NamedTuple):
    """Settings and state of a gait.

    Attributes:
        settings: Record of the numbers of its config, see `settings_of`, shape (1,).
        state: `STATE` record, shape (1,).
        sole: Edges of a sole about its middle: heel, toes, right, left, m, (n, 4).
        nominal: Feet about the centre of mass in heading axes, m, shape (n, 2).
        offset: Phase of each foot, shape (n,).
        lift: Where each foot was lifted, m, shape (n, 3).
        lift_yaw: Its heading then, rad, shape (n,).
        goal: Where it lands, m, shape (n, 2).
        swings: Whether it swings, shape (n,).
    """

    settings: Records
    state: Records
    sole: Matrix
    nominal: Matrix
    offset: Vector
    lift: Matrix
    lift_yaw: Vector
    goal: Matrix
    swings: Indices


def make_gait(config: GaitConfig, soles: Matrix) -> Gait:
    """Return a gait that has not begun.

    Args:
        config: Its numbers.
        soles: Edges of each foot about its middle: heel, toes, right, left, m, shape
            (n, 4); zero for points. A walk has the left foot first.
    """
    n = len(soles)
    settings = np.zeros(1, settings_of(config))
    for name in type(config).model_fields:
        if name != "type":
            settings[name] = getattr(config, name)
    return Gait(
        settings=settings,
        state=np.zeros(1, STATE),
        sole=np.array(soles, dtype=np.float64),
        nominal=np.zeros((n, 2)),
        offset=np.zeros(n),
        lift=np.zeros((n, 3)),
        lift_yaw=np.zeros(n),
        goal=np.zeros((n, 2)),
        swings=np.zeros(n, dtype=np.int64),
    )


def make_measured(n: int) -> Measured:
    """Return what a planner reads, for n feet, all zero."""
    feet = np.zeros((n, 3)), np.zeros(n), np.zeros(n), np.zeros(n)
    return Measured(np.zeros(3), np.zeros(3), *feet)


def make_plan(n: int) -> Plan:
    """Return what a planner writes, for n feet: all stand."""
    return Plan(
        np.ones(n),
        np.zeros((n, 3)),
        np.zeros((n, 3)),
        np.zeros((n, 3)),
        np.zeros(n),
        np.zeros(3),
        np.zeros(2),
        np.zeros(2),
        np.zeros(1),
    )


def begin_gait(gait: Gait, measured: Measured, yaw: float) -> None:
    """Stand still where the robot is; the stance becomes the nominal one.

    Args:
        gait: The gait.
        measured: Where the robot is.
        yaw: Its heading, rad.
    """
    state, feet = gait.state[0], measured.foot
    gait.state[:] = np.zeros(1, STATE)
    ground = float(feet[:, 2].mean())
    state["yaw"], state["ground"] = yaw, ground
    state["nominal_height"] = state["height"] = measured.com[2] - ground
    state["reference"] = measured.com[:2]
    state["duration"] = gait.settings["step"][0]
    R = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
    gait.nominal[:] = (feet[:, :2] - feet[:, :2].mean(axis=0)) @ R.T
    gait.offset[:] = np.where(gait.nominal[:, 0] * gait.nominal[:, 1] > 0.0, 0.0, 0.5)
    if len(feet) == 2:
        state["width"] = gait.nominal[0, 1] - gait.nominal[1, 1]
    gait.lift[:], gait.lift_yaw[:] = feet, measured.foot_yaw
    gait.swings[:] = 0


@inner
def approach_command(
    state: CompiledRecords, command: Vector, acceleration: float, dt: float
) -> bool:
    """Move velocity, heading and height towards a command; return if it asks to move.

    Args:
        state: `STATE` record.
        command: Forward, left (m/s), turn (rad/s), height above the nominal one (m).
        acceleration: Greatest change, m/s^2 and rad/s^2.
        dt: Time since the last call, s.
    """
    moving = False
    for i in range(3):
        most = acceleration * dt
        change = command[i] - state.velocity[i]
        state.velocity[i] += min(max(change, -most), most)
        moving = moving or abs(command[i]) > 1e-3
    change = state.nominal_height + command[3] - state.height
    state.height += min(max(change, -0.15 * dt), 0.15 * dt)
    state.time += dt
    return moving


@inner
def heading_axes(yaw: float) -> Matrix:
    """Return the horizontal axes of a heading as columns, shape (2, 2)."""
    R = np.empty((2, 2))
    R[0, 0] = R[1, 1] = np.cos(yaw)
    R[1, 0] = np.sin(yaw)
    R[0, 1] = -R[1, 0]
    return R
