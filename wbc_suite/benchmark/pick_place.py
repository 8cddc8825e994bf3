"""PickPlace: sort groceries from one bin into the quadrants of another."""

from collections.abc import Sequence
from typing import Annotated, Literal

import mujoco
import numpy as np
from pydantic import Field, PositiveFloat

from wbc_suite.benchmark.base import Source, load_config
from wbc_suite.benchmark.object_benchmark import ObjectBenchmark, ObjectBenchmarkConfig
from wbc_suite.benchmark.sorting import Sorting
from wbc_suite.benchmark.staged_reward import StagedReward
from wbc_suite.scene import add_table_cameras, objects
from wbc_suite.scene.furniture import BinConfig, ghost, standing_bin
from wbc_suite.scene.objects import SceneObject
from wbc_suite.scene.placement import Region, UniformSampler
from wbc_suite.sensing.reading import Reading

MAKERS = {
    "Milk": objects.milk,
    "Bread": objects.bread,
    "Cereal": objects.cereal,
    "Can": objects.can,
}
GROCERIES = tuple(MAKERS)
QUADRANTS = {"Milk": (-1, -1), "Bread": (1, -1), "Cereal": (-1, 1), "Can": (1, 1)}
"""Quadrant of each object in the second bin, by the signs of x and y."""
REST = {"Milk": 0.065, "Bread": 0.022, "Cereal": 0.060, "Can": 0.0425}
"""Height of the origin of each object at rest, m."""

Grocery = Literal["Milk", "Bread", "Cereal", "Can"]


class PickPlaceConfig(ObjectBenchmarkConfig):
    """`tasks/pick_place.toml`, and the variants that extend it.

    Attributes:
        pick_one: Whether each episode has one of the objects, drawn at reset.
        target: The bin with the quadrants.
        region: Region of the `source` bin where objects start.
        lift_height: Height to which lifting is rewarded, above the target bin, m.
    """

    pick_one: bool = False
    objects: Annotated[tuple[Grocery, ...], Field(min_length=1)]
    source: BinConfig
    target: BinConfig
    region: Region
    lift_height: PositiveFloat
    stages: StagedReward


class PickPlace(ObjectBenchmark):
    """Each object is to lie in its own quadrant of the second bin, the hand withdrawn.

    Source of geometry and reward: robosuite 1.5, see `Lift`. Unlike there, an
    object that a hand still holds is not placed, nor one that flies, rolls or
    hangs over a wall.
    """

    def __init__(self, path: Source) -> None:
        self.config = config = load_config(PickPlaceConfig, path)
        super().__init__(config)
        length, width, _ = config.target.size
        self.sorting = Sorting(
            self,
            {name: self.goal(name) for name in config.objects},
            within=lambda dx, dy: abs(dx) < length / 4 and abs(dy) < width / 4,
            placed=self._is_in_quadrant,
            grip=lambda name: self.states[name].position,
            floor=config.target.center[2],
            **config.model_dump(include={"lift_height", "pick_one"}),
            stages=config.stages,
        )

    @property
    def things(self) -> Sequence[str]:
        """Names of the objects of this episode."""
        return self.sorting.active

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add bins, cameras, and translucent copies of the objects at their goals."""
        source, target = self.config.source, self.config.target
        standing_bin("bin1", source).add_to(spec)
        standing_bin("bin2", target, quadrants=True).add_to(spec)
        for name in self.config.objects:
            x, y = self.goal(name)
            at = (x, y, target.center[2] + REST[name])
            ghost(MAKERS[name](name), f"{name}_goal", at).add_to(spec)
        x, y, z = (np.add(source.center, target.center) / 2).tolist()
        add_table_cameras(spec, (x + 0.1, y, z))

    def objects(self) -> Sequence[SceneObject]:
        """Return the groceries."""
        return [MAKERS[name](name) for name in self.config.objects]

    def reset(self, rng: np.random.Generator) -> None:
        """Place the objects in the first bin; with `pick_one`, one of them."""
        self.park(self.sorting.draw(rng))
        region, origin = self.config.region, self.config.source.center
        in_bin = UniformSampler(names=self.sorting.active, region=region, origin=origin)
        self.place_objects(rng, self.sampler or in_bin)

    def observables(self) -> dict[str, Reading]:
        """Return the poses of the objects; see `Sorting`."""
        return self.sorting.observables()

    def goal(self, name: str) -> tuple[float, float]:
        """Return the middle of an object's quadrant, m."""
        x, y, _ = self.config.target.center
        length, width, _ = self.config.target.size
        side, end = QUADRANTS[name]
        return x + side * length / 4, y + end * width / 4

    def _is_in_quadrant(self, name: str) -> bool:
        length, width, _ = self.config.target.size
        floor = *self.goal(name), self.config.target.center[2]
        return self.scene.inside(name, floor, (length / 2, width / 2))

    def success(self) -> bool:
        """Whether each object lies in its quadrant; see `Sorting`."""
        return self.sorting.success()

    def progress(self) -> float:
        """Return the shaped reward; see `Sorting`."""
        return self.sorting.progress()
