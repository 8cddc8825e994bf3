"""Carry: carry a pot with both hands from one table to another."""

import math
from collections.abc import Sequence
from typing import ClassVar

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
    arrange_on_feet,
)
from wbc_suite.benchmark.two_arm_lift import HANDLES, POT, WALL, PotConfig
from wbc_suite.config_files import FrozenModel
from wbc_suite.control import RobotState
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.shapes import Vector3
from wbc_suite.scene import TableConfig, add_camera, add_tables
from wbc_suite.scene.objects import SceneObject, pot
from wbc_suite.scene.placement import UniformSampler
from wbc_suite.sensing.reading import (
    Reading,
    body_position,
    body_quat,
    computed,
    offset,
    site_position,
)
from wbc_suite.typing import Vector

FROM, TO, FLOOR = "table_from", "table_to", "floor"
ALONE, SPOILED, MEMORY = 0, 1, 2
"""Places of the benchmark's own user data, and their number: when the pot began to lack
a hand, s, 0 if it does not; whether it was not carried."""


class CarryingConfig(FrozenModel):
    """What counts as carried and put down.

    Attributes:
        alone: Time for which a pot off the tables may lack a hand, s.
        tilt: Greatest tilt of the pot when it is put down, rad.
        margin: Least distance of the pot's middle from the table's edges, m.
    """

    alone: PositiveFloat
    tilt: PositiveFloat
    margin: PositiveFloat


class RewardConfig(SharesOfOne):
    """Numbers of the reward; see `Carry.progress`."""

    shares = ("reach", "hold", "carry", "place")

    reach: NonNegativeFloat
    hold: NonNegativeFloat
    carry: NonNegativeFloat
    place: NonNegativeFloat
    reach_scale: PositiveFloat


class CarryConfig(ObjectBenchmarkConfig):
    """`tasks/carry.toml`.

    Attributes:
        table: Size and friction of both tables, and the middle of the first.
        other: Middle of the second table's top, m.
        pot: The pot; its region is relative to the middle of the first table's top.
        standing: Falls and rest.
        carrying: What counts as carried.
        reward: Numbers of the reward.
    """

    one_table: ClassVar[bool] = False
    table: TableConfig
    other: Vector3
    pot: PotConfig
    standing: StandingConfig
    carrying: CarryingConfig
    reward: RewardConfig


