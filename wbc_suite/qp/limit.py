"""What limits have in common: bounds of joints, or inequality rows."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from enum import IntEnum
from typing import Any, ClassVar, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from wbc_suite.compiling import by_address, compiled, inner, struct
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.configuration import named_joints
from wbc_suite.kinematics.forward import RobotArrays
from wbc_suite.qp.kernel import Kernel
from wbc_suite.typing import Indices, Matrix, Vector


class LimitKind(IntEnum):
    """What set a bound or a row."""

    NONE = 0
    POSITION = 1
    VELOCITY = 2
    ACCELERATION = 3
    SELF_COLLISION = 4
    EQUALITY = 5
    BALANCE = 6
    EFFORT = 7
    FLOOR = 8
    OTHER = 9
    """A limit of a user's own that names no kind."""
    OBSTACLE = 10
    TRACKING = 11
    """A joint that lags behind its command by as much as it may."""

    def __str__(self) -> str:
        """Return the name as reports print it: "self-collision"."""
        return self.name.lower().replace("_", "-")


class BoxLimit(ABC):
    """A limit on single joints, which a solution never violates."""

    @abstractmethod
    def apply(self, configuration: Configuration, bounds: "JointBounds") -> None:
        """Tighten the bounds in place; called once, when a stack is built."""


class RowLimit(ABC):
    """A limit `G dq <= h` of a fixed number of rows.

    A solution never violates it as long as one exists. A subclass sets `dim` and writes
    `rows`, as the guide of QP stacks shows; `subject` and `kind` are for reports.

    A row with h < 0 is outside its limit. It leads back softly and may go no further
    out, so that other rows can still be kept.

    Attributes:
        kernel: What writes the rows, see `kernel_of`.
        dim: Number of rows.
        kind: What reports call the rows.
        unit: Unit of `G dq` and h.
        relax_speed: Speed of return, in the rows' unit per second, beyond which a row
            may go further out, so that other rows can lead back; infinity is never.
    """

    kernel: ClassVar[Kernel] = Kernel.PYTHON
    dim: int
    kind: LimitKind = LimitKind.OTHER
    unit: str = "m"
    relax_speed: float = np.inf

    def bind(self, configuration: Configuration) -> None:  # noqa: B027, may be empty
        """Resolve names in a model; called when a stack is built."""

    @abstractmethod
    def rows(
        self, configuration: Configuration, dt: float, G: Matrix, h: Vector
    ) -> None:
        """Write G, shape (dim, nv), and h, shape (dim,), for a step of dt seconds.

        G is zero before the first call. Unused rows are 0 <= inf.
        """

    def reset(self) -> None:  # noqa: B027, may be empty
        """Discard memory of earlier ticks; called by a stack's `reset`."""

    @property
    def memory(self) -> tuple[NDArray[Any], ...]:
        """Arrays of numbers of earlier ticks, views; by default there are none."""
        return ()

    def subject(self, row: int) -> object:
        """Return what a row of the last tick limits: a value that prints itself."""
        return f"{type(self).__name__}[{row}]"


def write_rows(
    kernel: Any, robot: RobotArrays, arrays: Any, dt: float, G: Matrix, h: Vector
) -> None:
    """Let a kernel write rows by its address, as in ticks: it is compiled once."""
    _call(by_address(kernel, robot, arrays, dt, G, h), robot, arrays, dt, G, h)


@compiled
def _call(
    kernel: Any, robot: RobotArrays, arrays: Any, dt: float, G: Matrix, h: Vector
) -> None:
    kernel(robot, arrays, dt, G, h)


Limit: TypeAlias = BoxLimit | RowLimit
"""What a stack takes as a limit."""


@struct
class JointBounds(NamedTuple):
    """Limits of joints, one entry per velocity, which a stack's limits fill in."""

    q_index: Indices  # position index of each velocity, -1 where it has none
    q_lower: Vector  # lower position limits, -inf where there is none
    q_upper: Vector  # upper position limits
    position_gain: Vector  # fraction of the distance to a limit that a step may cover
    v_max: Vector  # speed limits, inf where there is none
    a_max: Vector  # acceleration limits, inf where there is none
    step_max: Matrix  # (2, nv), greatest next steps down and up; inf: none


