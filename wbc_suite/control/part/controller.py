"""The base class of controllers that drive one part of a robot."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, TypeVar

import pinocchio as pin

from wbc_suite.control.action import ActionPart
from wbc_suite.control.contact.standing import Standing
from wbc_suite.control.law.law import Law
from wbc_suite.control.memory import Parts
from wbc_suite.control.part.ik_tick import HandIk
from wbc_suite.control.robot_parts import RobotPart
from wbc_suite.control.state import RobotState
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Vector

UNTIL_NEXT_ACTION = 1 << 30
"""Physics steps; more than an action takes."""


@dataclass(frozen=True, kw_only=True, slots=True)
class PoseInput:
    """How targets in the world become values of a slice; devices drive hands by it.

    Attributes:
        action: The slice; its kind is `POSE`, `POSITION` or `ORIENTATION`.
        body: Body of the simulation that the frame is fixed to.
        measure: Returns the frame's pose in the world.
        encode: Returns the values of the slice for a target in the world.
        decode: Returns the target of values of the slice in the present state.
        reference: Returns the pose of the body that goals move with; None where they
            stay in the world.
    """

    action: ActionPart
    body: int
    measure: Callable[[], pin.SE3]
    encode: Callable[[pin.SE3], Vector]
    decode: Callable[[Vector], pin.SE3]
    reference: Callable[[], pin.SE3] | None = None


LawType = TypeVar("LawType", bound=Law)


class PartController(ABC, Generic[LawType]):
    """Turns its slices of the action into the references of a law.

    A subclass is made by `Controller(part, config, state)` and registered by
    `register_part_controller`. Its constructor sets `slices`, what it reads from the
    action, and `law`, which computes accelerations or commands of joints at every step.

    Attributes:
        needs_hand: Whether the part must end in a hand.
        drives_base: Whether it drives a base on wheels, which no other may.
        holds_root: Whether it keeps a robot with a free root from falling.
        standing: Finds the contact forces of such a robot.
    """

    needs_hand: ClassVar[bool] = False
    drives_base: ClassVar[bool] = False
    holds_root: ClassVar[bool] = False
    standing: Standing | None = None
    slices: tuple[ActionPart, ...]
    law: LawType

    @classmethod
    def check(cls, config: Any, part: RobotPart, robot: RobotDescription) -> None:
        """Raise ConfigError if a config does not fit a part; by default any does."""
        return

    @property
    @abstractmethod
    def hold_action(self) -> Vector:
        """Values of its slices that keep the present goal."""

    @abstractmethod
    def reset(self, state: RobotState) -> None:
        """Hold the part where it is."""

    @abstractmethod
    def set_goal(self, values: Vector, period: float) -> None:
        """Take the values of all slices; the next ones come after a period, s."""

    @property
    def memory(self) -> Parts:
        """Its arrays that outlive an action, but those of its law; views.

        States of environments hold their values. By default there are none.
        """
        return ()

    def resume(self, state: RobotState) -> None:
        """Go on from values that were written into `memory`, after a reset."""

    def prepare(self, state: RobotState) -> int:
        """Do what is due now; return for how many physics steps that is enough."""
        return UNTIL_NEXT_ACTION

    def loop_tick(self) -> HandIk | None:
        """Return the tick that the control loop runs for it; by default there is none.

        Called once the law is in the loop's table.
        """
        return None

    def finish_tick(self) -> None:
        """Finish a tick that the loop has begun, if there is one."""

    def pose_input(self) -> PoseInput | None:
        """Return how to send the part's hand to a pose, if the action can."""
        return None

    def report(self, state: RobotState) -> dict[str, Any] | None:
        """Return the entry in `info["ik"]["frames"]` of a part that has one."""
        return None
