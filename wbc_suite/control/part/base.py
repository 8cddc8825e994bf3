"""BASE_VELOCITY: actions are speeds of a base on wheels."""

from typing import Literal

import numpy as np
from pydantic import Field, PositiveFloat

from wbc_suite.control.action import ActionPart
from wbc_suite.control.part.config import (
    InputScaling,
    InputType,
    PartSettings,
    damping_of,
    set_torque_rules,
)
from wbc_suite.control.part.controller import WHENEVER
from wbc_suite.control.part.joint import BaseLaw
from wbc_suite.control.state import RobotState
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Indices, Vector

__all__ = ["BaseVelocityConfig", "BaseVelocityController"]


class BaseVelocityConfig(PartSettings):
    """A base follows speeds along its own heading; see `BaseLaw`.

    Attributes:
        kp: Stiffness with which the base keeps its place, 1/s^2, critically damped.
        input_type: `delta`: 1 is the greatest speed. `absolute`: m/s and rad/s.
        velocity_scale: Factor on the base's greatest speeds.
        acceleration: Greatest acceleration, m/s^2.
        turning_acceleration: Greatest acceleration around, rad/s^2.
        correction: Greatest acceleration that makes up for errors, as a multiple of
            these two.
        windup_limit: How far the base may fall behind its target, m and rad.
    """

    type: Literal["BASE_VELOCITY"] = "BASE_VELOCITY"
    kp: PositiveFloat = 400.0
    input_type: InputType = "delta"
    velocity_scale: float = Field(default=1.0, gt=0.0, le=1.0)
    acceleration: PositiveFloat = 1.0
    turning_acceleration: PositiveFloat = 2.0
    correction: PositiveFloat = 3.0
    windup_limit: PositiveFloat = 0.05


class BaseVelocityController:
    """Sets a base's speeds forward, sideways and around by actions.

    A differential base has no speed sideways. Speeds change together, as fast as the
    slowest of them may. The integral of the speeds is held: a base told to stand still
    stands still.

    Args:
        name: The part, and its slice.
        config: Limits and meaning of the input.
        state: The robot in the simulation.

    Attributes:
        goal: Speeds asked for, shape (3,): forward and sideways, m/s; around, rad/s.

    Raises:
        ConfigError: If the robot has no base that drives.
    """

    def __init__(
        self, name: str, config: BaseVelocityConfig, state: RobotState
    ) -> None:
        robot, root = state.robot, state.robot.root
        if robot.root.kind != "planar" or not root.actuated:
            raise ConfigError(f"{robot.name}: part '{name}': it has no driven base.")
        self.config = config
        most = config.acceleration, config.acceleration, config.turning_acceleration
        self._most: Vector = np.array(most)
        self.law = BaseLaw(
            state,
            robot.root_joint_names,
            kp=config.kp,
            kd=damping_of(config.kp, 1.0),
            leash=config.windup_limit,
            most=config.correction * self._most,
        )
        set_torque_rules(self.law, config)
        holonomic = root.drive == "holonomic"
        self._axes: Indices = np.array([0, 1, 2] if holonomic else [0, 2])
        linear, angular = root.velocity
        speeds = np.array([linear, linear, angular]) * config.velocity_scale
        self._speeds: Vector = speeds
        own = speeds[self._axes]
        size = len(own)
        self._scaling = InputScaling(
            size, config, tuple((-own).tolist()), tuple(own.tolist())
        )
        units = tuple(("m/s", "m/s", "rad/s")[i] for i in self._axes)
        low, high = -own, own
        if config.input_type == "delta":
            low, high = self._scaling.low, self._scaling.high
            units = self._scaling.units(units)
        self.slices = (
            ActionPart(
                name=name,
                kind="base",
                labels=tuple(("forward", "sideways", "turn")[i] for i in self._axes),
                units=units,
                low=tuple(low.tolist()),
                high=tuple(high.tolist()),
            ),
        )
        self.goal: Vector = np.zeros(3)

    def reset(self, state: RobotState) -> None:
        """Stand still."""
        self.goal = np.zeros(3)
        self.law.halt(state)

    def set_goal(self, values: Vector, period: float) -> None:
        """Take speeds, shape (3,), or (2,) without sideways."""
        if self.config.input_type == "delta":
            values = self._scaling(values)
        self.goal = np.zeros(3)
        self.goal[self._axes] = values
        self.goal = np.clip(self.goal, -self._speeds, self._speeds)
        now, _ = self.law.asked()
        duration = float((np.abs(self.goal - now) / self._most).max())
        self.law.set_speed(self.goal, duration=duration)

    def prepare(self, state: RobotState) -> int:
        """Do nothing: the law follows."""
        return WHENEVER

    @property
    def hold_action(self) -> Vector:
        """The action that lets the base stand still."""
        if self.config.input_type == "delta":
            return self._scaling.neutral
        return np.zeros(len(self._axes))
