"""Door: turn the lever and pull the door open."""

import math
from collections.abc import Sequence

import mujoco
from pydantic import NonNegativeFloat, PositiveFloat

from wbc_suite.benchmark.base import Source, load_config
from wbc_suite.benchmark.object_benchmark import ObjectBenchmark, ObjectBenchmarkConfig
from wbc_suite.config_files import FrozenModel
from wbc_suite.control import RobotState
from wbc_suite.robot.shapes import Vector3
from wbc_suite.scene import TableConfig, add_table, add_table_cameras, objects
from wbc_suite.scene.objects import SceneObject
from wbc_suite.scene.placement import Region, UniformSampler
from wbc_suite.sensing import reading
from wbc_suite.sensing.reading import Reading, site_position
from wbc_suite.typing import Vector

DOOR = "door"
HINGE, LEVER, GRIP = "door_panel_joint", "door_handle_joint", "door_handle_grip"


class RewardConfig(FrozenModel):
    """Numbers of the reward; see `Door.progress`."""

    reach_scale: PositiveFloat
    reach: NonNegativeFloat
    lever: NonNegativeFloat
    lever_angle: PositiveFloat
    open_angle: PositiveFloat


class DoorConfig(ObjectBenchmarkConfig):
    """`tasks/door.toml`.

    Attributes:
        latch: Whether the lever must be turned first.
        origin: Origin of the door's region, m.
    """

    latch: bool = True
    table: TableConfig
    origin: Vector3
    region: Region
    reward: RewardConfig


class Door(ObjectBenchmark):
    """A door with a lever is to be opened.

    Source of geometry and reward: robosuite 1.5, see `Lift`. Unlike there, only turning
    the lever down is rewarded, and its stops do not give way.
    """

    needs_gripper = False  # a lever can be pushed down, and the door pulled, without

    def __init__(self, path: Source) -> None:
        self.config = load_config(DoorConfig, path)
        super().__init__(self.config)
        self.sampler = UniformSampler(
            names=[DOOR], region=self.config.region, origin=self.config.origin
        )

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add table and cameras."""
        add_table(spec, self.config.table)
        x, y, z = self.config.origin
        add_table_cameras(spec, (x + 0.2, y + 0.25, z), side=1.0)

    def objects(self) -> Sequence[SceneObject]:
        """Return the door, which is fixed but for its hinges."""
        door = objects.door(DOOR, latch=self.config.latch)
        return [door.fixed(self.config.origin)]

    def bind(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[RobotState]
    ) -> None:
        """Look up the hinges too."""
        super().bind(model, data, robots)
        self._hinge = int(model.joint(HINGE).qposadr[0])
        self._lever = int(model.joint(LEVER).qposadr[0])

    def observables(self) -> dict[str, Reading]:
        """Return positions and angles of door and lever, and offsets from the hands.

        Keys are those of existing datasets.
        """
        door = reading.body_position(self.model.body(f"{DOOR}_panel").id)
        handle = site_position(self.model.site(GRIP).id)
        readings = {"door_pos": door, "handle_pos": handle}
        for side, hand in self.sided_hands():
            at = site_position(hand.site)
            readings[f"door_to_{side}eef_pos"] = reading.offset(door, at)
            readings[f"handle_to_{side}eef_pos"] = reading.offset(handle, at)
        readings["hinge_qpos"] = reading.joint_positions([self._hinge])
        if self.config.latch:
            readings["handle_qpos"] = reading.joint_positions([self._lever])
        return readings

    @property
    def handle_position(self) -> Vector:
        """Middle of the lever in the world, m. A view."""
        return self.site(GRIP)

    def success(self) -> bool:
        """Whether the hinge is opened by more than `open_angle`."""
        return self.data.qpos.item(self._hinge) > self.config.reward.open_angle

    def progress(self) -> float:
        """Return the shaped reward.

        With d the distance of the nearest hand to the lever, and h the lever's angle:

            reach (1 - tanh(reach_scale d)) + lever clip(h / lever_angle, 0, 1)
        """
        numbers = self.config.reward
        distance = self.distance(self.handle_position)
        reward = numbers.reach * (1.0 - math.tanh(numbers.reach_scale * distance))
        turned = self.data.qpos.item(self._lever) / numbers.lever_angle
        turned = min(max(turned, 0.0), 1.0)
        return reward + self.config.latch * numbers.lever * turned
