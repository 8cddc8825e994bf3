"""What the law of whole-body inverse dynamics reads and writes."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from wbc_suite.compiling import (
    as_argument,
    by_address,
    compiled,
    plain,
    record_type,
    struct,
)
from wbc_suite.control.memory import Parts
from wbc_suite.locomotion.gait import Gait, Measured, Plan, make_measured, make_plan
from wbc_suite.locomotion.gait_registry import Planner
from wbc_suite.qp.active_set import QpArrays, make_qp_arrays
from wbc_suite.typing import Indices, Matrix, Records, Vector


class QpStage(IntEnum):
    """Where a tick is."""

    WRITTEN = 0
    """Not begun: the last answer is written."""
    SOLVED = 1
    UNSOLVED = 2
    """The active set is not found: another solver has to act."""


EDGES = 4
"""Edges of a friction pyramid."""

STATE = record_type(
    ("is_free", "i8"),  # 1: the root is free, and the robot stands on its feet
    ("root_qpos", "i8"),  # index of the free root in qpos
    ("root_dof", "i8"),  # and in qvel
    ("body", "i8"),  # its link
    ("mass", "f8"),  # kg; as of the last tick
    ("friction", "f8"),  # coefficient
    ("dt", "f8"),  # s between two steps of the loop
    ("trust", "f8"),  # part of measured velocities' errors corrected in a step
    ("stage", "i8"),  # `QpStage`
    ("ticks", "i8"),
    ("unsolved", "i8"),  # ticks whose active set was not found
    ("fell", "f8"),  # time of the fall, s since the reset; negative before
    ("fell_by_tilt", "i8"),  # 1: its tilt told it, 0: its height
    ("tilt", "f8"),  # of the trunk then, rad
    ("drop", "f8"),  # height that it had lost then, m
    ("trunk_height", "f8"),  # of the trunk over the ground at the reset, m
    ("hand_frame", "i8"),  # 1: goals of hands are given in the heading frame
    ("tracks", "i8"),  # 1: the robot tracks a motion, see `Tracked`
    ("glides", "i8"),  # 1: feet are wheels, which may move over the ground
    ("stiffness", "f8", (2,)),  # of its position and attitude, 1/s^2
    ("com_weight", "f8"),  # of the centre of mass that tracks
    ("root_weight", "f8", (2,)),  # of position and attitude of the root that tracks
)


_REMEMBERED = ("mass", "ticks", "unsolved", "trunk_height")
_FALL = ("fell", "fell_by_tilt", "tilt", "drop")
"""Fields of the state that outlive a tick."""


@compiled
def plan_nothing(
    gait: Gait, measured: Measured, command: Vector, dt: float, plan: Plan
) -> None:
    """Be the planner of a robot that does not step."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Foot:
    """A foot: a sole, or a ball.

    Attributes:
        site: Its site in the simulation.
        middle: Middle of the sole in the site's axes, m, shape (3,); for a ball the way
            to its lowest point, world axes.
        sole: Edges of a sole about its middle: heel, toes, right, left, m; None for a
            ball.
        rolls: Whether a sole may turn about its x axis.
    """

    site: int
    middle: Vector
    sole: tuple[float, float, float, float] | None = None
    rolls: bool = False

    @property
    def corners(self) -> Matrix:
        """Points in contact about the middle, m, shape (k, 2)."""
        if self.sole is None:
            return np.zeros((1, 2))
        heel, toes, right, left = self.sole
        return np.array([(x, y) for x in (heel, toes) for y in (right, left)])


@dataclass(frozen=True, kw_only=True, slots=True)
class Limits:
    """Limits of the joints, shape (n,) each; units rad or m, s, N m or N."""

    low: Vector
    high: Vector
    velocity: Vector
    torque_low: Vector
    torque_high: Vector


@struct
class Terms(NamedTuple):
    """Terms of the equations of motion, M a + h = S tau + J^T f.

    Columns are the six of the root in MuJoCo's velocity axes, then n joints.

    Attributes:
        M: Inertia, shape (6 + n, 6 + n).
        h: Bias less passive forces, shape (6 + n,).
        v: Velocity as filtered, shape (6 + n,).
        a: Accelerations of the answer, shape (6 + n,).
        B: Generalised force of each pyramid edge, shape (edges, 6 + n).
        root: [X | x] with a_root = X y + x, shape (6, ny + 1).
        J: Jacobian of a frame, linear then angular, world axes, shape (6, 6 + n).
        velocity: J v, shape (6,).
        drift: J' v, shape (6,).
        com: Centre of mass of the robot without what it holds, m, shape (3,).
        spin: Angular momentum about it, kg m^2/s, shape (3,).
        held: Force and moment about it of what hands hold, N and N m, shape (6,).
    """

    M: Matrix
    h: Vector
    v: Vector
    a: Vector
    B: Matrix
    root: Matrix
    J: Matrix
    velocity: Vector
    drift: Vector
    com: Vector
    spin: Vector
    held: Vector


