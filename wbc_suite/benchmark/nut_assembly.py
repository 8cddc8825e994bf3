"""NutAssembly: put nuts over their pegs."""

import math
from collections.abc import Sequence
from typing import Annotated, Literal

import mujoco
import numpy as np
from pydantic import Field, PositiveFloat

from wbc_suite.benchmark.base import Source, load_config
from wbc_suite.benchmark.object_benchmark import ObjectBenchmark, ObjectBenchmarkConfig
from wbc_suite.benchmark.predicates import crossing
from wbc_suite.benchmark.sorting import Sorting
from wbc_suite.benchmark.staged_reward import StagedReward
from wbc_suite.config_files import FrozenModel
from wbc_suite.robot.shapes import Real, Size
from wbc_suite.scene import TableConfig, add_table, add_table_cameras, objects
from wbc_suite.scene.furniture import peg
from wbc_suite.scene.objects import Part, SceneObject
from wbc_suite.scene.placement import Region, SequentialSampler, UniformSampler
from wbc_suite.sensing.reading import Reading

MAKERS = {"SquareNut": objects.square_nut, "RoundNut": objects.round_nut}
UP = np.array([0.0, 0.0, 1.0])
BROWN, GREY = (0.66, 0.44, 0.24, 1.0), (0.58, 0.60, 0.63, 1.0)

Nut = Literal["SquareNut", "RoundNut"]


class PegsConfig(FrozenModel):
    """The pegs; sizes in m, places from the middle of the table's top."""

    half_width: Size
    radius: Size
    height: Size
    square: tuple[Real, Real]
    round: tuple[Real, Real]


class NutAssemblyConfig(ObjectBenchmarkConfig):
    """`tasks/nut_assembly.toml`, and the variants that extend it.

    Attributes:
        pick_one: Whether each episode has one of the nuts, drawn at reset.
        regions: Region where each nut starts, from the middle of the table's top.
        aside: Largest distance of a placed nut's middle from the axis of its peg, m.
        height: Largest height of a placed nut's middle above the table, m.
        tilt: Largest angle of a placed nut's axis to its peg's, rad.
        lift_height: Height to which lifting is rewarded, above the table, m.
    """

    pick_one: bool = False
    nuts: Annotated[tuple[Nut, ...], Field(min_length=1)]
    table: TableConfig
    pegs: PegsConfig
    regions: dict[Nut, Region]
    aside: PositiveFloat
    height: PositiveFloat
    tilt: PositiveFloat
    lift_height: PositiveFloat
    stages: StagedReward


class NutAssembly(ObjectBenchmark):
    """Each nut is to lie around its peg, the hand withdrawn.

    A nut that lies flat, so low and so near to the axis of its peg, has the peg in its
    hole: there is no other room for it.

    Source of geometry and reward: robosuite 1.5, see `Lift`. Unlike there, a nut on its
    edge beside the peg is not placed, nor one that a hand still holds.
    """

    def __init__(self, path: Source) -> None:
        self.config = config = load_config(NutAssemblyConfig, path)
        super().__init__(config)
        self.sorting = Sorting(
            self,
            {name: self.goal(name) for name in config.nuts},
            within=lambda dx, dy: math.hypot(dx, dy) < config.aside,
            placed=self._is_around_peg,
            grip=lambda name: self.site(f"{name}_handle"),
            floor=config.table.center[2],
            **config.model_dump(include={"lift_height", "pick_one"}),
            stages=config.stages,
        )

    def _is_around_peg(self, name: str) -> bool:
        """Whether a nut is low and flat, and its peg's axis goes through its hole."""
        state, config = self.states[name], self.config
        foot = np.array([*self.goal(name), config.table.center[2]])
        x, y, share = crossing(foot, foot + UP, state.position, state.rotation)
        return (
            math.hypot(x, y) < config.aside
            and 0.0 < share < config.height
            and self.scene.upright(name, config.tilt, flipped=True)
        )

    @property
    def things(self) -> Sequence[str]:
        """Names of the nuts of this episode."""
        return self.sorting.active

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add table, pegs and cameras."""
        table, pegs = self.config.table, self.config.pegs
        add_table(spec, table)
        x, y, z = table.center
        half, width, radius = pegs.height / 2, pegs.half_width, pegs.radius
        square = Part(
            kind="box", size=(width, width, half), color=BROWN, material="wood"
        )
        round_ = Part(
            kind="cylinder", size=(radius, half), color=GREY, material="metal"
        )
        for name, part, (dx, dy) in (
            ("square_peg", square, pegs.square),
            ("round_peg", round_, pegs.round),
        ):
            peg(name, part, (x + dx, y + dy, z)).add_to(spec)
        add_table_cameras(spec, table.center)

    def objects(self) -> Sequence[SceneObject]:
        """Return the nuts."""
        return [MAKERS[name](name) for name in self.config.nuts]

    def reset(self, rng: np.random.Generator) -> None:
        """Place each nut in its region; with `pick_one`, one of them."""
        self.park(self.sorting.draw(rng))
        regions, origin = self.config.regions, self.config.table.center
        samplers = [
            UniformSampler(names=[name], region=regions[name], origin=origin)
            for name in self.config.nuts
            if name in self.sorting.active
        ]
        self.place_objects(rng, self.sampler or SequentialSampler(samplers=samplers))

    def observables(self) -> dict[str, Reading]:
        """Return the poses of the objects; see `Sorting`."""
        return self.sorting.observables()

    def goal(self, name: str) -> tuple[float, float]:
        """Return the place of a nut's peg, m."""
        x, y, _ = self.config.table.center
        pegs = self.config.pegs
        dx, dy = pegs.square if name == "SquareNut" else pegs.round
        return x + dx, y + dy

    def success(self) -> bool:
        """Whether each nut lies around its peg; see `Sorting`."""
        return self.sorting.success()

    def progress(self) -> float:
        """Return the shaped reward; see `Sorting`."""
        return self.sorting.progress()
