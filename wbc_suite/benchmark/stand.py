"""Stand: stay on the feet while pushes act on the trunk."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from pydantic import NonNegativeFloat, PositiveFloat

from wbc_suite.benchmark.base import Source, load_config
from wbc_suite.benchmark.object_benchmark import ObjectBenchmark, ObjectBenchmarkConfig
from wbc_suite.benchmark.reward_terms import SharesOfOne
from wbc_suite.benchmark.standing import (
    ROUNDING,
    Standing,
    StandingConfig,
    add_floor_cameras,
    arrange_on_feet,
    wrapped,
)
from wbc_suite.control import RobotState
from wbc_suite.robot import RobotDescription
from wbc_suite.scene import Push, PushConfig, draw_pushes
from wbc_suite.scene.objects import SceneObject
from wbc_suite.sensing.reading import Reading, computed
from wbc_suite.typing import Vector

PLACE = 3
"""Entries of user data: x and y of the start, m, and the heading there, rad."""


class RewardConfig(SharesOfOne):
    """Numbers of the reward; see `Stand.progress`."""

    shares = ("upright", "rest", "back")

    upright: NonNegativeFloat
    rest: NonNegativeFloat
    back: NonNegativeFloat
    speed_scale: PositiveFloat
    back_scale: PositiveFloat


class StandConfig(ObjectBenchmarkConfig):
    """`tasks/stand.toml`.

    Attributes:
        standing: Falls and rest.
        pushes: Pushes on the trunk.
        until: When the last push has ended, s from the start.
        duration: Time before a success, s; the pushes end earlier.
        near: Greatest distance of the trunk from its start at a success, m.
        facing: Greatest angle of its heading to that at the start, rad.
        reward: Numbers of the reward.
    """

    standing: StandingConfig
    pushes: PushConfig
    until: PositiveFloat
    duration: PositiveFloat
    near: PositiveFloat
    facing: PositiveFloat
    reward: RewardConfig


class Stand(ObjectBenchmark):
    """The robot is to withstand pushes, and to rest where it stood at the start.

    Args:
        path: `tasks/stand.toml`, or a file of the same form.
    """

    robots: Sequence[str] = ("GR1FreeBody",)
    needs_gripper = False

    def __init__(self, path: Source) -> None:
        self.config = load_config(StandConfig, path)
        super().__init__(self.config)
        self.standing = Standing(self.config.standing)
        self.pushes: Sequence[Push] = ()

    def arrange(
        self, robots: Sequence[RobotDescription], configuration: str
    ) -> tuple[RobotDescription, ...]:
        """Return the robot; see `arrange_on_feet`."""
        return arrange_on_feet(self.name, robots, configuration, self.config.places)

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add cameras."""
        self.standing.reserve(spec)
        self._entry = spec.nuserdata
        spec.nuserdata += PLACE
        add_floor_cameras(spec)

    def objects(self) -> Sequence[SceneObject]:
        """Return no objects."""
        return []

    def bind(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[RobotState]
    ) -> None:
        """Look up the robot."""
        super().bind(model, data, robots)
        self.standing.bind(model, data, robots[0])
        self._start: Vector = data.userdata[self._entry : self._entry + PLACE]

    def reset(self, rng: np.random.Generator) -> None:
        """Draw the pushes, and note where the robot stands."""
        config, body = self.config, self.standing.trunk
        self.pushes = draw_pushes(config.pushes, rng, body=body, until=config.until)
        x, y, _ = self.standing.position.tolist()
        self._start[:] = x, y, self.standing.heading

    def observables(self) -> dict[str, Reading]:
        """Return the share of the time that has passed, and the way back.

        `robot_to_start` is the way forward and left, m, and the turn, rad, in the
        heading of the robot.
        """
        share = 1.0 / self.config.duration
        return {
            "progress": computed(1, lambda: min(share * self.data.time, 1.0)),
            "robot_to_start": computed(3, self.way_back),
        }

    def way_back(self) -> tuple[float, float, float]:
        """Return the way to the start: forward and left, m, and the turn, rad."""
        x, y, heading = self._start.tolist()
        turn = wrapped(heading - self.standing.heading)
        return *self.standing.offset_to(x, y), turn

    @property
    def is_back(self) -> bool:
        """Whether the robot is where it stood at the start, and faces as it did."""
        forward, left, turn = self.way_back()
        near = math.hypot(forward, left) < self.config.near
        return near and abs(turn) < self.config.facing

    def after_step(self) -> None:
        """Note a fall, and how long the robot has rested at its start in the end."""
        left = self.config.duration - self.data.time
        done = left <= self.config.standing.hold + ROUNDING
        self.standing.observe(done and self.is_back and self.standing.rests)

    def success(self) -> bool:
        """Whether the robot has not fallen in all actions and rests at its start."""
        return self.standing.held

    def failure(self) -> str | None:
        """Return how the robot has fallen, or None."""
        return self.standing.fall()

    def progress(self) -> float:
        """Return the shaped reward.

        With the tilt t and the speed v of the trunk, and its distance d from the start,
        it is 0 after a fall, and else

            upright max(cos t, 0) + rest (1 - tanh(speed_scale v))
            + back (1 - tanh(back_scale d))
        """
        numbers, standing = self.config.reward, self.standing
        if standing.fall() is not None:
            return 0.0
        still = 1.0 - math.tanh(numbers.speed_scale * standing.speed)
        away = math.tanh(numbers.back_scale * math.hypot(*self.way_back()[:2]))
        reward = numbers.upright * max(math.cos(standing.tilt), 0.0)
        return reward + numbers.rest * still + numbers.back * (1.0 - away)
