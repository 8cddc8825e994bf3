"""TwoArmTransport: clear a bin, and bring a hammer into it from another."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

import mujoco
from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from wbc_suite.benchmark.arrangement import Opposed
from wbc_suite.benchmark.base import Source, load_config
from wbc_suite.benchmark.object_benchmark import ObjectBenchmark, ObjectBenchmarkConfig
from wbc_suite.config_files import FrozenModel
from wbc_suite.robot.elements import Rgba
from wbc_suite.robot.shapes import Size, Vector3
from wbc_suite.scene import TableConfig, add_table_cameras, add_tables
from wbc_suite.scene.objects import SceneObject, box, hammer, lid, open_bin
from wbc_suite.scene.objects.tools import HAMMER_LYING
from wbc_suite.scene.placement import Region, SequentialSampler, UniformSampler
from wbc_suite.sensing.reading import (
    Reading,
    body_position,
    body_quat,
    computed,
    site_position,
)

LID, PAYLOAD, TRASH = "lid", "payload", "trash"
START_BIN, TARGET_BIN, TRASH_BIN = "start_bin", "target_bin", "trash_bin"
GOALS = {PAYLOAD: TARGET_BIN, TRASH: TRASH_BIN}
LIGHT, DARK = (0.80, 0.62, 0.42, 1.0), (0.42, 0.27, 0.17, 1.0)
GLASS = (0.75, 0.82, 0.88, 0.3)
"""Colours of the bins, and of their walls."""


class BinConfig(FrozenModel):
    """A bin; sizes in m."""

    size: tuple[Size, Size, Size]
    wall: Size
    near: Size

    @model_validator(mode="after")
    def _has_room(self) -> "BinConfig":
        if min(self.size) <= 3 * self.wall:
            raise ValueError("a bin must be more than three walls wide and high")
        return self


class LidConfig(FrozenModel):
    """The lid: length, width and thickness of its board, m."""

    size: tuple[Size, Size, Size]
    region: Region


class PayloadConfig(FrozenModel):
    """The hammer; sizes in m, mass in kg."""

    handle_radius: Size
    handle_length: Size
    head_half_size: Size
    mass: float = Field(gt=0.0, le=1e3)
    region: Region


class TrashConfig(FrozenModel):
    """The cube that belongs into the trash bin; half its edge in m."""

    half_size: Size
    color: Rgba
    region: Region


class RewardConfig(FrozenModel):
    """Numbers of the reward; see `TwoArmTransport.progress`."""

    near: NonNegativeFloat
    inside: NonNegativeFloat


class TwoArmTransportConfig(ObjectBenchmarkConfig):
    """`tasks/two_arm_transport.toml`."""

    one_table: ClassVar[bool] = False
    opposed: Opposed
    apart: PositiveFloat
    table: TableConfig
    bin: BinConfig
    lid: LidConfig
    payload: PayloadConfig
    trash: TrashConfig
    reward: RewardConfig


class TwoArmTransport(ObjectBenchmark):
    """The payload is to lie in the target bin, and the trash in the trash bin.

    The start bin, closed by a lid, with the payload in it, is in front of arm 0; the
    target bin, with the trash in it, and the trash bin are in front of arm 1.

    Source of geometry and success: robosuite 1.5, see `Lift`; no shaped reward there.
    Unlike there, things that bounce in their bins do not count.
    """

    robots: Sequence[str] = ("Panda", "Panda")

    def __init__(self, path: Source) -> None:
        self.config = load_config(TwoArmTransportConfig, path)
        super().__init__(self.config)
        config, places = self.config, self._bin_places()
        floor, rim = config.bin.wall, config.bin.size[2]
        in_start = UniformSampler(
            names=[PAYLOAD],
            region=config.payload.region,
            origin=_above(places[START_BIN], floor),
            rest=HAMMER_LYING,
        )
        on_start = UniformSampler(
            names=[LID],
            region=config.lid.region,
            origin=_above(places[START_BIN], rim),
        )
        in_target = UniformSampler(
            names=[TRASH],
            region=config.trash.region,
            origin=_above(places[TARGET_BIN], floor),
        )
        self.sampler = SequentialSampler(samplers=[in_start, on_start, in_target])

    def _bin_places(self) -> dict[str, Vector3]:
        """Return the places of the bins: one near arm 0, two near arm 1."""
        x, y, z = self.config.table.center
        near = self.config.bin.near
        return {
            START_BIN: (x + near, -y, z),
            TARGET_BIN: (x + near, y, z),
            TRASH_BIN: (x - near, y, z),
        }

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add both tables and cameras."""
        table = self.config.table
        x, y, z = table.center
        add_tables(spec, table, {"table0": (x, -y, z), "table1": (x, y, z)})
        add_table_cameras(spec, (x, 0.0, z), before=1.2)

    def objects(self) -> Sequence[SceneObject]:
        """Return the bins, the lid, the payload and the trash."""
        payload, trash = self.config.payload, self.config.trash
        edge = trash.half_size
        return [
            *(self._bin(name, at) for name, at in self._bin_places().items()),
            lid(LID, self.config.lid.size, color=LIGHT),
            hammer(PAYLOAD, **payload.model_dump(exclude={"region"})),
            box(TRASH, (edge, edge, edge), color=trash.color),
        ]

    def _bin(self, name: str, at: Vector3) -> SceneObject:
        """Return a bin with translucent walls."""
        color = DARK if name == TRASH_BIN else LIGHT
        numbers = self.config.bin
        whole = open_bin(name, numbers.size, wall=numbers.wall, color=color)
        floor, *walls = whole.parts
        glass = [replace(w, color=GLASS, material="plastic") for w in walls]
        return SceneObject(name=name, parts=(floor, *glass)).fixed(at)

    def observables(self) -> dict[str, Reading]:
        """Return poses, offsets from the hands, and which objects are in their bins."""
        readings = self.world_poses_of({"payload": PAYLOAD, "trash": TRASH})
        payload, trash = readings["payload_pos"], readings["trash_pos"]
        handle = site_position(self.model.site(f"{LID}_handle").id)
        target, waste = (self.states[name].body for name in (TARGET_BIN, TRASH_BIN))
        return readings | {
            "lid_handle_pos": handle,
            "lid_handle_quat": body_quat(self.states[LID].body),
            "target_bin_pos": body_position(target),
            "trash_bin_pos": body_position(waste),
            "gripper0_to_payload": self.offset_from_hand(0, payload),
            "gripper0_to_lid_handle": self.offset_from_hand(0, handle),
            "gripper1_to_payload": self.offset_from_hand(1, payload),
            "gripper1_to_trash": self.offset_from_hand(1, trash),
            "payload_in_target_bin": computed(1, lambda: self._is_done(PAYLOAD)),
            "trash_in_trash_bin": computed(1, lambda: self._is_done(TRASH)),
        }

    def _is_done(self, name: str) -> bool:
        return self.is_in(name, GOALS[name])

    def is_in(self, name: str, where: str) -> bool:
        """Whether an object is down in a bin."""
        floor = _above(self.states[where].position.tolist(), self.config.bin.wall)
        return self.scene.inside(name, floor, self.config.bin.size)

    def success(self) -> bool:
        """Whether the payload is at rest in the target bin, the trash in its own."""
        return all(self._is_done(name) and self.scene.at_rest(name) for name in GOALS)

    def progress(self) -> float:
        """Return the shaped reward, which robosuite does not have.

        It is the sum over payload and trash, with d the distance to the object's bin:

            inside                  if it is in its bin
            near (1 - tanh(d))      else
        """
        numbers, reward = self.config.reward, 0.0
        for name, where in GOALS.items():
            if self._is_done(name):
                reward += numbers.inside
            else:
                start, end = self.states[name].position, self.states[where].position
                distance = math.dist(start.tolist(), end.tolist())
                reward += numbers.near * (1.0 - math.tanh(distance))
        return reward


def _above(place: Vector3, height: float) -> Vector3:
    return place[0], place[1], place[2] + height
