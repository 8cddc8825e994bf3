"""TwoArmLift: lift a pot by both handles, without tilting it."""

import math
from collections.abc import Sequence

import mujoco
from pydantic import Field, NonNegativeFloat, PositiveFloat, field_validator

from wbc_suite.benchmark.arrangement import Opposed
from wbc_suite.benchmark.base import Source, load_config
from wbc_suite.benchmark.object_benchmark import ObjectBenchmark, ObjectBenchmarkConfig
from wbc_suite.config_files import FrozenModel
from wbc_suite.control import RobotState
from wbc_suite.robot.shapes import Size
from wbc_suite.scene import TableConfig, add_table, add_table_cameras
from wbc_suite.scene.objects import SceneObject, pot
from wbc_suite.scene.placement import Region, UniformSampler
from wbc_suite.sensing.reading import Reading, site_position

POT, HANDLES = "pot", ("pot_handle0", "pot_handle1")
WALL = 0.006
"""Thickness of the pot's walls, m."""


class PotConfig(FrozenModel):
    """The pot; sizes in m, see `scene.objects.pot`; mass in kg."""

    half_size: tuple[Size, Size, Size]
    handle_length: Size
    handle_width: Size
    handle_radius: Size
    mass: float = Field(gt=0.0, le=1e3)
    region: Region

    @field_validator("half_size")
    @classmethod
    def _has_room_for_walls(
        cls, sizes: tuple[float, float, float]
    ) -> tuple[float, float, float]:
        if min(sizes) <= 2 * WALL:
            raise ValueError(f"half sizes must be more than {2 * WALL} m")
        return sizes


class RewardConfig(FrozenModel):
    """Numbers of the reward; see `TwoArmLift.progress`."""

    reach: NonNegativeFloat
    reach_scale: PositiveFloat
    grasp: NonNegativeFloat
    lift_scale: NonNegativeFloat
    lift_from: NonNegativeFloat
    lift_most: NonNegativeFloat
    success: PositiveFloat
    lift_height: PositiveFloat
    tilt: PositiveFloat


class TwoArmLiftConfig(ObjectBenchmarkConfig):
    """`tasks/two_arm_lift.toml`."""

    opposed: Opposed
    apart: PositiveFloat
    table: TableConfig
    pot: PotConfig
    reward: RewardConfig


class TwoArmLift(ObjectBenchmark):
    """A pot on a table is to be lifted 10 cm by both arms, and kept level.

    Arm 0 grasps `handle0`, which starts towards -y, and arm 1 `handle1`.

    Source of geometry and reward: robosuite 1.5, see `Lift`. Unlike there, both
    hands must clamp the pot, which moves with them.
    """

    robots: Sequence[str] = ("Panda", "Panda")

    def __init__(self, path: Source) -> None:
        self.config = load_config(TwoArmLiftConfig, path)
        super().__init__(self.config)
        self.sampler = UniformSampler(
            names=[POT], region=self.config.pot.region, origin=self.config.table.center
        )

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add table and cameras."""
        add_table(spec, self.config.table)
        add_table_cameras(spec, self.config.table.center)

    def objects(self) -> Sequence[SceneObject]:
        """Return the pot."""
        numbers = self.config.pot
        sizes = numbers.model_dump(exclude={"mass", "region"})
        return [pot(POT, wall=WALL, **sizes).with_mass(numbers.mass)]

    def bind(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[RobotState]
    ) -> None:
        """Look up the pot's handles: its geoms beyond the walls, on either side."""
        super().bind(model, data, robots)
        geoms, wall = self.states[POT].geoms, self.config.pot.half_size[1]
        self._bars = [
            {geom for geom in geoms if side * model.geom_pos[geom, 1] > wall}
            for side in (1.0, -1.0)
        ]

    def observables(self) -> dict[str, Reading]:
        """Return the pose of the pot, its handles, and their offsets from the hands."""
        points = [site_position(self.model.site(handle).id) for handle in HANDLES]
        readings = self.world_poses_of({"pot": POT})
        readings |= {f"handle{i}_xpos": point for i, point in enumerate(points)}
        for i, point in enumerate(points):
            readings[f"gripper{i}_to_handle{i}"] = self.offset_from_hand(i, point)
        return readings

    @property
    def height(self) -> float:
        """Height of the middle of the pot's bottom above the table, m."""
        state, half = self.states[POT], self.config.pot.half_size[2]
        bottom = state.position[2] - half * state.rotation[2, 2]
        return float(bottom) - self.config.table.center[2]

    @property
    def level(self) -> bool:
        """Whether the pot's axis is tilted less than `tilt`."""
        return self.scene.upright(POT, self.config.reward.tilt)

    def success(self) -> bool:
        """Whether the pot is level, above `lift_height`, and clamped by both hands."""
        high = self.height > self.config.reward.lift_height
        return high and self.level and self.scene.hold_together(POT)

    def progress(self) -> float:
        """Return the shaped reward.

        With h the height of the pot's bottom, and d_i the distance of hand i to its own
        handle, it is

            (lift_scale clip(h - lift_from, 0, lift_most)       if tilted less than tilt
             + sum_i grasp [hand i holds handle i] + reach (1 - tanh(reach_scale d_i)))
            / success
        """
        numbers, reward = self.config.reward, 0.0
        if self.level:
            raised = min(max(self.height - numbers.lift_from, 0.0), numbers.lift_most)
            reward += numbers.lift_scale * raised
        for arm, hand in enumerate(self.hands):
            distance = self.hand_distance(arm, self.site(HANDLES[arm]))
            near = 1.0 - math.tanh(numbers.reach_scale * distance)
            held = hand.grasps(self._bars[arm])
            reward += numbers.reach * near + numbers.grasp * held
        return reward / numbers.success
