"""NutAssembly: put nuts over their pegs."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

import mujoco
from pydantic import Field, PositiveFloat

from wbc_suite.benchmark.carrying import CarryingBenchmark, CarryingConfig
from wbc_suite.benchmark.object_benchmark import add_table_cameras, load_config
from wbc_suite.robot.shapes import Real, Size
from wbc_suite.scene import TableConfig, add_table, objects
from wbc_suite.scene.furniture import peg
from wbc_suite.scene.objects import Part, Thing
from wbc_suite.scene.placement import Region, SequentialSampler, UniformSampler
from wbc_suite.tomlfile import FrozenModel

__all__ = ["NutAssembly", "NutAssemblyConfig"]

MAKERS = {"SquareNut": objects.square_nut, "RoundNut": objects.round_nut}
PEGS = {"SquareNut": "square_peg", "RoundNut": "round_peg"}

Nut = Literal["SquareNut", "RoundNut"]


class PegsConfig(FrozenModel):
    """The pegs; sizes in m, places from the middle of the table's top."""

    half_width: Size
    radius: Size
    height: Size
    square: tuple[Real, Real]
    round: tuple[Real, Real]


class NutAssemblyConfig(CarryingConfig):
    """`tasks/nut_assembly.toml`, and the variants that extend it.

    Attributes:
        nuts: What is to be put over its peg.
        table: The table.
        pegs: The pegs on it.
        regions: Where each nut starts, from the middle of the table's top.
        aside: Distance of a nut's middle from its peg's axis at most, m.
        height: Of a nut's middle above the table at most, m.
    """

    nuts: Annotated[tuple[Nut, ...], Field(min_length=1)]
    table: TableConfig
    pegs: PegsConfig
    regions: dict[Nut, Region]
    aside: PositiveFloat
    height: PositiveFloat


class NutAssembly(CarryingBenchmark):
    """Each nut is to lie around its peg, the hand withdrawn.

    Source of geometry and reward: the benchmark of this name in robosuite 1.5, see
    `Lift`.

    Args:
        path: `tasks/nut_assembly.toml`, or a file of the same form.
    """

    def __init__(self, path: Path) -> None:
        self.config = load_config(NutAssemblyConfig, path)
        floor = self.config.table.center[2]
        super().__init__(self.config, self.config.nuts, floor=floor)

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add table, pegs and cameras."""
        table, pegs = self.config.table, self.config.pegs
        add_table(spec, table)
        x, y, z = table.center
        half = pegs.height / 2
        square = Part(
            kind="box",
            size=(pegs.half_width, pegs.half_width, half),
            color=(0.66, 0.44, 0.24, 1.0),
            material="wood",
        )
        round_ = Part(
            kind="cylinder",
            size=(pegs.radius, half),
            color=(0.58, 0.60, 0.63, 1.0),
            material="metal",
        )
        for name, part, at in (
            ("square_peg", square, pegs.square),
            ("round_peg", round_, pegs.round),
        ):
            peg(name, part, (x + at[0], y + at[1], z)).add_to(spec)
        add_table_cameras(spec, table.center)

    def things(self) -> Sequence[Thing]:
        """Return the nuts."""
        return [MAKERS[name](name) for name in self.config.nuts]

    def starts(self) -> SequentialSampler:
        """Return a sampler of each nut's own region."""
        samplers = [
            UniformSampler(
                names=[name],
                region=self.config.regions[name],
                origin=self.config.table.center,
            )
            for name in self.config.nuts
            if name in self.active
        ]
        return SequentialSampler(samplers=samplers)

    def goal(self, name: str) -> tuple[float, float]:
        """Return where a nut's peg stands, m."""
        x, y, _ = self.config.table.center
        pegs = self.config.pegs
        dx, dy = pegs.square if PEGS[name] == "square_peg" else pegs.round
        return x + dx, y + dy

    def lies(self, name: str) -> bool:
        """Whether a nut lies around its peg."""
        height = self.states[name].position.item(2) - self.config.table.center[2]
        return 0.0 < height < self.config.height and self.is_over(name)

    def is_over(self, name: str) -> bool:
        """Whether a nut's middle is near its peg's axis."""
        x, y, _ = self.states[name].position.tolist()
        gx, gy = self.goal(name)
        return math.hypot(x - gx, y - gy) < self.config.aside

    def hand_distance(self, name: str) -> float:
        """Return how far the nearest hand is from a nut's handle, m."""
        return self.distance(self.site(f"{name}_handle"))
