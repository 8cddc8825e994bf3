"""What limits have in common: bounds of joints, or inequality rows."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from enum import IntEnum
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from wbc_suite.compiling import record_type
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.configuration import named_joints
from wbc_suite.qp.part import run_kernel
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


class RowLimit:
    """A limit `G dq <= h` of a fixed number of rows.

    A solution never violates it as long as one exists. A subclass sets `dim`, and
    writes `rows`, or names a `kernel` and its numbers, as the guide of QP stacks shows;
    `subject` and `kind` are for reports.

    A row with h < 0 is outside its limit. It leads back softly and may go no further
    out, so that other rows can still be kept.

    Attributes:
        kernel: What writes G and h, see `part`.
        dim: Number of rows.
        kind: What reports call the rows.
        unit: Unit of `G dq` and h.
        relax_speed: Speed of return, in the rows' unit per second, beyond which a row
            may go further out, so that other rows can lead back; infinity is never.
    """

    kernel: ClassVar[Any] = None
    dim: int
    kind: LimitKind = LimitKind.OTHER
    unit: str = "m"
    relax_speed: float = np.inf

    def bind(self, configuration: Configuration) -> None:
        """Resolve names in a model; called when a stack is built."""

    def own(self, configuration: Configuration) -> Vector:
        """Return the numbers that the kernel reads and may write, the limit's array."""
        return np.zeros(0)

    def rows(
        self, configuration: Configuration, dt: float, G: Matrix, h: Vector
    ) -> None:
        """Write G, shape (dim, nv), and h, shape (dim,), for a step of dt seconds.

        G is zero before the first call. Unused rows are 0 <= inf.
        """
        run_kernel(self, configuration.robot, self.own(configuration), dt, G, h)

    def reset(self) -> None:
        """Discard memory of earlier ticks; called by a stack's `reset`."""

    @property
    def memory(self) -> tuple[NDArray[Any], ...]:
        """Arrays of numbers of earlier ticks, views; by default there are none."""
        return ()

    def subject(self, row: int) -> object:
        """Return what a row of the last tick limits: a value that prints itself."""
        return f"{type(self).__name__}[{row}]"


Limit: TypeAlias = BoxLimit | RowLimit
"""What a stack takes as a limit."""


BOUND = record_type(
    ("q_index", "i8"),  # position index of the velocity, -1 where it has none
    ("q_lower", "f8"),  # lower position limit, rad or m, -inf where there is none
    ("q_upper", "f8"),  # upper position limit
    ("position_gain", "f8"),  # fraction of the distance to it that a step may cover
    ("v_max", "f8"),  # speed limit, rad/s or m/s, inf where there is none
    ("a_max", "f8"),  # acceleration limit, inf where there is none
    ("step_max", "f8", (2,)),  # greatest next steps down and up; inf: none
)
"""Limits of the joint of one velocity."""


class JointBounds(np.recarray[Any, np.dtype[np.record]]):  # pyright: ignore[reportIncompatibleVariableOverride]
    """Limits of joints, one entry per velocity, which a stack's limits fill in.

    Fields are those of `BOUND`; each is a view of shape (nv,).
    """

    q_index: Indices
    q_lower: Vector
    q_upper: Vector
    position_gain: Vector
    v_max: Vector
    a_max: Vector
    step_max: Matrix


def unlimited_bounds(configuration: Configuration) -> JointBounds:
    """Return infinite bounds."""
    bounds = np.zeros(configuration.nv, BOUND).view(JointBounds)
    bounds.q_index[:] = -1
    for _, joint in named_joints(configuration.model):
        if joint.nq == 1 and joint.nv == 1:
            bounds.q_index[joint.idx_v] = joint.idx_q
    bounds.q_lower[:] = -np.inf
    bounds.position_gain[:] = 1.0
    for values in (bounds.q_upper, bounds.v_max, bounds.a_max, bounds.step_max):
        values[:] = np.inf
    return bounds


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
