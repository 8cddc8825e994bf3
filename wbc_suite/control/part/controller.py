"""What a controller of one part of a robot is."""

from typing import Protocol

from wbc_suite.control.action import ActionPart
from wbc_suite.control.part.law import Law
from wbc_suite.control.state import RobotState
from wbc_suite.typing import Vector

__all__ = ["WHENEVER", "PartController"]

WHENEVER = 1 << 30
"""Physics steps; longer than any action lasts."""


class PartController(Protocol):
    """Turns slices of the action into the target of a law."""

    @property
    def slices(self) -> tuple[ActionPart, ...]:
        """What it wants of the action, in order."""
        ...

    @property
    def law(self) -> Law:
        """What follows the target."""
        ...

    def reset(self, state: RobotState) -> None:
        """Hold the part where it is."""
        ...

    def set_goal(self, values: Vector, period: float) -> None:
        """Take the values of all slices; the next ones come in a period, s."""
        ...

    def prepare(self, state: RobotState) -> int:
        """Do what is due now; return for how many physics steps that is enough."""
        ...

    @property
    def hold_action(self) -> Vector:
        """Values that keep the present goal."""
        ...
