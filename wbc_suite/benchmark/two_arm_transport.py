"""TwoArmTransport: clear a bin, and bring a hammer into it from another."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import mujoco
from pydantic import Field, NonNegativeFloat, model_validator

from wbc_suite.benchmark.object_benchmark import add_table_cameras, load_config
from wbc_suite.benchmark.two_arms import TwoArmBenchmark, TwoArmConfig
from wbc_suite.control import RobotState
from wbc_suite.robot.component import Rgba
from wbc_suite.robot.shapes import Size, Vector3
from wbc_suite.scene import TableConfig, add_tables
from wbc_suite.scene.objects import Thing, box, hammer, lid, open_bin
from wbc_suite.scene.objects.tools import HAMMER_LYING
from wbc_suite.scene.placement import Region, SequentialSampler, UniformSampler
from wbc_suite.sensing.hands import pairs_in_contact
from wbc_suite.sensing.reading import (
    Reading,
    body_position,
    body_quat,
    computed_apart,
    site_position,
)
from wbc_suite.tomlfile import FrozenModel

__all__ = ["TwoArmTransport", "TwoArmTransportConfig"]

LID, PAYLOAD, TRASH = "lid", "payload", "trash"
START_BIN, TARGET_BIN, TRASH_BIN = "start_bin", "target_bin", "trash_bin"
GOALS = {PAYLOAD: TARGET_BIN, TRASH: TRASH_BIN}
GLASS = 0.3
"""Opacity of the bins' walls."""
LIGHT, DARK = (0.80, 0.62, 0.42, 1.0), (0.42, 0.27, 0.17, 1.0)


class BinConfig(FrozenModel):
    """A bin; sizes in m."""

    size: tuple[Size, Size, Size]
    wall: Size
    near: Size

    @model_validator(mode="after")
    def _has_room(self) -> "BinConfig":
        if min(self.size) <= 3 * self.wall:
            raise ValueError("a bin is more than three walls wide and high")
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
    """The cube that is to be thrown away; half its edge in m."""

    half_size: Size
    color: Rgba
    region: Region


class RewardConfig(FrozenModel):
    """Numbers of the reward; see `TwoArmTransport.progress`."""

    near: NonNegativeFloat
    inside: NonNegativeFloat


class TwoArmTransportConfig(TwoArmConfig):
    """`tasks/two_arm_transport.toml`."""

    table: TableConfig
    bin: BinConfig
    lid: LidConfig
    payload: PayloadConfig
    trash: TrashConfig
    reward: RewardConfig


