"""The interface between a whole-body controller and an inverse-kinematics solver."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, TypeAlias

import mujoco

from wbc_suite.control.ik.torque_limiter import TorqueArrays
from wbc_suite.control.law.joint_laws import JointLaw
from wbc_suite.control.law.spline_reference import SplineReference
from wbc_suite.control.memory import Parts
from wbc_suite.control.reasons import Reason
from wbc_suite.qp import SelfCollisionLimit
from wbc_suite.qp.tick import TickArrays
from wbc_suite.typing import Indices, Matrix, Vector

Explanation: TypeAlias = Callable[[], Mapping[str, Sequence[Reason]]]


class IkStep(NamedTuple):
    """The answer to one solve; a named tuple, since one is made in every tick.

    Attributes:
        v: Velocity, Pinocchio's conventions, shape (nv,).
        limits: Returns what holds joints back.
        ok: Whether the problem was solved as stated.
        explain: Returns at any later time what holds each frame back, the most
            important first. None where only `limits` are known.
    """

    v: Vector
    limits: Callable[[], tuple[Reason, ...]] = tuple
    ok: bool = True
    explain: Explanation | None = None


class StackArrays(NamedTuple):
    """A stack of tasks for ticks of the control loop.

    Attributes:
        qp: The argument of `solve_tick`.
        target: First number of the target of each frame's task, then of the posture's,
            see `TaskStack.target_of`, shape (n + 1,).
        motors: The argument of `motors_suffice`.
    """

    qp: TickArrays
    target: Indices
    motors: TorqueArrays


class IkBackend(ABC):
    """Differential inverse kinematics of one robot at its commanded configuration.

    Its owner moves that configuration. Configurations and velocities are Pinocchio's,
    of the reduced robot.

    Attributes:
        v: Velocity of the last tick, shape (nv,).
        self_collision: The limit that keeps links apart, if there is one.
    """

    v: Vector
    self_collision: SelfCollisionLimit | None = None

    @abstractmethod
    def reset(self) -> None:
        """Discard the state of earlier ticks; held frames stay where they are."""

    @property
    def memory(self) -> Parts:
        """What outlives a tick; views."""
        return (self.v,)

    @abstractmethod
    def resume(self) -> None:
        """Go on from values that were written into `memory`, after a reset."""

    @abstractmethod
    def set_targets(self, targets: Matrix) -> None:
        """Set the targets of all controlled frames: poses, [R p] rows, shape (n, 12).

        Only the position counts for the centre of mass.
        """

    @abstractmethod
    def set_posture(self, q: Vector) -> None:
        """Set the posture to prefer."""

    @abstractmethod
    def solve(self, dt: float, left: tuple[int, int] | None = None) -> None:
        """Find the velocity towards the targets for dt seconds; never raises.

        `left` is a `TickStatus` and a level where the loop has begun this tick.
        """

    @abstractmethod
    def solve_posture(self, posture: Vector, dt: float) -> None:
        """Find the velocity that takes joints to a configuration within dt.

        Limits and held frames are kept, controlled frames are left out.
        """

    @abstractmethod
    def last_step(self, *, in_loop: bool) -> IkStep:
        """Return the answer of the last tick, which the control loop has solved or not.

        After a reset it is to stand still.
        """

    def loop_arrays(self) -> StackArrays | None:
        """Return what ticks in the control loop need; None if Python has to solve."""
        return None

    @abstractmethod
    def limit_steps(
        self, reference: SplineReference, law: JointLaw, data: mujoco.MjData
    ) -> None:
        """Limit the next step as `command_lead.limit_steps` does."""
