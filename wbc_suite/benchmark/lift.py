"""Lift: pick a cube up from a table."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from pydantic import NonNegativeFloat, PositiveFloat

from wbc_suite.benchmark.base import Source, load_config
from wbc_suite.benchmark.object_benchmark import ObjectBenchmark, ObjectBenchmarkConfig
from wbc_suite.config_files import FrozenModel
from wbc_suite.robot.elements import Channel
from wbc_suite.robot.shapes import SizeInterval
from wbc_suite.scene import TableConfig, add_table, add_table_cameras
from wbc_suite.scene.objects import SceneObject, box
from wbc_suite.scene.placement import Region, UniformSampler
from wbc_suite.sensing.reading import Reading
from wbc_suite.typing import Vector

CUBE = "cube"


class CubeConfig(FrozenModel):
    """The cube; half sizes in m, drawn uniformly at each reset."""

    half_size: SizeInterval
    region: Region
    color: tuple[Channel, Channel, Channel, Channel]


class RewardConfig(FrozenModel):
    """Numbers of the reward; see `Lift.progress`."""

    reach_scale: PositiveFloat
    grasp: NonNegativeFloat
    success: PositiveFloat
    lift_height: PositiveFloat


class LiftConfig(ObjectBenchmarkConfig):
    """`tasks/lift.toml`."""

    table: TableConfig
    cube: CubeConfig
    reward: RewardConfig


class Lift(ObjectBenchmark):
    """A cube on a table is to be lifted 4 cm by a hand.

    Source of geometry and reward: Zhu et al. (2020), "robosuite: A Modular Simulation
    Framework and Benchmark for Robot Learning", arXiv:2009.12293, and its release 1.5.
    Unlike there, a cube that is thrown or batted up is not lifted: a hand must hold it.
    """

    grip_angle = math.radians(160.0)  # from an edge, the cube slips away in 0.1 s

    def __init__(self, path: Source) -> None:
        self.config = load_config(LiftConfig, path)
        super().__init__(self.config)
        table, cube = self.config.table, self.config.cube
        self.sampler = UniformSampler(
            names=[CUBE], region=cube.region, origin=table.center
        )

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add table and cameras."""
        add_table(spec, self.config.table)
        add_table_cameras(spec, self.config.table.center)

    def objects(self) -> Sequence[SceneObject]:
        """Return the cube, of mean size."""
        cube = self.config.cube
        half = float(np.mean(cube.half_size))
        return [box(CUBE, (half, half, half), color=cube.color)]

    def reset(self, rng: np.random.Generator) -> None:
        """Draw size and pose of the cube on the table."""
        half = rng.uniform(*self.config.cube.half_size)
        self.states[CUBE].reshape(box(CUBE, (half, half, half)))
        super().reset(rng)

    def observables(self) -> dict[str, Reading]:
        """Return the cube's pose (quaternion x y z w) and its offset from each hand."""
        return self.poses_of([CUBE], to="_pos")

    @property
    def cube_position(self) -> Vector:
        """Middle of the cube in the world, m. A view."""
        return self.states[CUBE].position

    def success(self) -> bool:
        """Whether a hand holds the cube, its middle `lift_height` above the table."""
        height = self.cube_position.item(2) - self.config.table.center[2]
        return height > self.config.reward.lift_height and self.scene.held(CUBE)

    def progress(self) -> float:
        """Return the shaped reward.

        With d the distance of the nearest hand, it is

            (1 - tanh(reach_scale d) + grasp [two links touch the cube]) / success
        """
        numbers = self.config.reward
        distance = self.distance(self.cube_position)
        reward = 1.0 - math.tanh(numbers.reach_scale * distance)
        if self.scene.grasped(CUBE):
            reward += numbers.grasp
        return reward / numbers.success
