"""Drive a robot's base 2 m ahead and turn it by 90 degrees in simulation."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from wbc_suite.control.composite.basic import default_basic_config
from wbc_suite.envs.env import RobotEnv
from wbc_suite.envs.hold_check import alone
from wbc_suite.errors import WbcError
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.wheel_drive import WheelDrive

AHEAD = 2.0  # m
QUARTER = np.pi / 2.0  # rad
PACE = (0.3, 0.6)  # m/s and rad/s, of a careful driver
RATE = 20  # Hz, of actions
SLOW = 4.0  # times as long as at that pace, a drive has failed
BRAKING = 0.5  # s of way before the end, from which on a driver slows down
REST = 1.0  # s, standing still after each
TILTED = 0.9  # least vertical component of the first link's z


@dataclass(frozen=True, kw_only=True, slots=True)
class Driven:
    """How a base has driven.

    Attributes:
        distance: Way along its first direction, m.
        drift: Way across it, m.
        turned: Angle by which it turned after that, rad.
        upright: Least vertical component of z of the first link.
    """

    distance: float
    drift: float
    turned: float
    upright: float

    @property
    def arrived(self) -> bool:
        """Whether it drove 2 m and turned by 90 degrees, each within a tenth."""
        return (
            abs(self.distance - AHEAD) < 0.1 * AHEAD
            and abs(self.drift) < 0.1 * AHEAD
            and abs(self.turned - QUARTER) < 0.1 * QUARTER
            and self.upright > TILTED
        )

    def __str__(self) -> str:
        return (
            f"drove {self.distance:.2f} m ahead, {abs(self.drift):.2f} m aside, and "
            f"turned by {np.degrees(self.turned):.0f} degrees"
        )


def drive_check(robot: RobotDescription) -> Driven:
    """Drive a base ahead by the action `base` of BASIC, then turn it; a car on a curve.

    The driver stops where the way or the angle is reached.

    Raises:
        WbcError: If it cannot be controlled, or falls.
    """
    config = default_basic_config(robot)
    parts: dict[str, Any] = config["body_parts"]
    if "base" not in parts:
        raise WbcError(f"{robot.name} has no base that drives.")
    parts["base"] = {"type": "BASE_VELOCITY", "input_type": "absolute"}
    config |= {"type": "BASIC"}
    env = alone(robot, controller_configs=config, control_freq=RATE)
    env.reset(seed=0)
    driver = _Driver(env)
    driver.go(forward=min(PACE[0], robot.root.velocity[0]))
    away = driver.place() - driver.start
    heading = driver.yaw_at_start
    ahead = np.array([np.cos(heading), np.sin(heading)])
    driver.turn(WheelDrive(robot).turning_radius if robot.wheels else 0.0, robot)
    env.close()
    return Driven(
        distance=float(away @ ahead),
        drift=float(ahead[0] * away[1] - ahead[1] * away[0]),
        turned=driver.turned,
        upright=driver.upright,
    )


def _slower(way: float, speed: float) -> float:
    """Return the part of a speed to go on with for a way, m or rad."""
    return float(np.clip(way / (BRAKING * speed), 0.1, 1.0))


class _Driver:
    """Commands a base, and measures where it is."""

    def __init__(self, env: RobotEnv) -> None:
        self._env, self._layout = env, env.action_layout
        self._state: Any = env.simulation.robots[0]
        self.start, self.yaw_at_start = self.place(), self.yaw()
        self.turned, self.upright = 0.0, 1.0

    def place(self) -> Any:
        return self._state.root_pose.translation[:2]

    def yaw(self) -> float:
        R = self._state.root_pose.rotation
        return float(np.arctan2(R[1, 0], R[0, 0]))

    def go(self, *, forward: float) -> None:
        """Drive ahead until the way is done."""
        left, way = SLOW * AHEAD / forward, AHEAD
        while left > 0.0 and way > 0.0:
            self._step(forward * _slower(way, forward), 0.0)
            way = AHEAD - float(np.linalg.norm(self.place() - self.start))
            left -= 1.0 / RATE
        self._rest()

    def turn(self, radius: float, robot: RobotDescription) -> None:
        """Turn to the left until the angle is reached, on a curve of a radius, m."""
        rate = min(PACE[1], robot.root.velocity[1])
        forward = min(PACE[0], robot.root.velocity[0]) if radius else 0.0
        rate = min(rate, forward / radius) if radius else rate
        left, last = SLOW * QUARTER / rate, self.yaw()
        while left > 0.0 and self.turned < QUARTER:
            part = _slower(QUARTER - self.turned, rate)
            self._step(part * forward, part * rate)
            last = self._turn_from(last)
            left -= 1.0 / RATE
        self._rest()
        self._turn_from(last)

    def _turn_from(self, last: float) -> float:
        now = self.yaw()
        self.turned += float((now - last + np.pi) % (2.0 * np.pi) - np.pi)
        return now

    def _rest(self) -> None:
        for _ in range(round(REST * RATE)):
            self._step(0.0, 0.0)

    def _step(self, forward: float, turn: float) -> None:
        size = len(self._layout.unpack(self._env.hold_action)["base"])
        values = np.zeros(size)
        values[0], values[-1] = forward, turn
        goals = {"base": values}
        action = self._layout.pack(goals, base=self._env.hold_action)
        *_, info = self._env.step(action)
        if fault := info.get("failure") or info.get("physics_error"):
            raise WbcError(str(fault))
        up = float(self._state.root_pose.rotation[2, 2])
        self.upright = min(self.upright, up)
