"""PickPlace: sort groceries from one bin into the quadrants of another."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

import mujoco
from pydantic import Field, PositiveFloat

from wbc_suite.benchmark.carrying import CarryingBenchmark, CarryingConfig
from wbc_suite.benchmark.object_benchmark import add_table_cameras, load_config
from wbc_suite.scene import objects
from wbc_suite.scene.furniture import BinConfig, ghost, standing_bin
from wbc_suite.scene.objects import Thing
from wbc_suite.scene.placement import Region, UniformSampler

__all__ = ["PickPlace", "PickPlaceConfig"]

MAKERS = {
    "Milk": objects.milk,
    "Bread": objects.bread,
    "Cereal": objects.cereal,
    "Can": objects.can,
}
GROCERIES = tuple(MAKERS)
QUADRANTS = {"Milk": (-1, -1), "Bread": (1, -1), "Cereal": (-1, 1), "Can": (1, 1)}
"""Which quarter of the second bin each belongs to, by the signs of x and y."""

Grocery = Literal["Milk", "Bread", "Cereal", "Can"]


class PickPlaceConfig(CarryingConfig):
    """`tasks/pick_place.toml`, and the variants that extend it.

    Attributes:
        objects: What is to be sorted.
        source: The bin where things start.
        target: The bin with the quadrants.
        region: Where in the first bin things start.
        height: A thing in the target is so little above its floor at most, m.
    """

    objects: Annotated[tuple[Grocery, ...], Field(min_length=1)]
    source: BinConfig
    target: BinConfig
    region: Region
    height: PositiveFloat


class PickPlace(CarryingBenchmark):
    """Each thing is to lie in its own quadrant of the second bin, the hand withdrawn.

    Source of geometry and reward: the benchmark of this name in robosuite 1.5, see
    `Lift`. What it leaves open is closed here: a thing that a hand still holds is not
    yet put down.

    Args:
        path: `tasks/pick_place.toml`, or a file of the same form.
    """

    def __init__(self, path: Path) -> None:
        self.config = load_config(PickPlaceConfig, path)
        floor = self.config.target.center[2]
        super().__init__(self.config, self.config.objects, floor=floor)

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add bins, cameras, and likenesses of the things where they belong."""
        source, target = self.config.source, self.config.target
        standing_bin("bin1", source).add_to(spec)
        standing_bin("bin2", target, quadrants=True).add_to(spec)
        for name in self.config.objects:
            x, y = self.goal(name)
            thing = MAKERS[name](name)
            at = (x, y, target.center[2] + REST[name])
            ghost(thing, f"{name}_goal", at).add_to(spec)
        middle = [
            (a + b) / 2 for a, b in zip(source.center, target.center, strict=True)
        ]
        add_table_cameras(spec, (middle[0] + 0.1, middle[1], middle[2]))

    def things(self) -> Sequence[Thing]:
        """Return the groceries."""
        return [MAKERS[name](name) for name in self.config.objects]

    def starts(self) -> UniformSampler:
        """Return a sampler of the first bin."""
        return UniformSampler(
            names=self.active,
            region=self.config.region,
            origin=self.config.source.center,
        )

    def goal(self, name: str) -> tuple[float, float]:
        """Return the middle of a thing's quadrant, m."""
        (x, y, _), (length, width, _) = (
            self.config.target.center,
            self.config.target.size,
        )
        side, end = QUADRANTS[name]
        return x + side * length / 4, y + end * width / 4

    def lies(self, name: str) -> bool:
        """Whether a thing is low in its quadrant."""
        height = float(self.states[name].position[2]) - self.config.target.center[2]
        return self.is_over(name) and 0.0 < height < self.config.height

    def is_over(self, name: str) -> bool:
        """Whether a thing's origin is in its quadrant, or above that."""
        x, y, _ = self.states[name].position.tolist()
        gx, gy = self.goal(name)
        length, width, _ = self.config.target.size
        return abs(x - gx) < length / 4 and abs(y - gy) < width / 4


REST = {"Milk": 0.065, "Bread": 0.022, "Cereal": 0.060, "Can": 0.0425}
"""Height of each thing's origin when it stands, m."""
