"""A base that drives to where hands reach an object."""

from collections.abc import Callable

import numpy as np
import pinocchio as pin

from wbc_suite.control import RobotState
from wbc_suite.control.action import ActionSlice
from wbc_suite.devices.action_ports import LimbPort
from wbc_suite.typing import Vector

SHARE = 0.5  # of the turn to face an object: the corners of a table keep robots away
BACK, MOST_BACK = 0.03, 0.6  # m, by which a base stays back from what it meets
ARRIVED, TURNED = 0.02, 0.03  # m, rad


class MobileBase:
    """The planar root of a robot, and the slice of an action that is its goal.

    Args:
        port: Of the base.
        state: The robot.
        part: The slice.
        hands: The middle of the hands at the start, in the world, m.
    """

    def __init__(
        self, port: LimbPort, state: RobotState, part: ActionSlice, hands: Vector
    ) -> None:
        self._port, self._state, self._slice = port, state, part
        self._goal: pin.SE3 | None = None
        self._hands = port.measure().actInv(hands)

    @property
    def pose(self) -> pin.SE3:
        """Measured pose in the world."""
        return self._port.measure()

    @property
    def arrived(self) -> bool:
        """Whether the base is at its goal."""
        if self._goal is None:
            return True
        left = self.pose.actInv(self._goal)
        near = np.linalg.norm(left.translation[:2]) < ARRIVED
        return bool(near and np.linalg.norm(pin.log3(left.rotation)) < TURNED)

    def go_before(
        self, center: Vector, across: Vector, free: Callable[[Vector], bool]
    ) -> None:
        """Drive to where hands, as they were at the start, are at an object.

        Args:
            center: The object's position in the world, m.
            across: Vector in the world that the robot turns its left side to, halfway.
            free: Whether the robot meets nothing at a configuration.
        """
        now, q = self.pose, self._state.q
        left = now.rotation.T @ across
        turn = SHARE * np.arctan2(-left[0], left[1])
        R = now.rotation @ pin.exp3(np.array([0.0, 0.0, turn]))
        for back in np.arange(0.0, MOST_BACK, BACK):
            ahead = self._hands + np.array([back, 0.0, 0.0])
            goal = pin.SE3(R, center - R @ ahead)
            place = _place(q) * now.actInv(goal)
            there = q.copy()
            there[:2], there[2] = place.translation[:2], q[2] + turn
            if free(there):
                self._goal = goal
                return

    def write(self, action: Vector) -> None:
        """Write the goal into an action, if there is one."""
        if self._goal is not None:
            values = self._port.encode(self._goal)
            action[self._slice.start : self._slice.stop] = values


def _place(q: Vector) -> pin.SE3:
    """Return the pose of a planar root, whose x, y and yaw come first."""
    return pin.SE3(pin.exp3(np.array([0.0, 0.0, q[2]])), np.array([*q[:2], 0.0]))
