"""ToolHang: put a hook frame into its stand, then hang a wrench on it."""

import math
from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
from pydantic import PositiveFloat

from wbc_suite.benchmark.object_benchmark import (
    ObjectBenchmark,
    ObjectBenchmarkConfig,
    add_table_cameras,
    load_config,
)
from wbc_suite.benchmark.stages import Stages
from wbc_suite.robot.shapes import Vector3
from wbc_suite.scene import TableConfig, add_camera, add_table, objects
from wbc_suite.scene.objects import Thing
from wbc_suite.scene.placement import Region, SequentialSampler, UniformSampler
from wbc_suite.sensing.reading import Reading, computed_apart
from wbc_suite.tomlfile import FrozenModel

__all__ = ["ToolHang", "ToolHangConfig"]

STAND, FRAME, TOOL = "base", "frame", "tool"
FLAT = (0.5, 0.5, 0.5, 0.5)
"""The frame's rod along x and its arm along y, flat on the table."""


class InsertConfig(FrozenModel):
    """When the frame counts as inserted.

    Attributes:
        tilt: Of its rod against the vertical at most, rad.
        depth: Of its tip above the socket's floor at most, m.
    """

    tilt: PositiveFloat
    depth: PositiveFloat


class ToolHangConfig(ObjectBenchmarkConfig):
    """`tasks/tool_hang.toml`.

    Attributes:
        table: The table.
        stand: Where the stand stands, from the middle of the table's top, m.
        frame: Where the frame lies.
        tool: Where the wrench lies.
        inserted: When the frame counts as inserted.
        clear: A hanging wrench is so high above the table at least, m.
        stages: Numbers of the shaped reward.
    """

    table: TableConfig
    stand: Vector3
    frame: Region
    tool: Region
    inserted: InsertConfig
    clear: PositiveFloat
    stages: Stages


class ToolHang(ObjectBenchmark):
    """The frame is to stand in its stand, and the wrench to hang on the frame's hook.

    Source of the task: the benchmark of this name in robosuite 1.5, see `Lift`. The
    shaped reward is ours, for the peer has none.

    Args:
        path: `tasks/tool_hang.toml`, or a file of the same form.
    """

    def __init__(self, path: Path) -> None:
        self.config = load_config(ToolHangConfig, path)
        super().__init__(self.config)
        origin = self.config.table.center
        self.sampler = SequentialSampler(
            samplers=[
                UniformSampler(
                    names=[FRAME], region=self.config.frame, origin=origin, rest=FLAT
                ),
                UniformSampler(names=[TOOL], region=self.config.tool, origin=origin),
            ]
        )

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add table and cameras; `sideview` is near the stand."""
        add_table(spec, self.config.table)
        x, y, z = self.config.table.center
        add_table_cameras(spec, (x, y, z))
        add_camera(spec, "closeview", (x + 0.42, y - 0.42, z + 0.38), (x, y, z + 0.06))

    def things(self) -> Sequence[Thing]:
        """Return stand, frame and wrench."""
        x, y, z = self.config.table.center
        dx, dy, dz = self.config.stand
        return [
            objects.stand(STAND).fixed((x + dx, y + dy, z + dz)),
            objects.hanging_frame(FRAME),
            objects.wrench(TOOL),
        ]

    def observables(self) -> dict[str, Reading]:
        """Return poses in the world and as seen by the hands, and what is done.

        Keys are those of this field's datasets; quaternions are x y z w.
        """
        inserted, hanging = computed_apart(2, self.done)
        return {
            **self.hand_poses_of({name: name for name in (STAND, FRAME, TOOL)}),
            "frame_is_assembled": inserted,
            "tool_on_frame": hanging,
        }

    def done(self) -> tuple[bool, bool]:
        """Return whether the frame is inserted, and whether the wrench hangs."""
        return self.is_inserted(), self.is_hanging()

    def is_inserted(self) -> bool:
        """Whether the frame stands in the socket, upright and down to its floor."""
        upright = self.states[FRAME].rotation.item(2, 2)
        if upright <= math.cos(self.config.inserted.tilt):
            return False
        tip, floor = self.site(f"{FRAME}_tip"), self.site(f"{STAND}_floor")
        x, y, z = (tip - floor).tolist()
        within = max(abs(x), abs(y)) < SOCKET
        return within and -0.005 < z < self.config.inserted.depth

    def is_hanging(self) -> bool:
        """Whether the wrench hangs free on the frame's arm, which goes through its eye.

        It touches the frame and not the stand, no hand holds it, it is above the table,
        and the arm passes through one of its holes.
        """
        holes = [self.site(f"{TOOL}_hole{k}") for k in (1, 2)]
        lowest = min(hole.item(2) for hole in holes)
        return (
            lowest > self.config.table.center[2] + self.config.clear
            and any(map(self._passes, holes))
            and self.touching(TOOL, FRAME)
            and not self.touching(TOOL, STAND)
            and not self.grasped(TOOL)
        )

    def _passes(self, hole: np.ndarray) -> bool:
        """Whether the arm of the frame goes through a hole of the wrench."""
        start, end = self.site(f"{FRAME}_corner"), self.site(f"{FRAME}_bend")
        axis = self.states[TOOL].rotation[:, 2]
        along = float(axis @ (end - start))
        if abs(along) < 1e-6:
            return False
        t = float(axis @ (hole - start)) / along
        gap = float(np.linalg.norm(start + t * (end - start) - hole))
        return 0.0 < t < 1.0 and gap < HOLE

    def success(self) -> bool:
        """Whether the frame is inserted and the wrench hangs on it."""
        return self.is_inserted() and self.is_hanging()

    def progress(self) -> float:
        """Return the shaped reward.

        The mean of two terms, each the `Stages.reward` of bringing a thing to its
        place, and 1 where it is there: the frame above its socket, and only then the
        wrench at the hook.
        """
        if not self.is_inserted():
            return self._stage(FRAME, f"{FRAME}_tip", f"{STAND}_socket") / 2
        hanging = self.is_hanging()
        wrench = 1.0 if hanging else self._stage(TOOL, f"{TOOL}_hole1", f"{FRAME}_hook")
        return (1.0 + wrench) / 2

    def _stage(self, name: str, point: str, target: str) -> float:
        at, goal = self.site(point).tolist(), self.site(target).tolist()
        aside = math.hypot(at[0] - goal[0], at[1] - goal[1])
        return self.config.stages.reward(
            distance=self.distance(self.site(f"{name}_grip")),
            grasped=self.grasped(name),
            missing=max(goal[2] - at[2], 0.0),
            aside=aside,
            over=aside < SOCKET,
        )


SOCKET = 0.011
"""Half of the socket's inner edge, m."""
HOLE = 0.012
"""Radius of the circle in a hole of the wrench, m."""
