"""Read the shapes and colours of a URDF file."""

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from wbc_suite.errors import DescriptionError
from wbc_suite.robot.mesh_files import READABLE, read_points
from wbc_suite.robot.naming import NameTable
from wbc_suite.robot.placing import pose_fields
from wbc_suite.robot.point_clouds import enclosing_shape
from wbc_suite.robot.urdf_values import number, numbers, pose_of
from wbc_suite.robot.xml_files import children, inside
from wbc_suite.typing import Vector

__all__ = ["MeshFolder", "Palette", "UrdfShapes"]

LOG = logging.getLogger(__name__)
Element = ElementTree.Element


class Palette:
    """The materials of one file, under names that our format allows."""

    def __init__(self, robot: Element) -> None:
        self._names = NameTable()
        self._ours: dict[str, str] = {}
        self.colors: dict[str, tuple[float, ...]] = {}
        for material in robot.iter("material"):
            self._learn(material)

    def color(self, visual: Element) -> str:
        """Return the name of a visual's material, grey when it has none."""
        material = visual.find("material")
        name = "" if material is None else material.get("name", "")
        return self._ours.get(name, "grey")

    def _learn(self, material: Element) -> None:
        foreign, color = material.get("name", ""), material.find("color")
        if color is None or foreign in self._ours:
            return
        name = self._names.take(foreign, "material")
        rgba = numbers(color, "rgba", 4, where=f"material '{foreign}'")
        self._ours[foreign] = name
        self.colors[name] = tuple(np.clip(rgba, 0.0, 1.0).tolist())


class MeshFolder:
    """Finds mesh files in one folder, and never outside it."""

    def __init__(self, urdf: Path, root: Path | None) -> None:
        self._urdf = urdf
        self.root = (root or _package_of(urdf)).resolve()
        self._shapes: dict[tuple[str | float, ...], dict[str, Any] | None] = {}

    def shape(self, filename: str, scale: Vector) -> dict[str, Any] | None:
        """Return a hull of a mesh, None when it is missing or of another kind.

        Raises:
            ConfigError: If the name leads out of the folder.
            DescriptionError: If the file is broken.
        """
        key = (filename, *scale.tolist())
        if key not in self._shapes:
            path = self._find(filename)
            known = path is not None and path.suffix.lower() in READABLE
            self._shapes[key] = (
                enclosing_shape(read_points(path) * scale) if path and known else None
            )
        return self._shapes[key]

    def report(self) -> None:
        """Warn once about all the meshes that could not be read."""
        absent = sorted({str(key[0]) for key, s in self._shapes.items() if s is None})
        if absent:
            more = f" and {len(absent) - 5} more" if len(absent) > 5 else ""
            LOG.warning(
                "%s: %d meshes are left out, for they are not below %s or are no STL "
                "or OBJ file: %s%s.",
                *(self._urdf, len(absent), self.root, ", ".join(absent[:5]), more),
            )

    def _find(self, filename: str) -> Path | None:
        for candidate in self._candidates(filename):
            path = inside(self.root, candidate, source=self._urdf)
            if path.is_file():
                return path
        return None

    def _candidates(self, filename: str) -> Iterator[Path]:
        scheme, separator, rest = filename.partition("://")
        if not separator:
            yield self._urdf.parent / filename
        elif scheme == "file":
            yield Path(rest)
        elif scheme in ("package", "model"):
            package, _, below = rest.partition("/")
            yield self.root / package / below
            yield self.root / below


def _package_of(urdf: Path) -> Path:
    """Return the ROS package that a file is in, or else the file's own folder.

    A package is known by its `package.xml`, or by its folder `urdf` with the file.
    """
    folder = urdf.resolve().parent
    for parent in (folder, *folder.parents[:3]):
        if (parent / "package.xml").is_file():
            return parent
    return folder.parent if folder.name in ("urdf", "robots") else folder


class UrdfShapes:
    """Turns `<visual>` and `<collision>` elements into the fields of our shapes."""

    def __init__(self, robot: Element, meshes: MeshFolder) -> None:
        self.palette = Palette(robot)
        self._meshes = meshes

    def of(self, link: Element) -> dict[str, list[dict[str, Any]]]:
        """Return the shapes of a link; without readable visuals it shows its hull."""
        visual = [
            shape | {"color": self.palette.color(item)}
            for item in children(link, "visual")
            for shape in self._shape(item, link)
        ]
        collision = [
            shape
            for item in children(link, "collision")
            for shape in self._shape(item, link)
        ]
        first = link.find("visual")
        if not visual and first is not None:
            color = self.palette.color(first)
            visual = [shape | {"color": color} for shape in collision]
        return {"visual": visual, "collision": collision}

    def _shape(self, item: Element, link: Element) -> Iterator[dict[str, Any]]:
        where = f"link '{link.get('name')}', {item.tag}"
        geometry = item.find("geometry")
        if geometry is None or len(geometry) == 0:
            raise DescriptionError(f"{where}: it has no <geometry>.")
        form = geometry[0]
        pose = pose_of(item, where=where)
        match form.tag:
            case "box":
                size = numbers(form, "size", 3, where=where) / 2
                yield {"shape": "box", "size": size.tolist(), **pose_fields(pose)}
            case "sphere":
                radius = number(form, "radius", where=where)
                yield {"shape": "sphere", "radius": radius, **pose_fields(pose)}
            case "cylinder" | "capsule":
                half = number(form, "length", where=where) / 2
                yield {
                    "shape": form.tag,
                    "from": [0.0, 0.0, -half],
                    "to": [0.0, 0.0, half],
                    "radius": number(form, "radius", where=where),
                    **pose_fields(pose),
                }
            case "mesh":
                yield from self._mesh(form, pose, where)
            case _:
                raise DescriptionError(f"{where}: unknown geometry <{form.tag}>.")

    def _mesh(
        self, mesh: Element, pose: pin.SE3, where: str
    ) -> Iterator[dict[str, Any]]:
        scale = numbers(mesh, "scale", 3, where=where, default=(1.0, 1.0, 1.0))
        shape = self._meshes.shape(mesh.get("filename", ""), scale)
        if shape is None:
            return
        if "pos" in shape:  # a thin box about its own centre
            pose = pose * pin.SE3(np.eye(3), np.asarray(shape["pos"]))
        yield shape | pose_fields(pose)
