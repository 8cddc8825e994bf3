"""The part of Ruckig's interface that is used here; the wheel ships no stubs."""

from collections.abc import Sequence
from enum import Enum

from numpy.typing import ArrayLike

class RuckigError(Exception): ...

class Result(Enum):
    Working = 0
    Finished = 1

class ControlInterface(Enum):
    Position = 0
    Velocity = 1

class Synchronization(Enum):
    Time = 0
    No = 3

class InputParameter:
    current_position: ArrayLike
    current_velocity: ArrayLike
    target_position: ArrayLike
    target_velocity: ArrayLike
    max_velocity: ArrayLike
    max_acceleration: ArrayLike
    minimum_duration: float | None
    control_interface: ControlInterface
    synchronization: Synchronization
    def __init__(self, dofs: int) -> None: ...

class Trajectory:
    duration: float
    def __init__(self, dofs: int) -> None: ...
    def at_time(
        self, time: float
    ) -> tuple[Sequence[float], Sequence[float], Sequence[float]]: ...

class Ruckig:
    def __init__(self, dofs: int) -> None: ...
    def calculate(self, input: InputParameter, trajectory: Trajectory) -> Result: ...