class TwoArmTransport(TwoArmBenchmark):
    """The payload is to lie in the target bin, and the trash in the trash bin.

    Before arm 0 stands the start bin, closed by a lid, with the payload in it. Before
    arm 1 stand the target bin, with the trash in it, and the trash bin.

    Source of geometry and success: the benchmark of this name in robosuite 1.5, see
    `Lift`; it has no shaped reward.

    Args:
        path: `tasks/two_arm_transport.toml`, or a file of the same form.
    """

    def __init__(self, path: Path) -> None:
        self.config = load_config(TwoArmTransportConfig, path)
        super().__init__(self.config)
        config, places = self.config, self._bin_places()
        floor, rim = config.bin.wall, config.bin.size[2]
        self.sampler = SequentialSampler(
            samplers=[
                UniformSampler(
                    names=[PAYLOAD],
                    region=config.payload.region,
                    origin=_above(places[START_BIN], floor),
                    rest=HAMMER_LYING,
                ),
                UniformSampler(
                    names=[LID],
                    region=config.lid.region,
                    origin=_above(places[START_BIN], rim),
                ),
                UniformSampler(
                    names=[TRASH],
                    region=config.trash.region,
                    origin=_above(places[TARGET_BIN], floor),
                ),
            ]
        )

    def _bin_places(self) -> dict[str, Vector3]:
        """Return where the bins stand: before arm 0, and two before arm 1."""
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

    def things(self) -> Sequence[Thing]:
        """Return the bins, the lid, the payload and the trash."""
        payload, trash = self.config.payload, self.config.trash
        edge = trash.half_size
        return [
            *(self._bin(name, at) for name, at in self._bin_places().items()),
            lid(LID, self.config.lid.size, color=LIGHT),
            hammer(
                PAYLOAD,
                handle_radius=payload.handle_radius,
                handle_length=payload.handle_length,
                head_half_size=payload.head_half_size,
                mass=payload.mass,
            ),
            box(TRASH, (edge, edge, edge), color=trash.color),
        ]

    def _bin(self, name: str, at: Vector3) -> Thing:
        """Return a bin with walls of glass, so that cameras see what is in it."""
        color = DARK if name == TRASH_BIN else LIGHT
        numbers = self.config.bin
        floor, *walls = open_bin(
            name, numbers.size, wall=numbers.wall, color=color
        ).parts
        clear = (0.75, 0.82, 0.88, GLASS)
        glass = [replace(w, color=clear, material="plastic") for w in walls]
        whole = Thing(name=name, parts=(floor, *glass))
        return whole.fixed(at)

    def bind(
        self, model: mujoco.MjModel, data: mujoco.MjData, robots: Sequence[RobotState]
    ) -> None:
        """Look up the bins' floors too, which are their first parts."""
        super().bind(model, data, robots)
        self._floors = {n: model.geom(f"{n}_0").id for n in self._bin_places()}

    def observables(self) -> dict[str, Reading]:
        """Return poses, the hands' ways to what they move, and what is done."""
        bodies = {name: self.states[name].body for name in self.states}
        handle_site = self.model.site(f"{LID}_handle").id
        payload, trash = body_position(bodies[PAYLOAD]), body_position(bodies[TRASH])
        handle = site_position(handle_site)
        payload_done, trash_done = computed_apart(2, self.done)
        return {
            "payload_pos": payload,
            "payload_quat": body_quat(bodies[PAYLOAD]),
            "trash_pos": trash,
            "trash_quat": body_quat(bodies[TRASH]),
            "lid_handle_pos": handle,
            "lid_handle_quat": body_quat(bodies[LID]),
            "target_bin_pos": body_position(bodies[TARGET_BIN]),
            "trash_bin_pos": body_position(bodies[TRASH_BIN]),
            "gripper0_to_payload": self.arm_to(0, payload),
            "gripper0_to_lid_handle": self.arm_to(0, handle),
            "gripper1_to_payload": self.arm_to(1, payload),
            "gripper1_to_trash": self.arm_to(1, trash),
            "payload_in_target_bin": payload_done,
            "trash_in_trash_bin": trash_done,
        }

    def inside(self, name: str, where: str) -> bool:
        """Whether a thing touches a bin's floor, its middle between the walls."""
        thing, bin_ = self.states[name], self.states[where]
        x, y, z = (thing.position - bin_.position).tolist()
        length, width, height = self.config.bin.size
        between = abs(x) < length / 2 and abs(y) < width / 2 and 0.0 < z < height
        floor = self._floors[where]
        return between and any(
            (a == floor and b in thing.geoms) or (b == floor and a in thing.geoms)
            for a, b in pairs_in_contact(self.data)
        )

    def done(self) -> list[bool]:
        """Return whether the payload and the trash are in their bins."""
        return [self.inside(name, where) for name, where in GOALS.items()]

    def success(self) -> bool:
        """Whether the payload is in the target bin and the trash in the trash bin."""
        return all(self.done())

    def progress(self) -> float:
        """Return the shaped reward, which robosuite has not.

        It is the sum over payload and trash, with d the distance to the own bin:

            inside                  if it is in its bin
            near (1 - tanh(d))      else
        """
        numbers, reward = self.config.reward, 0.0
        for name, where in GOALS.items():
            if self.inside(name, where):
                reward += numbers.inside
            else:
                start, end = self.states[name].position, self.states[where].position
                distance = math.dist(start.tolist(), end.tolist())
                reward += numbers.near * (1.0 - math.tanh(distance))
        return reward


def _above(place: Vector3, height: float) -> Vector3:
    return place[0], place[1], place[2] + height
