"""BASE_VELOCITY: actions are velocities of a base on wheels."""

from typing import Literal

import numpy as np
from pydantic import Field, PositiveFloat

from wbc_suite.control.action import Axis, SliceKind, Unit
from wbc_suite.control.ground.records import LawKind
from wbc_suite.control.law.joint_laws import VelocityLaw
from wbc_suite.control.memory import Parts
from wbc_suite.control.part.controller import PartController
from wbc_suite.control.part.part_settings import (
    PartSettings,
    SliceInput,
    apply_torque_settings,
    damping_of,
)
from wbc_suite.control.robot_parts import RobotPart
from wbc_suite.control.state import RobotState
from wbc_suite.errors import ConfigError
from wbc_suite.typing import Indices, Vector

AXES = (Axis.FORWARD, Axis.SIDEWAYS, Axis.TURN)
UNITS = (Unit("m/s"), Unit("m/s"), Unit("rad/s"))


class BaseVelocityConfig(PartSettings):
    """A base follows velocities in its own axes; see `VelocityLaw`.

    Attributes:
        kp: Stiffness of the position error, 1/s^2, critically damped.
        input_type: `delta`: 1 is the greatest velocity. `absolute`: m/s and rad/s.
        velocity_scale: Factor on the base's greatest velocities.
        acceleration: Greatest linear acceleration, m/s^2.
        turning_acceleration: Greatest angular acceleration, rad/s^2.
        correction: Greatest feedback acceleration, as a multiple of these two.
        windup_limit: Greatest distance between reference and base, m and rad.
    """

    type: Literal["BASE_VELOCITY"] = "BASE_VELOCITY"
    kp: PositiveFloat = 400.0
    velocity_scale: float = Field(default=1.0, gt=0.0, le=1.0)
    acceleration: PositiveFloat = 1.0
    turning_acceleration: PositiveFloat = 2.0
    correction: PositiveFloat = 3.0
    windup_limit: PositiveFloat = 0.05


class BaseVelocityController(PartController[VelocityLaw]):
    """Sets a base's velocities forward, sideways and around by actions.

    A differential base has no velocity sideways. All components change in the same
    time, which the slowest of them needs. The integral of the velocities is tracked, so
    a base at zero velocity holds its position.

    Attributes:
        goal: Commanded velocities, shape (3,): forward and sideways, m/s; turn, rad/s.

    Raises:
        ConfigError: If the robot has no base that drives.
    """

    drives_base = True

    def __init__(
        self, part: RobotPart, config: BaseVelocityConfig, state: RobotState
    ) -> None:
        robot, root = state.robot, state.robot.root
        if root.kind != "planar" or not root.actuated:
            raise ConfigError(f"{robot.name}: part '{part.name}' has no driven base.")
        self.config = config
        most = config.acceleration, config.acceleration, config.turning_acceleration
        self._accelerations: Vector = np.array(most)
        self.law = VelocityLaw(
            state,
            robot.root_joint_names,
            kp=config.kp,
            kd=damping_of(config.kp, 1.0),
            windup=config.windup_limit,
            correction=config.correction * self._accelerations,
            kind=LawKind.BASE,
        )
        apply_torque_settings(self.law, config)
        holonomic = root.drive == "holonomic"
        self._axes: Indices = np.array([0, 1, 2] if holonomic else [0, 2])
        linear, angular = root.velocity
        velocities = config.velocity_scale * np.array([linear, linear, angular])
        own = velocities[self._axes]
        self._input = SliceInput(
            part.name,
            SliceKind.BASE,
            labels=tuple(AXES[i] for i in self._axes),
            units=tuple(UNITS[i] for i in self._axes),
            config=config,
            outputs=(tuple((-own).tolist()), tuple(own.tolist())),
            limits=(-own, own),
        )
        self.slices = (self._input.action,)
        self.goal: Vector = np.zeros(3)

    @property
    def memory(self) -> Parts:
        """The commanded velocities, a view."""
        return (self.goal,)

    def reset(self, state: RobotState) -> None:
        """Stand still."""
        self.goal[:] = 0.0
        self.law.halt(state)

    def set_goal(self, values: Vector, period: float) -> None:
        """Take velocities, shape (3,), or (2,) without sideways."""
        self.goal[:] = 0.0
        self.goal[self._axes] = self._input(values)
        now, _ = self.law.commanded()
        duration = float((np.abs(self.goal - now) / self._accelerations).max())
        self.law.set_speed(self.goal, duration=duration)

    @property
    def hold_action(self) -> Vector:
        """The action of zero velocity."""
        return self._input.neutral
