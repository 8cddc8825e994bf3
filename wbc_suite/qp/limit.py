"""What limits have in common: a box per joint, or inequality rows."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.configuration import named_joints
from wbc_suite.qp.bounds import LimitKind, merge_bounds
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["BoxLimit", "JointBounds", "Limit", "RowLimit"]


@dataclass(slots=True)
class JointBounds:
    """The box that limits fill in at binding time, one entry per velocity.

    Attributes:
        q_index: Position index of each velocity, -1 where positions are no vector.
        q_lower: Lower position limits, -inf where there is none.
        q_upper: Upper position limits.
        position_gain: Fraction of the distance to a limit that one step may cover.
        v_max: Speed limits, inf where there is none.
        a_max: Acceleration limits, inf where there is none.
    """

    q_index: Indices
    q_lower: Vector
    q_upper: Vector
    position_gain: float
    v_max: Vector
    a_max: Vector

    @classmethod
    def unlimited(cls, configuration: Configuration) -> "JointBounds":
        """Return bounds that bind nothing."""
        nv = configuration.nv
        q_index = np.full(nv, -1, dtype=np.int64)
        for _, joint in named_joints(configuration.model):
            if joint.nq == 1 and joint.nv == 1:
                q_index[joint.idx_v] = joint.idx_q
        return cls(
            q_index=q_index,
            q_lower=np.full(nv, -np.inf),
            q_upper=np.full(nv, np.inf),
            position_gain=1.0,
            v_max=np.full(nv, np.inf),
            a_max=np.full(nv, np.inf),
        )

    def without_acceleration(
        self, q: Vector, v_previous: Vector, dt: float, kinds: Indices
    ) -> tuple[Vector, Vector]:
        """Return the bounds of a step dq that may change speeds at once, shape (nv,).

        Args:
            q: Joint positions, shape (nq,).
            v_previous: Velocity of the last step, shape (nv,).
            dt: Duration of the step, s.
            kinds: Output: which limit set each lower and upper bound, shape (2, nv).
        """
        nv = len(self.v_max)
        lower, upper = np.empty(nv), np.empty(nv)
        merge_bounds(
            q,
            self.q_index,
            self.q_lower,
            self.q_upper,
            self.position_gain,
            self.v_max,
            v_previous,
            np.full(nv, np.inf),
            dt,
            lower,
            upper,
            *kinds,
        )
        return lower, upper


class Limit(ABC):  # noqa: B024, what a stack takes is either of the two below
    """A constraint that a solution never breaks as long as one exists."""


class BoxLimit(Limit):
    """A limit on single joints."""

    @abstractmethod
    def apply(self, configuration: Configuration, bounds: JointBounds) -> None:
        """Tighten the bounds; called once, when a stack is built."""


class RowLimit(Limit):
    """A limit `G dq <= h` of a fixed number of rows.

    Attributes:
        dim: Number of rows.
        kind: What its rows are called in reports.
        gives_way: Speed of return, in the rows' unit per second, beyond which a row may
            go further out, so that other rows can lead back; endless is never.
    """

    dim: int
    kind: LimitKind = LimitKind.SELF_COLLISION
    gives_way: float = np.inf

    @abstractmethod
    def bind(self, configuration: Configuration) -> None:
        """Resolve names in a model."""

    @abstractmethod
    def rows(
        self, configuration: Configuration, dt: float, G: Matrix, h: Vector
    ) -> None:
        """Write G, shape (dim, nv), and h, shape (dim,); unused rows are 0 <= inf."""

    def reset(self) -> None:
        """Forget how the robot moved; called by a stack's `reset`."""

    @abstractmethod
    def label(self, row: int) -> str:
        """Return in words what a row of the last tick limits."""