@struct
class Tracked(NamedTuple):
    """A motion that a robot on its feet tracks: cubic in the time since it was set.

    Attributes:
        joints: Position, velocity, acceleration and jerk of joints, shape (4, n).
        start: Where the root starts: position, quaternion xyzw, shape (7 or more,).
        root: Offset, velocity, acceleration and jerk of the root from there, linear
            then angular, in its own axes, shape (4, 6).
        since: Time since the motion was set, s, shape (1,).
        wanted: Output: acceleration of the root in MuJoCo's axes, shape (6,).
    """

    joints: Matrix
    start: Vector
    root: Matrix
    since: Vector
    wanted: Vector


@struct
class WholeBodyDynamics(NamedTuple):
    """Robot, tasks and QP of whole-body inverse dynamics.

    Attributes:
        state: `STATE` record, shape (1,).
        dofs: Degrees of freedom of root and joints, shape (6 + n,); -1 for those of a
            root that is not free, whose columns stay zero.
        qpos: Index of each joint in qpos, shape (n,).
        place: Column of each degree of freedom of the scene, -1 for others, (nv,).
        terms: Terms of the equations of motion.
        site: Site of each foot, shape (f,).
        middle: See `Foot`, shape (f, 3).
        is_sole: Whether a foot is a sole, shape (f,).
        rolls: Whether it may turn about its x axis, shape (f,).
        first_edge: First pyramid edge of each foot, and the end, shape (f + 1,).
        corner: Points in contact about the middle of their foot, m, shape (points, 2).
        hand: Site of each hand, shape (h,).
        goal: Goals of hands as they are given, rows [R p], shape (h, 12).
        start: Where their references start, shape (h, 12).
        reference: Where their references are, shape (h, 12).
        travel: Time since the start, and of the way to the goal, s, shape (h, 2).
        is_arm: Whether a joint moves this hand and no other hand or foot, (h, n).
        hand_weight: Weights of position and orientation, shape (h, 2).
        load: Observed wrench on each hand, N and N m, world axes, shape (h, 6).
        upright: Bodies that stay upright, shape (u,).
        upright_pose: Their rotations in heading axes at the reset, shape (u, 9).
        upright_weight: Their weights, shape (u,).
        posture: Positions that joints return to, rad or m, shape (n,).
        posture_weight: Weight of each joint, shape (n,).
        follows: Joints that follow what other laws ask for instead, shape (n,).
        limits: Position low and high, velocity, torque low and high, shape (5, n).
        command: Forward, left (m/s), turn (rad/s), height (m), shape (4,).
        torque: Torques of contact forces and loads at the joints, J^T f, shape (n,).
        last_velocity: Velocity as measured at the last tick, shape (6 + n,).
        planner: Says which feet stand and swing; `by_address` of a gait's kernel.
        gait: Its numbers and state.
        measured: What its planner reads.
        plan: What it writes.
        tracked: The motion that is tracked without steps, if any is.
        qp: The QP in y = (edges, accelerations of joints).
    """

    state: Records
    dofs: Indices
    qpos: Indices
    place: Indices
    terms: Terms
    site: Indices
    middle: Matrix
    is_sole: Indices
    rolls: Indices
    first_edge: Indices
    corner: Matrix
    hand: Indices
    goal: Matrix
    start: Matrix
    reference: Matrix
    travel: Matrix
    is_arm: Indices
    hand_weight: Matrix
    load: Matrix
    upright: Indices
    upright_pose: Matrix
    upright_weight: Vector
    posture: Vector
    posture_weight: Vector
    follows: Indices
    limits: Matrix
    command: Vector
    torque: Vector
    last_velocity: Vector
    planner: Planner
    gait: Gait
    measured: Measured
    plan: Plan
    tracked: Tracked
    qp: QpArrays


