"""LocoLift: walk to a table and pick a cube up from it."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from pydantic import NonNegativeFloat, PositiveFloat

from wbc_suite.benchmark.base import Source, load_config
from wbc_suite.benchmark.lift import CUBE, CubeConfig
from wbc_suite.benchmark.object_benchmark import ObjectBenchmark, ObjectBenchmarkConfig
from wbc_suite.benchmark.reward_terms import SharesOfOne
from wbc_suite.benchmark.standing import (
    Standing,
    StandingConfig,
    StartConfig,
    arrange_on_feet,
)
from wbc_suite.control import RobotState
from wbc_suite.robot import RobotDescription
from wbc_suite.scene import TableConfig, add_table, add_table_cameras
from wbc_suite.scene.materials import MATERIALS
from wbc_suite.scene.objects import SceneObject, box
from wbc_suite.scene.placement import UniformSampler
from wbc_suite.sensing.reading import Reading, computed


class RewardConfig(SharesOfOne):
    """Numbers of the reward; see `LocoLift.progress`."""

    shares = ("approach", "reach", "grasp", "lift")

    approach: NonNegativeFloat
    reach: NonNegativeFloat
    grasp: NonNegativeFloat
    lift: NonNegativeFloat
    approach_scale: PositiveFloat
    reach_scale: PositiveFloat
    lift_height: PositiveFloat
    speed: PositiveFloat


class LocoLiftConfig(ObjectBenchmarkConfig):
    """`tasks/loco_lift.toml`."""

    table: TableConfig
    cube: CubeConfig
    start: StartConfig
    standing: StandingConfig
    reward: RewardConfig


class LocoLift(ObjectBenchmark):
    """The robot is to walk to a table, and to hold the cube 4 cm above it, standing.

    Args:
        path: `tasks/loco_lift.toml`, or a file of the same form.
    """

    robots: Sequence[str] = ("SpotWithArm",)

    def __init__(self, path: Source) -> None:
        self.config = load_config(LocoLiftConfig, path)
        super().__init__(self.config)
        self.standing = Standing(self.config.standing)
        self.sampler = UniformSampler(
            names=[CUBE],
            region=self.config.cube.region,
            origin=self.config.table.center,
        )

    def arrange(
        self, robots: Sequence[RobotDescription], configuration: str
    ) -> tuple[RobotDescription, ...]:
        """Return the robot, which needs a hand; see `arrange_on_feet`."""
        places = self.config.places
        return arrange_on_feet(self.name, robots, configuration, places, hands=1)

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add table and cameras."""
        self.standing.reserve(spec)
        add_table(spec, self.config.table)
        add_table_cameras(spec, self.config.table.center)

    def objects(self) -> Sequence[SceneObject]:
        """Return the cube, of mean size."""
        cube = self.config.cube
        half = float(np.mean(cube.half_size))
        return [box(CUBE, (half, half, half), color=cube.color)]

    def bind(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[RobotState]
    ) -> None:
        """Look up robot and cube."""
        super().bind(model, data, robots)
        self.standing.bind(model, data, robots[0])
        first = model.joint(f"{CUBE}_joint").dofadr[0]
        self._cube_velocity = data.qvel[first : first + 3]

    def reset(self, rng: np.random.Generator) -> None:
        """Draw where the robot starts, and size and pose of the cube."""
        (x, y, _), (length, _, _) = self.config.table.center, self.config.table.size
        self.standing.start_before((x - length / 2, y), self.config.start, rng)
        half = rng.uniform(*self.config.cube.half_size)
        density = MATERIALS["wood"].density
        self.states[CUBE].resize_box((half, half, half), density=density)
        super().reset(rng)

    def observables(self) -> dict[str, Reading]:
        """Return the cube's pose, its offset from each hand, and the way to it.

        `robot_to_cube` is the way from the trunk, forward and left, m, in the heading
        of the robot.
        """
        at = self.states[CUBE].position
        to_cube = computed(2, lambda: self.standing.offset_to(at.item(0), at.item(1)))
        return {**self.poses_of([CUBE], to="_pos"), "robot_to_cube": to_cube}

    @property
    def height(self) -> float:
        """Height of the cube's middle above the table, m."""
        return self.states[CUBE].position.item(2) - self.config.table.center[2]

    def after_step(self) -> None:
        """Note a fall, and how long the robot has held the cube up, standing."""
        numbers = self.config.reward
        slow = float(np.linalg.norm(self._cube_velocity)) < numbers.speed
        high = self.height > numbers.lift_height
        held = high and slow and self.scene.held(CUBE)
        self.standing.observe(held and self.standing.stands)

    def success(self) -> bool:
        """Whether the robot has held the cube up and still, standing on its feet."""
        return self.standing.held

    def failure(self) -> str | None:
        """Return how the robot has fallen, or None."""
        return self.standing.fall()

    def progress(self) -> float:
        """Return the shaped reward.

        With d the distance of the nearest hand from the cube, and h the cube's height
        above the table, it is

            approach (1 - tanh(approach_scale d)) + reach (1 - tanh(reach_scale d))
            + (grasp + lift clip(h / lift_height, 0, 1)) [two links touch the cube]
        """
        numbers, d = self.config.reward, self.distance(self.states[CUBE].position)
        reward = numbers.approach * (1.0 - math.tanh(numbers.approach_scale * d))
        reward += numbers.reach * (1.0 - math.tanh(numbers.reach_scale * d))
        if self.scene.grasped(CUBE):
            share = min(max(self.height / numbers.lift_height, 0.0), 1.0)
            reward += numbers.grasp + numbers.lift * share
        return reward
