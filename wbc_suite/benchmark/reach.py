"""Reach: bring the hands to targets, standing."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from pydantic import Field, PositiveFloat, field_validator

from wbc_suite.benchmark.arrangement import with_default
from wbc_suite.benchmark.base import Source, load_config
from wbc_suite.benchmark.object_benchmark import (
    ObjectBenchmark,
    ObjectBenchmarkConfig,
)
from wbc_suite.benchmark.standing import (
    Standing,
    StandingConfig,
    add_floor_cameras,
    arrange_on_feet,
)
from wbc_suite.config_files import FrozenModel
from wbc_suite.control import RobotState
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.elements import Channel
from wbc_suite.robot.shapes import Interval, Size
from wbc_suite.scene.objects import ObjectState, Part, SceneObject
from wbc_suite.sensing.reading import Reading, body_position
from wbc_suite.typing import Vector


class RegionConfig(FrozenModel):
    """Where targets of the right hand are drawn; the left one's mirror it.

    Attributes:
        x: In front of the trunk at the start, m.
        y: To the left of it, m.
        z: Above the floor, m.
    """

    x: Interval
    y: Interval
    z: Interval


class TargetConfig(FrozenModel):
    """The targets, one for each hand.

    Attributes:
        near: Greatest distance of a hand that counts as there, m.
        radius: Of the ball that is drawn, m.
        colors: By hand; `default` is that of all others.
        regions: By robot; `default` is that of all others.
    """

    near: PositiveFloat
    radius: Size
    colors: dict[str, tuple[Channel, Channel, Channel, Channel]]
    regions: dict[str, RegionConfig]

    _has_default = field_validator("colors", "regions")(with_default)


class RewardConfig(FrozenModel):
    """Numbers of the reward; see `Reach.progress`."""

    reach: float = Field(gt=0.0, lt=1.0)
    reach_scale: PositiveFloat


class ReachConfig(ObjectBenchmarkConfig):
    """`tasks/reach.toml`."""

    standing: StandingConfig
    target: TargetConfig
    reward: RewardConfig


class Reach(ObjectBenchmark):
    """Each hand is to be kept at its target while the robot stands on its feet.

    Args:
        path: `tasks/reach.toml`, or a file of the same form.

    Attributes:
        targets: The targets in the simulation, in the order of `hands`, after `bind`.
    """

    robots: Sequence[str] = ("GR1FreeBody",)
    needs_gripper = False

    def __init__(self, path: Source) -> None:
        self.config = load_config(ReachConfig, path)
        super().__init__(self.config)
        self.standing = Standing(self.config.standing)
        self.targets: list[ObjectState] = []

    def arrange(
        self, robots: Sequence[RobotDescription], configuration: str
    ) -> tuple[RobotDescription, ...]:
        """Return the robot, which needs a hand; see `arrange_on_feet`."""
        places = self.config.places
        return arrange_on_feet(self.name, robots, configuration, places, hands=1)

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add cameras."""
        self.standing.reserve(spec)
        add_floor_cameras(spec)

    def objects(self) -> Sequence[SceneObject]:
        """Return no objects; targets belong to hands, see `equip`."""
        return []

    def equip(self, spec: mujoco.MjSpec, robots: Sequence[RobotDescription]) -> None:
        """Add a ball without collisions, and a site, for each hand."""
        target, (robot,) = self.config.target, robots
        for hand in robot.hands:
            color = target.colors.get(hand, target.colors["default"])
            ball = Part(kind="ball", size=(target.radius,), color=color, solid=False)
            name, sites = _target(hand), {"site": (0.0, 0.0, 0.0)}
            SceneObject(name=name, parts=(ball,), sites=sites, motion="fixed").add_to(
                spec
            )

    def bind(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[RobotState]
    ) -> None:
        """Look up robot and targets."""
        super().bind(model, data, robots)
        self.standing.bind(model, data, robots[0])
        names = [_target(hand.name) for hand in self.hands]
        self.targets = [ObjectState(model, data, name) for name in names]

    def reset(self, rng: np.random.Generator) -> None:
        """Draw the targets."""
        robot, regions = self.standing.state.robot, self.config.target.regions
        region = regions.get(robot.name, regions["default"])
        for hand, target in zip(self.hands, self.targets, strict=True):
            side = -1.0 if hand.name == "left" else 1.0
            offset = np.array([rng.uniform(*e) for e in (region.x, region.y, region.z)])
            place = np.array([*robot.root.pos[:2], 0.0])
            target.move((place + [1.0, side, 1.0] * offset).tolist())

    def observables(self) -> dict[str, Reading]:
        """Return the targets, and their offset from the hands, m."""
        readings: dict[str, Reading] = {}
        pairs = enumerate(zip(self.sided_hands(), self.targets, strict=True))
        for k, ((side, _), target) in pairs:
            point = body_position(target.body)
            readings[f"{side}target_pos"] = point
            readings[f"{side}gripper_to_target_pos"] = self.offset_from_hand(k, point)
        return readings

    @property
    def distances(self) -> Vector:
        """Distance of each hand from its target, m."""
        places = [target.position for target in self.targets]
        return np.array([self.hand_distance(k, at) for k, at in enumerate(places)])

    def after_step(self) -> None:
        """Note a fall, and how long all hands have been at their targets."""
        near = bool((self.distances < self.config.target.near).all())
        self.standing.observe(near and self.standing.rests)

    def success(self) -> bool:
        """Whether all hands have stayed at their targets while the robot rested."""
        return self.standing.held

    def failure(self) -> str | None:
        """Return how the robot has fallen, or None."""
        return self.standing.fall()

    def progress(self) -> float:
        """Return the shaped reward.

        With the distances d of the hands from their targets, it is the mean of

            reach (1 - tanh(reach_scale d))
        """
        numbers = self.config.reward
        near = [1.0 - math.tanh(numbers.reach_scale * d) for d in self.distances]
        return numbers.reach * sum(near) / len(near)


def _target(hand: str) -> str:
    return f"target_{hand}"