class Carry(ObjectBenchmark):
    """A pot is to be carried by two hands, and to be put down on the other table.

    A pot that is thrown, dropped or carried by one hand does not count until it stands
    on the first table again.

    Args:
        path: `tasks/carry.toml`, or a file of the same form.
    """

    robots: Sequence[str] = ("GR1FreeBody",)

    def __init__(self, path: Source) -> None:
        self.config = load_config(CarryConfig, path)
        super().__init__(self.config)
        self.standing = Standing(self.config.standing)
        self.sampler = UniformSampler(
            names=[POT], region=self.config.pot.region, origin=self.config.table.center
        )

    def arrange(
        self, robots: Sequence[RobotDescription], configuration: str
    ) -> tuple[RobotDescription, ...]:
        """Return the robot, which needs two hands; see `arrange_on_feet`."""
        places = self.config.places
        return arrange_on_feet(self.name, robots, configuration, places, hands=2)

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add the tables and cameras."""
        self.standing.reserve(spec)
        self._entry = spec.nuserdata
        spec.nuserdata += MEMORY
        centers = {FROM: self.config.table.center, TO: self.config.other}
        add_tables(spec, self.config.table, centers)
        x, y, z = (0.5 * (a + b) for a, b in zip(*centers.values(), strict=True))
        middle = (x - 0.3, y, z)
        add_camera(spec, "agentview", (x + 3.0, y - 1.5, z + 1.6), middle)
        add_camera(spec, "frontview", (x + 3.5, y, z + 1.0), middle)
        add_camera(spec, "sideview", (x, y - 3.8, z + 1.0), middle)
        add_camera(spec, "birdview", (x, y, z + 4.5), (x, y, z))

    def objects(self) -> Sequence[SceneObject]:
        """Return the pot."""
        numbers = self.config.pot
        sizes = numbers.model_dump(exclude={"mass", "region"})
        return [pot(POT, wall=WALL, **sizes).with_mass(numbers.mass)]

    def bind(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[RobotState]
    ) -> None:
        """Look up robot, pot, tables and floor."""
        super().bind(model, data, robots)
        self.standing.bind(model, data, robots[0])
        self._supports = {model.geom(name).id for name in (FROM, TO, FLOOR)}
        self._from, self._to = model.geom(FROM).id, model.geom(TO).id
        self._memory: Vector = data.userdata[self._entry : self._entry + MEMORY]

    def observables(self) -> dict[str, Reading]:
        """Return the poses of the pot and its handles, and the ways that are left.

        Keys: `pot_pos`, `pot_quat` (x y z w), `handle0_xpos`, `handle1_xpos`,
        `{side}_gripper_to_handle0`, ..., and `pot_to_goal` in world axes, m.
        """
        body = self.states[POT].body
        goal = computed(3, lambda: self.config.other)
        place = body_position(body)
        readings = {"pot_pos": place, "pot_quat": body_quat(body)}
        for k, name in enumerate(HANDLES):
            point = site_position(self.model.site(name).id)
            readings[f"handle{k}_xpos"] = point
            for index, hand in enumerate(self.hands):
                key = f"{hand.name}_gripper_to_handle{k}"
                readings[key] = self.offset_from_hand(index, point)
        return readings | {"pot_to_goal": offset(goal, place)}

    @property
    def carried(self) -> bool:
        """Whether the pot has been moved by two hands alone."""
        return not self._memory[SPOILED]

    def hands_at_pot(self) -> int:
        """Return how many hands touch the pot."""
        return len(self.scene.hands_at(POT))

    def supports(self) -> set[int]:
        """Return which of the tops and the floor the pot touches, by their geoms."""
        return self.scene.touched_by(POT) & self._supports

    def after_step(self) -> None:
        """Note falls, how the pot is moved, and how long it has been put down."""
        below = self.supports()
        alone = not below and self.hands_at_pot() < len(self.hands)
        now = self.data.time
        self._memory[ALONE] = (self._memory.item(ALONE) or now) if alone else 0.0
        long = now - self._memory[ALONE] >= self.config.carrying.alone - ROUNDING
        if below == {self._from}:
            self._memory[SPOILED] = 0.0
        elif (alone and long) or below - {self._from, self._to}:
            self._memory[SPOILED] = 1.0
        down = self.carried and self.is_put_down()
        self.standing.observe(down and self.standing.stands)

    def is_put_down(self) -> bool:
        """Whether the pot is at rest on the other table alone, and upright."""
        numbers, state = self.config.carrying, self.states[POT]
        aside = np.abs(state.position - self.config.other)[:2]
        edges = np.array(self.config.table.size[:2]) / 2 - numbers.margin
        inside = bool((aside < edges).all())
        return (
            inside
            and self.scene.upright(POT, numbers.tilt)
            and self.scene.on(POT, {self._to})
        )

    def success(self) -> bool:
        """Whether the carried pot has stood on the other table, and the robot too."""
        return self.standing.held

    def failure(self) -> str | None:
        """Return how the robot has fallen, or None."""
        return self.standing.fall()

    def progress(self) -> float:
        """Return the shaped reward.

        With the distances d of the hands from the handles next to them, the number n of
        hands at the pot and the share s of the way to the other table that is done,

            mean of reach (1 - tanh(reach_scale d)) + hold n / 2
            + (carry s + place [the pot is put down]) [it has been carried]
        """
        numbers, at = self.config.reward, self.states[POT].position
        bars = [self.site(name) for name in HANDLES]
        near = [
            1.0
            - math.tanh(
                numbers.reach_scale * min(self.hand_distance(k, p) for p in bars)
            )
            for k in range(len(self.hands))
        ]
        reward = numbers.reach * sum(near) / len(near)
        reward += numbers.hold * self.hands_at_pot() / len(self.hands)
        if self.carried:
            start, goal = self.config.table.center, self.config.other
            left = math.dist(at[:2], goal[:2]) / math.dist(start[:2], goal[:2])
            reward += numbers.carry * min(max(1.0 - left, 0.0), 1.0)
            reward += numbers.place * self.is_put_down()
        return reward