def unlimited_bounds(configuration: Configuration) -> JointBounds:
    """Return infinite bounds."""
    nv = configuration.nv
    q_index = np.full(nv, -1, dtype=np.int64)
    for _, joint in named_joints(configuration.model):
        if joint.nq == 1 and joint.nv == 1:
            q_index[joint.idx_v] = joint.idx_q
    infinite, step_max = np.full(nv, np.inf), np.full((2, nv), np.inf)
    none = infinite.copy(), infinite.copy()
    return JointBounds(q_index, -infinite, infinite, np.ones(nv), *none, step_max)


def joint_values(
    configuration: Configuration,
    values: float | Vector,
    joints: Mapping[str, float],
    *,
    root_linear: float = 0.0,
    root_angular: float = 0.0,
) -> Vector:
    """Return one value per velocity, those of the root and of named joints their own.

    Raises:
        UnknownNameError: If a named joint is not in the model.
    """
    found = np.full(configuration.nv, values, dtype=np.float64)
    found[configuration.root_linear] = root_linear
    found[configuration.root_angular] = root_angular
    for name, value in joints.items():
        joint = configuration.model.joints[configuration.joint_id(name)]
        found[joint.idx_v : joint.idx_v + joint.nv] = value
    return found


def joint_movers(configuration: Configuration) -> Matrix:
    """Return 1 where a velocity moves a joint, else 0, shape (njoints, nv)."""
    moves = np.zeros((len(configuration.model.joints), configuration.nv))
    for joint, row in enumerate(moves):
        row[configuration.joint_support(joint)] = 1.0
    return moves


@compiled
def merge_bounds(
    bounds: JointBounds,
    q: Vector,
    v_previous: Vector,
    dt: float,
    lower: Vector,
    upper: Vector,
    kinds: Indices,
) -> None:
    """Write bounds of the step dq that are never empty.

    The acceleration window `v_previous dt -+ a dt^2` is clipped into the position
    interval, which `step_max` narrows, the result into the velocity interval
    `-+ v dt`. Clipping an interval into another keeps it non-empty, and is the
    intersection where there is one: velocity wins over position, position over
    acceleration. A joint outside a limit therefore returns at its greatest speed.

    `kinds`, shape (2 nv,), gets the `LimitKind` that set each lower, then each upper
    bound.
    """
    nv, q_index, gain = lower.shape[0], bounds.q_index, bounds.position_gain
    q_lower, q_upper = bounds.q_lower, bounds.q_upper
    v_max, a_max, step_max = bounds.v_max, bounds.a_max, bounds.step_max
    for i in range(nv):
        window = a_max[i] * dt * dt
        lo, hi = v_previous[i] * dt - window, v_previous[i] * dt + window
        lo_kind = hi_kind = LimitKind.ACCELERATION.value
        k = q_index[i]
        if k >= 0:
            bottom = -braking_step(q[k] - q_lower[i], gain[i], a_max[i], dt)
            top = braking_step(q_upper[i] - q[k], gain[i], a_max[i], dt)
            bottom_kind = top_kind = LimitKind.POSITION.value
            if -step_max[0, i] > bottom:
                bottom_kind = LimitKind.TRACKING.value
                bottom = min(-step_max[0, i], top)
            if step_max[1, i] < top:
                top_kind = LimitKind.TRACKING.value
                top = max(step_max[1, i], bottom)
            if lo < bottom or lo > top:
                lo_kind = bottom_kind if lo < bottom else top_kind
                lo = min(max(lo, bottom), top)
            if hi < bottom or hi > top:
                hi_kind = bottom_kind if hi < bottom else top_kind
                hi = min(max(hi, bottom), top)
        step = v_max[i] * dt
        if lo < -step or lo > step:
            lo, lo_kind = min(max(lo, -step), step), LimitKind.VELOCITY.value
        if hi < -step or hi > step:
            hi, hi_kind = min(max(hi, -step), step), LimitKind.VELOCITY.value
        lower[i], upper[i] = lo, hi
        kinds[i], kinds[nv + i] = lo_kind, hi_kind


@inner
def braking_step(distance: float, gain: float, a: float, dt: float) -> float:
    """Return the greatest step towards a limit that is a distance away.

    It is a fraction of the distance, and no more than what can still be braked in the
    distance d: `v dt + v^2 / (2 a) = d`, the discrete form of `v = sqrt(2 a d)`.
    A negative distance is outside the limit: the step leads back to it.
    """
    if distance < 0.0:
        return distance
    step = gain * distance
    if np.isfinite(a) and np.isfinite(distance):
        step = min(step, dt * a * (np.sqrt(dt * dt + 2.0 * distance / a) - dt))
    return step
