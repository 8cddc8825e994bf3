"""Arenas: the empty one, tables, those of tasks, and MJCF files of users."""

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from typing import Any, cast

import mujoco
import numpy as np

from wbc_suite.benchmark import ObjectBenchmark, load_benchmark
from wbc_suite.compat.robosuite.environments.arguments import changed_task
from wbc_suite.compat.robosuite.models.base import MujocoXML
from wbc_suite.compat.robosuite.utils.mjcf_utils import (
    array_to_string,
    string_to_array,
)
from wbc_suite.envs.states import write_scene
from wbc_suite.scene import TableConfig, add_table, add_table_cameras, empty_arena
from wbc_suite.typing import Vector

__all__ = [
    "Arena",
    "BinsArena",
    "EmptyArena",
    "MultiTableArena",
    "PegsArena",
    "TableArena",
    "WipeArena",
]

_UNNEEDED = ("option", "compiler", "size", "visual", "statistic")


class Arena(MujocoXML):
    """MJCF of what stands around the robot; its floor geom is called `floor`."""

    def __init__(self, fname: str) -> None:
        super().__init__(fname)
        geoms = self.worldbody.iter("geom")
        self.floor = next((g for g in geoms if g.get("name") == "floor"), None)
        self.bottom_pos = np.zeros(3)
        if self.floor is not None:
            self.bottom_pos = string_to_array(self.floor.get("pos", "0 0 0"))

    def set_origin(self, offset: Any) -> None:
        """Move everything in the arena, m."""
        for element in self.worldbody:
            if element.tag in ("light", "camera", "body", "geom", "site"):
                pos = string_to_array(element.get("pos", "0 0 0"))
                element.set("pos", array_to_string(pos + np.asarray(offset)))

    def set_camera(
        self,
        camera_name: str,
        pos: Any,
        quat: Any,
        camera_attribs: dict[str, Any] | None = None,
    ) -> None:
        """Move a camera, or add one; the quaternion is w x y z."""
        cameras = self.worldbody.findall("camera")
        named = (c for c in cameras if c.get("name") == camera_name)
        camera = next(named, None)
        if camera is None:
            camera = ET.SubElement(self.worldbody, "camera", {"name": camera_name})
        for key in ("xyaxes", "euler", "zaxis", "axisangle"):
            camera.attrib.pop(key, None)
        values = {"pos": pos, "quat": quat, **(camera_attribs or {})}
        for key, value in values.items():
            text = value if isinstance(value, str) else array_to_string(value)
            camera.set(key, text)


def _table(size: Any, friction: Any, center: Any) -> TableConfig:
    values = (tuple(float(x) for x in given) for given in (size, friction, center))
    return TableConfig(**dict(zip(("size", "friction", "center"), values, strict=True)))  # pyright: ignore[reportArgumentType] - checked by the model


def _text(tables: dict[str, TableConfig], cameras_at: Any) -> str:
    """Return our own arena with tables as MJCF."""
    spec = empty_arena()
    for name, table in tables.items():
        add_table(spec, table, name)
    add_table_cameras(spec, cameras_at)
    return _written(spec)


def _written(spec: mujoco.MjSpec) -> str:
    """Return an arena as MJCF, physics options left out."""
    root = ET.fromstring(write_scene(spec))
    for section in _UNNEEDED:
        for element in root.findall(section):
            root.remove(element)
    return ET.tostring(root, encoding="unicode")


class EmptyArena(Arena):
    """A floor, lights and cameras."""

    def __init__(self) -> None:
        super().__init__(_text({}, (0.0, 0.0, 0.8)))


class TableArena(Arena):
    """A table on the floor; `table_offset` is the middle of its top's upper face, m."""

    def __init__(
        self,
        table_full_size: Sequence[float] = (0.8, 0.8, 0.05),
        table_friction: Sequence[float] = (1, 0.005, 0.0001),
        table_offset: Sequence[float] = (0, 0, 0.8),
        has_legs: bool = True,
        xml: str = "",
    ) -> None:
        self.table_full_size = np.array(table_full_size)
        self.table_half_size = self.table_full_size / 2
        self.table_friction, self.table_offset = table_friction, np.array(table_offset)
        table = _table(table_full_size, table_friction, table_offset)
        super().__init__(xml or _text({"table": table}, tuple(table_offset)))
        self.center_pos = self.table_offset - [0, 0, self.table_half_size[2]]

    @property
    def table_top_abs(self) -> Vector:
        """Middle of the table's upper face, m."""
        return self.table_offset


