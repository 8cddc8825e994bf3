"""A base that drives to where hands reach an object."""

from collections.abc import Callable
from functools import partial

import numpy as np
import pinocchio as pin

from wbc_suite.control import RobotState
from wbc_suite.control.action import ActionSlice
from wbc_suite.devices.action_ports import (
    LimbKind,
    SpeedPort,
    limb_ports,
    speed_ports,
)
from wbc_suite.envs import RobotEnv
from wbc_suite.typing import Vector

SHARE = 0.5  # of the turn to face an object: the corners of a table keep robots away
BACK, MOST_BACK = 0.03, 0.6  # m, by which a base stays back from what it meets
GAIN = 2.0  # 1/s, of a base that is moved by its speed
ARRIVED, TURNED = 0.02, 0.03  # m, rad


class MobileBase:
    """The planar root of a robot, and the slice of an action that moves it.

    Args:
        encode: Returns the values of the slice for a goal in the world.
        state: The robot.
        part: The slice.
        hands: The middle of the hands at the start, in the world, m.
    """

    def __init__(
        self,
        encode: Callable[[pin.SE3], Vector],
        state: RobotState,
        part: ActionSlice,
        hands: Vector,
    ) -> None:
        self._encode, self._state, self._slice = encode, state, part
        self._goal: pin.SE3 | None = None
        self._hands = state.root_pose.actInv(hands)

    @property
    def pose(self) -> pin.SE3:
        """Measured pose in the world."""
        return self._state.root_pose

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
            values = self._encode(self._goal)
            action[self._slice.start : self._slice.stop] = values


def mobile_base(env: RobotEnv, state: RobotState, hands: Vector) -> MobileBase | None:
    """Return the base of a robot that drives in any direction; None without one.

    The action has its goal, or its speed.

    Args:
        env: The environment.
        state: The robot.
        hands: The middle of its hands at the start, in the world, m.
    """
    layout = env.action_layout
    if state.robot.root.kind != "planar":
        return None
    for port in limb_ports(env).values():
        body = state.model.body(port.body).name
        if port.kind is LimbKind.PLANAR and body.startswith(state.prefix):
            part = layout[port.name]
            return MobileBase(port.encode, state, part, hands)
    for name, speed in speed_ports(env).items():
        own = len(env.robots) == 1 or name.startswith(state.prefix)
        if own and len(speed.axes) == 3:
            encode = partial(_speed_towards, speed, state)
            return MobileBase(encode, state, layout[name], hands)
    return None


def _speed_towards(port: SpeedPort, state: RobotState, goal: pin.SE3) -> Vector:
    """Return the values of a base's speed for a goal in the world."""
    left = state.root_pose.actInv(goal)
    turn = pin.log3(left.rotation)[2]
    return port.encode(GAIN * np.array([*left.translation[:2], turn]))


def _place(q: Vector) -> pin.SE3:
    """Return the pose of a planar root, whose x, y and yaw come first."""
    return pin.SE3(pin.exp3(np.array([0.0, 0.0, q[2]])), np.array([*q[:2], 0.0]))
