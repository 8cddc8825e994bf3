"""BASE_VELOCITY: actions are velocities of a base on wheels."""

from typing import Literal

import numpy as np
from pydantic import Field, PositiveFloat

from wbc_suite.control.action import Axis, SliceKind, Unit
from wbc_suite.control.ground.records import LawKind
from wbc_suite.control.law.joint_laws import VelocityLaw
from wbc_suite.control.law.law import ServoLaw
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
from wbc_suite.robot.wheel_drive import WheelDrive
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


class BaseVelocityController(PartController[VelocityLaw | ServoLaw]):
    """Sets a base's velocities forward, sideways and around by actions.

    A base that is not holonomic has no velocity sideways, and a car turns as its
    steering lets it. All components change in the same time, which the slowest of them
    needs. A planar root tracks the integral of the velocities, so a base at zero
    velocity holds its position; the wheels of a free root get the speeds that
    `WheelDrive` computes.

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
        self._drive = WheelDrive(robot) if robot.wheels else None
        self.config = config
        most = config.acceleration, config.acceleration, config.turning_acceleration
        self._accelerations: Vector = np.array(most)
        if root.kind == "planar" and root.actuated:
            self.law = self._law_of_root(state)
        elif root.kind == "free" and self._drive is not None:
            wheels = [wheel.joint for wheel in robot.wheels]
            self.law = ServoLaw(state, (*wheels, *self._drive.steering))
        else:
            raise ConfigError(f"{robot.name}: part '{part.name}' has no driven base.")
        holonomic = root.drive == "holonomic"
        if self._drive is not None:
            holonomic = self._drive.kind.is_holonomic
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
        self._start: Vector = np.zeros(3)

    def _law_of_root(self, state: RobotState) -> VelocityLaw:
        config = self.config
        law = VelocityLaw(
            state,
            state.robot.root_joint_names,
            kp=config.kp,
            kd=damping_of(config.kp, 1.0),
            windup=config.windup_limit,
            correction=config.correction * self._accelerations,
            kind=LawKind.BASE,
        )
        apply_torque_settings(law, config)
        return law

    @property
    def memory(self) -> Parts:
        """The commanded velocities, and those before the last action; views."""
        return self.goal, self._start

    def reset(self, state: RobotState) -> None:
        """Stand still."""
        self.goal[:] = self._start[:] = 0.0
        if isinstance(self.law, VelocityLaw):
            self.law.halt(state)
        else:
            rest = state.data.qpos[self.law.drives["qpos"]]
            rest[: len(state.robot.wheels)] = 0.0
            self.law.aim(rest)

    def set_goal(self, values: Vector, period: float) -> None:
        """Take velocities, shape (3,), or (2,) without sideways."""
        now = self._commanded()
        self.goal[:] = 0.0
        self.goal[self._axes] = self._input(values)
        if self._drive is not None:
            self.goal[:] = self._drive.feasible(self.goal)
        duration = float((np.abs(self.goal - now) / self._accelerations).max())
        self._start[:] = now
        if isinstance(self.law, VelocityLaw):
            self.law.set_speed(self.goal, duration=duration)
        elif self._drive is not None:
            place, _, _ = self.law.target()
            steering = self._drive.steered(self.goal, place[len(self._drive.wheels) :])
            speeds = self._drive.speeds(self.goal, steering)
            self.law.move(np.concatenate([speeds, steering]), duration)

    def _commanded(self) -> Vector:
        """Return the commanded velocities now, shape (3,)."""
        if isinstance(self.law, VelocityLaw):
            return self.law.commanded()[0]
        since, duration = self.law.record["since"][0], self.law.record["duration"][0]
        part = min(since / duration, 1.0) if duration > 0.0 else 1.0
        return self._start + part * (self.goal - self._start)

    @property
    def hold_action(self) -> Vector:
        """The action of zero velocity."""
        return self._input.neutral