class MultiTableArena(Arena):
    """Tables `table0`, `table1`, ... with the middles of their upper faces, m."""

    def __init__(
        self,
        table_offsets: Any,
        table_rots: Any = 0,
        table_full_sizes: Any = (0.8, 0.8, 0.05),
        table_frictions: Any = (1, 0.005, 0.0001),
        has_legs: Any = True,
        xml: str = "",
    ) -> None:
        self.table_offsets = np.asarray(table_offsets, np.float64)
        count = len(self.table_offsets)
        sizes = np.broadcast_to(table_full_sizes, (count, 3))
        frictions = np.broadcast_to(table_frictions, (count, 3))
        tables = {
            f"table{k}": _table(sizes[k], frictions[k], center)
            for k, center in enumerate(self.table_offsets)
        }
        super().__init__(xml or _text(tables, tuple(self.table_offsets.mean(axis=0))))


def _furnished(task: str, **arguments: Any) -> str:
    """Return what stands in one of our tasks with robosuite's arguments, as MJCF."""
    spec = empty_arena()
    benchmark = cast(ObjectBenchmark, load_benchmark(changed_task(task, arguments)))
    benchmark.furnish(spec)
    return _written(spec)


class BinsArena(Arena):
    """Two bins, `bin1` and `bin2`, as in PickPlace; `bin1_pos` is on its floor, m."""

    def __init__(
        self,
        bin1_pos: Sequence[float] = (0.1, -0.5, 0.8),
        table_full_size: Sequence[float] = (0.39, 0.49, 0.82),
        table_friction: Sequence[float] = (1, 0.005, 0.0001),
    ) -> None:
        super().__init__(_furnished("PickPlace", bin1_pos=bin1_pos))
        self.table_full_size, self.table_friction = (
            np.array(table_full_size),
            table_friction,
        )
        self.table_half_size = self.table_full_size / 2
        bodies = {body.get("name"): body for body in self.worldbody.iter("body")}
        self.bin1_body, self.bin2_body = bodies["bin1"], bodies["bin2"]
        self.table_top_abs = np.array(bin1_pos, np.float64)
        for name in [name for name in bodies if name and name.endswith("_goal")]:
            self.worldbody.remove(bodies[name])


class PegsArena(TableArena):
    """A table with a square and a round peg, as in NutAssembly."""

    def __init__(
        self,
        table_full_size: Sequence[float] = (0.45, 0.69, 0.05),
        table_friction: Sequence[float] = (1, 0.005, 0.0001),
        table_offset: Sequence[float] = (0, 0, 0.82),
        xml: str = "",
    ) -> None:
        given: dict[str, Any] = {"table_full_size": table_full_size}
        given |= {"table_friction": table_friction, "table_offset": table_offset}
        text = xml or _furnished("NutAssembly", **given)
        super().__init__(**given, xml=text)
        bodies = {body.get("name"): body for body in self.worldbody.iter("body")}
        self.peg1_body, self.peg2_body = bodies["square_peg"], bodies["round_peg"]


class WipeArena(TableArena):
    """A table with marks of dirt; `Wipe` places them at a reset."""

    def __init__(
        self,
        table_full_size: Sequence[float] = (0.8, 0.8, 0.05),
        table_friction: Sequence[float] = (0.01, 0.005, 0.0001),
        table_offset: Sequence[float] = (0, 0, 0.8),
        coverage_factor: float = 0.9,
        num_markers: int = 10,
        table_friction_std: float = 0,
        line_width: float = 0.02,
        two_clusters: bool = False,
    ) -> None:
        given: dict[str, Any] = {"table_full_size": table_full_size}
        given |= {"table_friction": table_friction, "table_offset": table_offset}
        stroke = {"coverage_factor": coverage_factor, "num_markers": num_markers}
        stroke |= {"line_width": line_width, "two_clusters": two_clusters}
        stroke |= {"table_friction_std": table_friction_std}
        config: dict[str, Any] = given | stroke
        super().__init__(**given, xml=_furnished("Wipe", task_config=config))
        self.num_markers, self.line_width = num_markers, line_width
        self.markers = [f"mark{k}" for k in range(num_markers)]
