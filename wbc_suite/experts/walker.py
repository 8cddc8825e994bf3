"""A robot on its feet that an expert walks to places."""

import math

import numpy as np
import pinocchio as pin

from wbc_suite.benchmark.standing import Standing, wrapped
from wbc_suite.control.action import ActionSlice
from wbc_suite.devices.action_ports import SpeedPort, speed_ports
from wbc_suite.envs import RobotEnv
from wbc_suite.typing import Vector

FASTEST = np.array([0.5, 0.3, 0.5])  # m/s, m/s, rad/s: every gait sustains them
LOOKS_AHEAD_FROM = 0.6  # m; from here on the robot looks where it walks
ASIDE = 0.5  # rad; it turns on the spot towards what is farther aside


class Walker:
    """Writes the velocity of a robot on its feet into actions.

    Attributes:
        velocity: Forward, left, m/s, and turn, rad/s, of the next control period.
    """

    def __init__(self, port: SpeedPort, part: ActionSlice, standing: Standing) -> None:
        self._port, self._slice, self._standing = port, part, standing
        self.velocity: Vector = np.zeros(3)

    @property
    def place(self) -> tuple[float, float, float]:
        """Place of the trunk in the world, x and y, m, and its heading, rad."""
        x, y, _ = self._standing.position.tolist()
        return x, y, self._standing.heading

    @property
    def ground(self) -> pin.SE3:
        """Frame at the trunk, with its heading, level."""
        turn = pin.exp3(np.array([0.0, 0.0, self._standing.heading]))
        return pin.SE3(turn, self._standing.position.copy())

    @property
    def rests(self) -> bool:
        """Whether the robot stands with a trunk that hardly moves."""
        return self._standing.rests

    def way_to(self, x: float, y: float, heading: float) -> Vector:
        """Return the way to a place: forward and left, m, and the turn, rad."""
        ahead = self._standing.offset_to(x, y)
        return np.array([*ahead, wrapped(heading - self._standing.heading)])

    def write(self, action: Vector) -> None:
        """Write the velocity into an action."""
        action[self._slice.start : self._slice.stop] = self._port.encode(self.velocity)


def walker_of(env: RobotEnv, standing: Standing | None) -> Walker | None:
    """Return what walks the robot of a benchmark on feet; None where nothing does."""
    if standing is not None:
        for name, port in speed_ports(env).items():
            if len(port.axes) == 3:
                return Walker(port, env.action_layout[name], standing)
    return None


def walking_velocity(way: Vector, near: float, share: float) -> Vector:
    """Return the velocity for a way that is left: forward, left, m, and turn, rad.

    It is zero where less is left than `near`, m and rad; `share` is of `FASTEST`.

    A robot that is far away turns to where it walks, without sidesteps.
    """
    forward, left, turn = way
    if max(math.hypot(forward, left), abs(turn)) < near:
        return np.zeros(3)
    if math.hypot(forward, left) > LOOKS_AHEAD_FROM:
        turn = math.atan2(left, forward)
        if abs(turn) > ASIDE:
            forward = left = 0.0
    return np.clip([forward, left, turn], -share * FASTEST, share * FASTEST)
