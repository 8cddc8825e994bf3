"""Stack: put one cube on another."""

import math
from collections.abc import Sequence

import mujoco
from pydantic import NonNegativeFloat, PositiveFloat

from wbc_suite.benchmark.base import Source, load_config
from wbc_suite.benchmark.object_benchmark import ObjectBenchmark, ObjectBenchmarkConfig
from wbc_suite.config_files import FrozenModel
from wbc_suite.robot.elements import Channel
from wbc_suite.robot.shapes import Size
from wbc_suite.scene import TableConfig, add_table, add_table_cameras
from wbc_suite.scene.objects import SceneObject, box
from wbc_suite.scene.placement import Region, UniformSampler
from wbc_suite.sensing.reading import Reading, body_position, offset

A, B = "cubeA", "cubeB"


class BlockConfig(FrozenModel):
    """One cube."""

    half_size: Size
    color: tuple[Channel, Channel, Channel, Channel]


class RewardConfig(FrozenModel):
    """Numbers of the reward; see `Stack.progress`."""

    reach_scale: PositiveFloat
    reach: NonNegativeFloat
    grasp: NonNegativeFloat
    lift: NonNegativeFloat
    align: NonNegativeFloat
    success: PositiveFloat
    lift_height: PositiveFloat


class StackConfig(ObjectBenchmarkConfig):
    """`tasks/stack.toml`."""

    table: TableConfig
    cube_a: BlockConfig
    cube_b: BlockConfig
    region: Region
    reward: RewardConfig


class Stack(ObjectBenchmark):
    """The smaller cube A is to rest on the larger cube B.

    Source of geometry and reward: robosuite 1.5, see `Lift`. Unlike there, a cube that
    flies, slides past or tips over does not count.
    """

    def __init__(self, path: Source) -> None:
        self.config = load_config(StackConfig, path)
        super().__init__(self.config)
        self.sampler = UniformSampler(
            names=[A, B], region=self.config.region, origin=self.config.table.center
        )

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add table and cameras."""
        add_table(spec, self.config.table)
        add_table_cameras(spec, self.config.table.center)

    def objects(self) -> Sequence[SceneObject]:
        """Return both cubes."""
        pairs = ((A, self.config.cube_a), (B, self.config.cube_b))
        return [
            box(n, (c.half_size, c.half_size, c.half_size), color=c.color)
            for n, c in pairs
        ]

    def observables(self) -> dict[str, Reading]:
        """Return poses of both cubes, their offsets from each hand, and from A to B."""
        a, b = (body_position(self.states[name].body) for name in (A, B))
        return {**self.poses_of([A, B]), "cubeA_to_cubeB": offset(b, a)}

    def success(self) -> bool:
        """Whether A is on B alone, which is at rest too."""
        return self.scene.on(A, self.states[B].geoms) and self.scene.at_rest(B)

    def progress(self) -> float:
        """Return the shaped reward.

        With d the distance of the nearest hand to A, and s that of A's axis to B's:

            max(reach (1 - tanh(reach_scale d)) + grasp [two links touch A],
                lift + align (1 - tanh(s))      if A is `lift_height` above the table)
            / success
        """
        numbers, a = self.config.reward, self.states[A].position.tolist()
        near = 1.0 - math.tanh(numbers.reach_scale * self.distance(a))
        reward = numbers.reach * near + numbers.grasp * self.scene.grasped(A)
        lowest = self.config.table.center[2] + numbers.lift_height
        if a[2] > lowest + self.config.cube_a.half_size:
            b = self.states[B].position.tolist()
            aside = math.hypot(a[0] - b[0], a[1] - b[1])
            aligned = numbers.align * (1.0 - math.tanh(aside))
            reward = max(reward, numbers.lift + aligned)
        return reward / numbers.success
