"""Grippers: one number per synergy moves joints together from open to closed."""

from collections.abc import Sequence

import numpy as np

from wbc_suite.control.action import ActionPart
from wbc_suite.control.state import RobotState
from wbc_suite.robot.parts import Synergy
from wbc_suite.typing import Indices, Vector

__all__ = ["GripperController"]


class GripperController:
    """Set points of a gripper's servos from its synergies.

    The action has one value per synergy, -1 open to 1 closed:
    `q* = open + (a + 1) / 2 (closed - open)`, the set point of the joint's servo.

    Args:
        name: Name of the gripper, which is the name of its action slice.
        synergies: Its synergies.
        state: The robot in the simulation.

    Attributes:
        part: The action slice.
        joints: The driven joints.
        outputs: Places of the driven joints among the robot's actuators.
        goal: Present action, shape (number of synergies,).
    """

    def __init__(
        self, name: str, synergies: Sequence[Synergy], state: RobotState
    ) -> None:
        self.name = name
        count = len(synergies)
        self.part = ActionPart(
            name=name,
            kind="gripper",
            labels=tuple(s.name for s in synergies),
            units=("-1 open .. 1 closed",) * count,
            low=(-1.0,) * count,
            high=(1.0,) * count,
        )
        places = {joint: i for i, joint in enumerate(state.actuators)}
        driven = [
            (k, joint)
            for k, synergy in enumerate(synergies)
            for joint in synergy.open
            if joint in places
        ]
        self.joints = tuple(joint for _, joint in driven)
        self._synergy: Indices = np.array([k for k, _ in driven], dtype=np.int64)
        self.outputs: Indices = np.array([places[j] for _, j in driven], dtype=np.int64)
        self._open = np.array([synergies[k].open[j] for k, j in driven])
        self._closed = np.array([synergies[k].closed[j] for k, j in driven])
        self._synergies = tuple(synergies)
        self.goal: Vector = np.zeros(count)

    def reset(self, state: RobotState) -> None:
        """Take the present opening as the goal."""
        for k, synergy in enumerate(self._synergies):
            joint, start = next(iter(synergy.open.items()))
            span = synergy.closed[joint] - start
            (q_index,), _ = state.joint_addresses((joint,))
            closed = (state.data.qpos[q_index] - start) / span if span else 0.0
            self.goal[k] = np.clip(2.0 * closed - 1.0, -1.0, 1.0)

    def set_goal(self, action: Vector) -> None:
        """Take the slice's values, shape (number of synergies,)."""
        self.goal[:] = action

    def set_points(self) -> Vector:
        """Return set points for `outputs`, rad or m."""
        closed = 0.5 * (self.goal[self._synergy] + 1.0)
        return self._open + closed * (self._closed - self._open)
