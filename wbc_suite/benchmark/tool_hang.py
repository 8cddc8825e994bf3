"""ToolHang: put a hook frame into its stand, then hang a wrench on it."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from pydantic import PositiveFloat

from wbc_suite.benchmark.base import Source, load_config
from wbc_suite.benchmark.object_benchmark import ObjectBenchmark, ObjectBenchmarkConfig
from wbc_suite.benchmark.predicates import crossing
from wbc_suite.benchmark.staged_reward import StagedReward
from wbc_suite.config_files import FrozenModel
from wbc_suite.robot.shapes import Vector3
from wbc_suite.scene import TableConfig, add_camera, add_table, add_table_cameras
from wbc_suite.scene.objects import SceneObject, hanging_frame, stand, wrench
from wbc_suite.scene.placement import Region, SequentialSampler, UniformSampler
from wbc_suite.sensing.reading import Reading, computed

STAND, FRAME, TOOL = "base", "frame", "tool"
FLAT = (0.5, 0.5, 0.5, 0.5)
"""The frame's rod along x and its arm along y, flat on the table."""


class InsertConfig(FrozenModel):
    """Bounds of an inserted frame.

    Attributes:
        tilt: Largest angle of its rod to the vertical, rad.
        depth: Largest height of its tip above the floor of the socket, m.
    """

    tilt: PositiveFloat
    depth: PositiveFloat


class ToolHangConfig(ObjectBenchmarkConfig):
    """`tasks/tool_hang.toml`.

    Attributes:
        stand: Place of the stand from the middle of the table's top, m.
        frame: Region of the frame.
        tool: Region of the wrench.
        clear: Least height of a hanging wrench above the table, m.
    """

    table: TableConfig
    stand: Vector3
    frame: Region
    tool: Region
    inserted: InsertConfig
    clear: PositiveFloat
    stages: StagedReward


class ToolHang(ObjectBenchmark):
    """The frame is to stand in its stand, and the wrench to hang on the frame's hook.

    Source of the task: robosuite 1.5, see `Lift`; no shaped reward there.
    """

    def __init__(self, path: Source) -> None:
        self.config = load_config(ToolHangConfig, path)
        super().__init__(self.config)
        config, origin = self.config, self.config.table.center
        first = UniformSampler(
            names=[FRAME], region=config.frame, origin=origin, rest=FLAT
        )
        second = UniformSampler(names=[TOOL], region=config.tool, origin=origin)
        self.sampler = SequentialSampler(samplers=[first, second])

    def furnish(self, spec: mujoco.MjSpec) -> None:
        """Add table and cameras; `sideview` is near the stand."""
        add_table(spec, self.config.table)
        x, y, z = self.config.table.center
        add_table_cameras(spec, (x, y, z))
        add_camera(spec, "closeview", (x + 0.42, y - 0.42, z + 0.38), (x, y, z + 0.06))

    def objects(self) -> Sequence[SceneObject]:
        """Return stand, frame and wrench."""
        x, y, z = self.config.table.center
        dx, dy, dz = self.config.stand
        fixed = stand(STAND).fixed((x + dx, y + dy, z + dz))
        return [fixed, hanging_frame(FRAME), wrench(TOOL)]

    def observables(self) -> dict[str, Reading]:
        """Return poses in the world and in the frames of the hands, and both flags.

        Keys are those of existing datasets; quaternions are x y z w.
        """
        return {
            **self.hand_poses_of({name: name for name in (STAND, FRAME, TOOL)}),
            "frame_is_assembled": computed(1, self.is_inserted),
            "tool_on_frame": computed(1, self.is_hanging),
        }

    def is_inserted(self) -> bool:
        """Whether the frame is upright in the socket, down to its floor."""
        tip, floor = self.site(f"{FRAME}_tip"), self.site(f"{STAND}_floor")
        x, y, z = (tip - floor).tolist()
        bounds = self.config.inserted
        within = max(abs(x), abs(y)) < SOCKET and -0.005 < z < bounds.depth
        return within and self.scene.upright(FRAME, bounds.tilt)

    def is_hanging(self) -> bool:
        """Whether the wrench hangs on the arm of the frame.

        It is at rest on the frame alone, above the table, and the arm passes through
        one of its holes.
        """
        holes = [self.site(f"{TOOL}_hole{k}") for k in (1, 2)]
        lowest = min(hole.item(2) for hole in holes)
        return (
            lowest > self.config.table.center[2] + self.config.clear
            and any(map(self._passes, holes))
            and self.scene.on(TOOL, self.states[FRAME].geoms)
        )

    def _passes(self, hole: np.ndarray) -> bool:
        """Whether the arm of the frame goes through a hole of the wrench."""
        start, end = self.site(f"{FRAME}_corner"), self.site(f"{FRAME}_bend")
        x, y, share = crossing(start, end, hole, self.states[TOOL].rotation)
        return 0.0 < share < 1.0 and math.hypot(x, y) < HOLE

    def success(self) -> bool:
        """Whether the frame is at rest in the socket and the wrench hangs on it."""
        return self.is_inserted() and self.is_hanging() and self.scene.at_rest(FRAME)

    def progress(self) -> float:
        """Return the shaped reward.

        The mean of two staged rewards, each 1 once it is done: the frame into its
        socket, and after that the wrench onto the hook.
        """
        if not self.is_inserted():
            return self._stage(FRAME, f"{FRAME}_tip", f"{STAND}_socket") / 2
        hanging = self.is_hanging()
        wrench = 1.0 if hanging else self._stage(TOOL, f"{TOOL}_hole1", f"{FRAME}_hook")
        return (1.0 + wrench) / 2

    def _stage(self, name: str, point: str, target: str) -> float:
        at, goal = self.site(point).tolist(), self.site(target).tolist()
        aside = math.hypot(at[0] - goal[0], at[1] - goal[1])
        return self.config.stages.value(
            distance=self.distance(self.site(f"{name}_grip")),
            grasped=self.scene.grasped(name),
            missing=max(goal[2] - at[2], 0.0),
            aside=aside,
            over=aside < SOCKET,
        )


SOCKET = 0.011
"""Half of the socket's inner edge, m."""
HOLE = 0.012
"""Radius of the circle in a hole of the wrench, m."""
