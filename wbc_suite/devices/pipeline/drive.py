"""Driving: the velocity of a base or a walk, and the height of the body."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from wbc_suite.control.action import ActionSlice
from wbc_suite.devices.action_ports import SpeedPort
from wbc_suite.devices.pipeline.config import PipelineConfig
from wbc_suite.devices.pipeline.motion_limit import LimitedMotion
from wbc_suite.typing import Vector

AT_REST = 1e-4  # m/s and rad/s; a slower velocity that ends at zero is zero


class HeldCommand:
    """A command that counts for as long as it is repeated: a dead-man switch.

    The first client that sends one has it until it sends zeros, leaves, or has sent
    nothing for `timeout`. Commands of a client count once it has sent zeros: when it
    comes, and again after a command of its own ended in another way or was refused. So
    a key that is held while the connection drops moves nothing when it is back. The
    timeout is in s.
    """

    def __init__(self, size: int, timeout: float) -> None:
        self.timeout = timeout
        self._values, self._client, self._time = np.zeros(size), -1, -np.inf
        self._released: set[int] = set()  # clients whose commands count
        self._refused = -np.inf  # when a command came from another one, s

    def set(self, values: ArrayLike, *, client: int, now: float) -> bool:
        """Take a command, which zeros end; False if it is refused.

        That is if it is invalid, another client has one, or zeros have to come first.
        """
        array = np.array(values, dtype=np.float64)
        if array.shape != self._values.shape or not np.isfinite(array).all():
            return False
        held = self.read(now).any()
        if not array.any():
            self._released.add(client)
        elif client not in self._released:
            self._refused = now
            return False
        if held and client != self._client:
            if array.any():
                self._released.discard(client)
            return False
        self._values, self._client, self._time = array, client, now
        return True

    def waits(self, now: float) -> bool:
        """Return whether a client commands that has to send zeros first."""
        return now - self._refused <= self.timeout

    def leave(self, client: int) -> None:
        """Forget a client; the command becomes zero if it is its own."""
        if client == self._client:
            self._values[:] = 0.0
        self._released.discard(client)

    def clear(self) -> None:
        """Set the command to zero; its client has to send zeros before the next one."""
        if self._values.any():
            self._released.discard(self._client)
        self._values[:] = 0.0

    def read(self, now: float) -> Vector:
        """Return the command; zeros if it is older than `timeout`."""
        if now - self._time > self.timeout:
            self.clear()
        return self._values.copy()


class RobotDrive:
    """Drive one robot: its velocity moves to a goal within the limits of its rate.

    `ports` command the velocity of its base or its walk, `heights` its height. It
    `glides` if the pose of its base is commanded, and `lifts` if it has a joint that
    lifts its body. `dt` is the time between two ticks, s.

    Attributes:
        velocity: Forward, left (m/s), turn (rad/s), up (m/s), shape (4,).
        limits: Greatest values of each; 0 for what it cannot do.
    """

    def __init__(
        self,
        ports: Iterable[SpeedPort],
        heights: Iterable[ActionSlice],
        config: PipelineConfig,
        dt: float,
        *,
        glides: bool = False,
        lifts: bool = False,
    ) -> None:
        self._ports, self._heights = tuple(ports), tuple(heights)
        linear, angular = config.base_speed
        limits = [linear, linear, angular, config.rise_speed]
        self.limits: Vector = np.array(limits)
        self.limits[:3] *= bool(self._ports) or glides
        self.limits[3] *= bool(self._heights) or lifts
        for port in self._ports:
            self.limits[:3] = np.minimum(self.limits[:3], port.limits)
        self._dt, self._change = dt, LimitedMotion(4, config.base_rise, dt)
        self.reset({part.name: np.zeros(1) for part in self._heights})

    def reset(self, held: dict[str, Vector]) -> None:
        """Stop; `held` are the values of slices that hold the robot."""
        self._goal: Vector = np.zeros(4)
        self.velocity: Vector = np.zeros(4)
        self._height = {part.name: held[part.name].copy() for part in self._heights}
        self._change.stop()

    def aim(self, velocity: Vector) -> None:
        """Set the goal: forward, left (m/s), turn (rad/s), up (m/s)."""
        goal = velocity.copy()
        fastest = max(*self.limits[:2], AT_REST)
        goal[:2] /= max(1.0, float(np.hypot(*goal[:2])) / fastest)
        self._goal = np.clip(goal, -self.limits, self.limits)

    def update(self) -> dict[str, Vector]:
        """Advance by one tick; return the values of the slices."""
        self.velocity = self.velocity + self._change.step(self._goal - self.velocity)
        if not self._goal.any() and np.abs(self.velocity).max() < AT_REST:
            self.velocity = np.zeros(4)
        step = self.velocity[3] * self._dt
        for part in self._heights:
            value = self._height[part.name] + step
            self._height[part.name] = np.clip(value, part.low, part.high)
        values = {port.name: port.encode(self.velocity[:3]) for port in self._ports}
        return values | self._height
