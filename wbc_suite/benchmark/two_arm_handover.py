"""TwoArmHandover: pick a hammer up with one arm and hand it to the other."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat

from wbc_suite.benchmark.arrangement import Opposed
from wbc_suite.benchmark.base import Source, load_config
from wbc_suite.benchmark.object_benchmark import ObjectBenchmark, ObjectBenchmarkConfig
from wbc_suite.config_files import FrozenModel
from wbc_suite.control import RobotState
from wbc_suite.robot.shapes import Size, SizeInterval
from wbc_suite.scene import TableConfig, add_table, add_table_cameras, placement
from wbc_suite.scene.objects import SceneObject, hammer
from wbc_suite.scene.objects.tools import HAMMER_LYING
from wbc_suite.scene.placement import Placements, Region
from wbc_suite.sensing.reading import Reading, site_position

HAMMER, HANDLE = "hammer", "hammer_handle"


class HammerConfig(FrozenModel):
    """The hammer; sizes in m, the handle's drawn uniformly at each reset."""

    handle_radius: SizeInterval
    handle_length: SizeInterval
    head_half_size: Size
    mass: float = Field(gt=0.0, le=1e3)
    region: Region


class RewardConfig(FrozenModel):
    """Numbers of the reward; see `TwoArmHandover.progress`."""

    reach: NonNegativeFloat
    grasp: NonNegativeFloat
    lift: NonNegativeFloat
    both: NonNegativeFloat
    success: PositiveFloat
    lift_height: PositiveFloat


class TwoArmHandoverConfig(ObjectBenchmarkConfig):
    """`tasks/two_arm_handover.toml`."""

    opposed: Opposed
    apart: PositiveFloat
    table: TableConfig
    hammer: HammerConfig
    reward: RewardConfig


class TwoArmHandover(ObjectBenchmark):
    """Arm 0 picks a hammer up and hands it to arm 1, which alone holds it in the end.

    `data.userdata[0]` is 1 once both have held it in the air. Otherwise an arm that
    takes the hammer from the table by itself would succeed.

    Source of geometry and reward: robosuite 1.5, see `Lift`. Unlike there, a hand holds
    the hammer only if two fingers clamp it and it moves with the hand.
    """

    robots: Sequence[str] = ("Panda", "Panda")

    def __init__(self, path: Source) -> None:
        self.config = load_config(TwoArmHandoverConfig, path)
        super().__init__(self.config)
        self._head = 0.0
        on_table = placement.UniformSampler(
            names=[HAMMER],
            region=self.config.hammer.region,
            origin=self.config.table.center,
            rest=HAMMER_LYING,
        )
        self.sampler = placement.RejectionSampler(
            sampler=on_table, accepts=self._rests, wanted="its head lies on the table"
        )

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add table and cameras, and one entry of user data."""
        add_table(spec, self.config.table)
        add_table_cameras(spec, (0.0, 0.0, self.config.table.center[2]), before=1.2)
        spec.nuserdata += 1

    def objects(self) -> Sequence[SceneObject]:
        """Return the hammer, of middle size."""
        numbers = self.config.hammer
        radius, length = np.mean([numbers.handle_radius, numbers.handle_length], axis=1)
        return [self._hammer(float(radius), float(length))]

    def _hammer(self, radius: float, length: float) -> SceneObject:
        numbers = self.config.hammer
        return hammer(
            HAMMER,
            handle_radius=radius,
            handle_length=length,
            head_half_size=numbers.head_half_size,
            mass=numbers.mass,
        )

    def bind(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[RobotState]
    ) -> None:
        """Look up the hammer and its handle, which is its first part."""
        super().bind(model, data, robots)
        self._handle = {model.geom(f"{HAMMER}_0").id}

    def reset(self, rng: np.random.Generator) -> None:
        """Draw the hammer's size and place, and lay it on the table."""
        numbers = self.config.hammer
        radius = rng.uniform(*numbers.handle_radius)
        length = rng.uniform(*numbers.handle_length)
        drawn = self._hammer(radius, length)
        self.states[HAMMER].reshape(drawn)
        self.grasps[HAMMER] = drawn.grasps
        self._head = length / 2 + numbers.head_half_size
        super().reset(rng)

    def _rests(self, placements: Placements) -> bool:
        """Whether the middle of the head is above the table; otherwise it rolls off."""
        placed, table, head = placements[HAMMER], self.config.table, np.empty(3)
        mujoco.mju_rotVecQuat(head, np.array([0.0, 0.0, self._head]), placed.quat)
        offset = np.abs(placed.position + head - table.center)[:2]
        return bool((offset <= np.array(table.size[:2]) / 2).all())

    def after_step(self) -> None:
        """Set the user data when both arms hold the hammer in the air."""
        if self.raised and self.held_by_first and self.held_by_second:
            self.data.userdata[0] = 1.0

    @property
    def handed(self) -> bool:
        """Whether both arms have held the hammer in the air in this episode."""
        return self.data.userdata[0] > 0.0

    @property
    def raised(self) -> bool:
        """Whether the handle's middle is more than `lift_height` above the table."""
        height = float(self.site(HANDLE)[2]) - self.config.table.center[2]
        return height > self.config.reward.lift_height

    @property
    def held_by_first(self) -> bool:
        """Whether arm 0 holds the hammer anywhere."""
        return self.scene.holds(self.hands[0], HAMMER, self.states[HAMMER].geoms)

    @property
    def held_by_second(self) -> bool:
        """Whether arm 1 holds the handle."""
        return self.scene.holds(self.hands[1], HAMMER, self._handle)

    def observables(self) -> dict[str, Reading]:
        """Return the pose of the hammer, its handle, and its offset from each hand."""
        handle = site_position(self.model.site(HANDLE).id)
        return {
            **self.world_poses_of({"hammer": HAMMER}),
            "handle_xpos": handle,
            "gripper0_to_handle": self.offset_from_hand(0, handle),
            "gripper1_to_handle": self.offset_from_hand(1, handle),
        }

    def success(self) -> bool:
        """Whether arm 1 holds the handle in the air, touched by no other hand."""
        alone = self.scene.hands_at(HAMMER) == [self.hands[1]]
        return self.handed and self.raised and alone and self.held_by_second

    def progress(self) -> float:
        """Return the shaped reward.

        With d_i the distance of hand i to the handle's middle, it is, over `success`,

            both                                if both hold it in the air
            lift + reach (1 - tanh(d_1))        if arm 0 holds it in the air
            grasp                               if arm 0 holds it
            reach (1 - tanh(d_0))               else
        """
        numbers, handle = self.config.reward, self.site(HANDLE)
        if not self.held_by_first:
            reward = numbers.reach * (1.0 - math.tanh(self.hand_distance(0, handle)))
        elif not self.raised:
            reward = numbers.grasp
        elif self.held_by_second:
            reward = numbers.both
        else:
            near = 1.0 - math.tanh(self.hand_distance(1, handle))
            reward = numbers.lift + numbers.reach * near
        return reward / numbers.success