def make_dynamics(
    *,
    feet: Sequence[Foot],
    gait: Gait,
    planner: Planner = plan_nothing,
    qpos: Indices,
    dofs: Indices,
    nv: int,
    hands: Indices,
    is_arm: Indices,
    hand_weight: Matrix,
    goal: Matrix,
    upright: Indices,
    upright_weight: Vector,
    posture_weight: Vector,
    limits: Limits,
    follows: Indices | None = None,
    tracked: Tracked | None = None,
) -> WholeBodyDynamics:
    """Return the arrays of a robot; see `WholeBodyDynamics`."""
    n, f, h, u = len(qpos), len(feet), len(hands), len(upright)
    points = [len(foot.corners) for foot in feet]
    edges = EDGES * sum(points)
    rows = sum(6 if foot.sole else 3 for foot in feet) + 3 * u + 6 * h
    rows += 6 * (int(dofs[0] >= 0) + int(tracked is not None))
    return WholeBodyDynamics(
        state=_make_state(is_free=bool(dofs[0] >= 0)),
        dofs=np.array(dofs, dtype=np.int64),
        qpos=np.array(qpos, dtype=np.int64),
        place=_columns(dofs, nv),
        terms=_make_terms(n, edges),
        site=np.array([foot.site for foot in feet], dtype=np.int64),
        middle=np.array([foot.middle for foot in feet]).reshape(-1, 3),
        is_sole=np.array([foot.sole is not None for foot in feet], dtype=np.int64),
        rolls=np.array([foot.rolls for foot in feet], dtype=np.int64),
        first_edge=EDGES * np.cumsum([0, *points], dtype=np.int64),
        corner=np.concatenate([np.zeros((0, 2)), *(foot.corners for foot in feet)]),
        hand=np.array(hands, dtype=np.int64),
        goal=goal,
        start=np.zeros((h, 12)),
        reference=np.zeros((h, 12)),
        travel=np.ones((h, 2)),
        is_arm=is_arm,
        hand_weight=hand_weight,
        load=np.zeros((h, 6)),
        upright=np.array(upright, dtype=np.int64),
        upright_pose=np.zeros((u, 9)),
        upright_weight=upright_weight,
        posture=np.zeros(n),
        posture_weight=posture_weight,
        follows=np.zeros(n, dtype=np.int64) if follows is None else follows,
        limits=np.array([getattr(limits, name) for name in Limits.__slots__]),
        command=np.zeros(4),
        torque=np.zeros(n),
        last_velocity=np.zeros(6 + n),
        planner=_planner(planner, gait, feet=f),
        gait=gait,
        measured=make_measured(f),
        plan=make_plan(f),
        tracked=tracked or still_motion(np.zeros(7), np.zeros(n)),
        qp=_make_qp(rows, edges, n),
    )


def memory_of(body: WholeBodyDynamics) -> Parts:
    """Return what outlives a tick, but goals of hands and a motion; views."""
    gait, state, terms = body.gait, body.state, body.terms
    return (
        *(state[name] for name in (*_REMEMBERED, *_FALL)),
        *(gait.state[name] for name in gait.state.dtype.names or ()),
        *(gait.nominal, gait.offset, gait.lift, gait.lift_yaw, gait.goal, gait.swings),
        *(terms.v, terms.a, terms.com, body.last_velocity, body.load, body.torque),
        *(body.start, body.reference, body.travel, body.command),
        *(body.posture, body.upright_pose),
        *(body.plan.load, body.plan.margin, body.plan.footstep, body.qp.side),
    )


def _planner(planner: Planner, gait: Gait, *, feet: int) -> Planner:
    """Return a planner as the loop calls it, the same type for all of them."""
    values = gait, make_measured(feet), np.zeros(4), 0.0, make_plan(feet)
    arguments = (as_argument(x) if isinstance(x, tuple) else x for x in values)
    return by_address(planner, *arguments)


def _make_state(*, is_free: bool) -> Records:
    state = np.zeros(1, STATE)
    state["is_free"] = is_free
    return state


def _make_qp(rows: int, edges: int, n: int) -> QpArrays:
    W, diagonal = np.zeros((rows, edges + n)), np.zeros((2, edges + n))
    return make_qp_arrays(W, np.zeros(rows), diagonal, np.zeros(1), inequalities=2 * n)


def _columns(dofs: Indices, nv: int) -> Indices:
    """Return the column of each degree of freedom of the scene, or -1, shape (nv,)."""
    place = np.full(nv, -1, dtype=np.int64)
    own = np.flatnonzero(dofs >= 0)
    place[dofs[own]] = own
    return place


def still_motion(start: Vector, joints: Vector) -> Tracked:
    """Return a motion that stays where it starts.

    Args:
        start: Position and quaternion xyzw of the root, shape (7,).
        joints: Positions of joints, shape (n,).
    """
    motion = np.zeros((4, len(joints)))
    motion[0] = joints
    return Tracked(motion, start.copy(), np.zeros((4, 6)), np.zeros(1), np.zeros(6))


def for_plain_python(body: WholeBodyDynamics) -> WholeBodyDynamics:
    """Return the same arrays, with a planner that is plain Python."""
    return body._replace(planner=plain(body.planner))


def _make_terms(n: int, edges: int) -> Terms:
    size = 6 + n
    return Terms(
        M=np.zeros((size, size)),
        h=np.zeros(size),
        v=np.zeros(size),
        a=np.zeros(size),
        B=np.zeros((edges, size)),
        root=np.zeros((6, edges + n + 1)),
        J=np.zeros((6, size)),
        velocity=np.zeros(6),
        drift=np.zeros(6),
        com=np.zeros(3),
        spin=np.zeros(3),
        held=np.zeros(6),
    )
