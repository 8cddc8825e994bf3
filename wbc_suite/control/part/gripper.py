"""Grippers: one number per synergy moves joints together from open to closed."""

from collections.abc import Sequence

import numpy as np

from wbc_suite.control.action import ActionPart
from wbc_suite.control.part.config import GripConfig
from wbc_suite.control.part.controller import WHENEVER
from wbc_suite.control.part.gripper_width import OpeningTable
from wbc_suite.control.part.joint_step import grip
from wbc_suite.control.part.law import ServoLaw
from wbc_suite.control.state import RobotState
from wbc_suite.errors import ConfigError
from wbc_suite.robot.parts import Synergy
from wbc_suite.typing import Indices, Vector

__all__ = ["GripperController"]


class GripperController:
    """Set points of a gripper's servos from its synergies.

    The action has one value per synergy, -1 open to 1 closed:
    `q* = open + (a + 1) / 2 (closed - open)`, the set point of the joint's servo. With
    the input `width` it is the width between the fingers of a parallel gripper.

    Args:
        name: Name of the gripper, which is the name of its action slice.
        synergies: Its synergies.
        state: The robot in the simulation.
        config: Meaning of the input, and its speed.
        grasp: Frame between the fingers; needed for widths.

    Attributes:
        slices: The action slice.
        law: The servos' set points.
        goal: Present action, shape (number of synergies,).

    Raises:
        ConfigError: If widths are asked for, and it has no two fingers opposite each
            other.
    """

    def __init__(
        self,
        name: str,
        synergies: Sequence[Synergy],
        state: RobotState,
        config: GripConfig | None = None,
        grasp: str | None = None,
    ) -> None:
        self.name, self.config = name, config or GripConfig()
        count = len(synergies)
        self._table: OpeningTable | None = None
        if self.config.input == "width":
            if count != 1 or grasp is None:
                raise ConfigError(
                    f"key 'input': '{name}' has {count} synergies; 'width' is for "
                    "parallel grippers, which have one. Use 'synergy'."
                )
            self._table = OpeningTable(synergies[0], grasp, state)
        self.slices = (self._part(synergies),)
        driven = [
            (k, joint)
            for k, synergy in enumerate(synergies)
            for joint in synergy.open
            if joint in state.actuators
        ]
        self.law = ServoLaw(state, [joint for _, joint in driven])
        self._synergy: Indices = np.array([k for k, _ in driven], dtype=np.int64)
        self._open = np.array([synergies[k].open[j] for k, j in driven])
        self._span = np.array([synergies[k].closed[j] for k, j in driven]) - self._open
        self._leading = [
            int(np.flatnonzero(self._synergy == k)[0]) for k in range(count)
        ]
        self.goal: Vector = np.zeros(count)

    def reset(self, state: RobotState) -> None:
        """Take the present opening as the goal."""
        lead = self._leading
        q = state.data.qpos[self.law.drives["qpos"][lead]]
        span = np.where(self._span[lead] == 0.0, np.inf, self._span[lead])
        closed = (q - self._open[lead]) / span
        command = np.clip(2.0 * closed - 1.0, -1.0, 1.0)
        if self._table is not None:
            self.goal[:] = self._table.width(float(command[0]))
        else:
            self.goal[:] = command
        self.law.aim(self._set_points(command))

    def set_goal(self, values: Vector, period: float) -> None:
        """Take the slice's values, shape (number of synergies,)."""
        self.goal[:] = values
        command = self.goal
        if self._table is not None:
            command = np.array([self._table.command(float(values[0]))])
        if self.config.speed is None:
            law = self.law
            grip(law.record, law.drives, command, self._synergy, self._open, self._span)
        else:
            duration = self._duration(command, self.config.speed)
            self.law.move(self._set_points(command), duration)

    def prepare(self, state: RobotState) -> int:
        """Do nothing: servos do the rest."""
        return WHENEVER

    @property
    def hold_action(self) -> Vector:
        """The present goal."""
        return self.goal.copy()

    def _set_points(self, command: Vector) -> Vector:
        """Return set points of the joints for commands of the synergies."""
        closed = 0.5 * (command[self._synergy] + 1.0)
        return self._open + closed * self._span

    def _duration(self, command: Vector, speed: float) -> float:
        """Return how long the set points take from where they are, s."""
        now = (self.law.target()[0] - self._open) / np.where(
            self._span == 0.0, np.inf, self._span
        )
        before = 2.0 * now[self._leading] - 1.0
        way = float(np.abs(command - before).max())
        if self._table is not None:
            way = abs(
                self._table.width(float(command[0]))
                - self._table.width(float(before[0]))
            )
        return way / speed

    def _part(self, synergies: Sequence[Synergy]) -> ActionPart:
        count = len(synergies)
        labels = tuple(s.name for s in synergies)
        units = ("-1 open .. 1 closed",) * count
        low, high = (-1.0,) * count, (1.0,) * count
        if self._table is not None:
            labels, units = ("width",), ("m",)
            low, high = (self._table.least,), (self._table.greatest,)
        return ActionPart(
            name=self.name,
            kind="gripper",
            labels=labels,
            units=units,
            low=low,
            high=high,
        )
