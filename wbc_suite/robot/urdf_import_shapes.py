"""Read the shapes, meshes and colours of a URDF file."""

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from wbc_suite.errors import DescriptionError, join_first
from wbc_suite.robot.importing import NameTable
from wbc_suite.robot.mesh_files import READABLE, read_points
from wbc_suite.robot.poses import pose_fields
from wbc_suite.robot.shape_geometry import fit_hull
from wbc_suite.robot.urdf_elements import number, numbers, pose_of
from wbc_suite.robot.xml_files import Element, inside
from wbc_suite.typing import Vector

LOG = logging.getLogger(__name__)


class MeshFolder:
    """Finds mesh files in one folder, and never outside it.

    By default it is the ROS package of the URDF file, or its folder.
    """

    def __init__(self, urdf: Path, root: Path | None) -> None:
        self._urdf = urdf
        self._root = (root or _package_of(urdf)).resolve()
        self._shapes: dict[tuple[str | float, ...], dict[str, Any] | None] = {}

    def hull(self, filename: str, scale: Vector) -> dict[str, Any] | None:
        """Return the fields of a mesh's hull; None if it is missing or unsupported."""
        key = (filename, *scale.tolist())
        if key not in self._shapes:
            path = self._find(filename)
            known = path is not None and path.suffix.lower() in READABLE
            self._shapes[key] = (
                fit_hull(read_points(path) * scale) if path and known else None
            )
        return self._shapes[key]

    def report_missing(self) -> None:
        """Log one warning with all meshes that could not be read."""
        absent = sorted({str(key[0]) for key, s in self._shapes.items() if s is None})
        if absent:
            LOG.warning(
                "%s: %d meshes are ignored, because they are not in %s or are not STL "
                "or OBJ files: %s.",
                *(self._urdf, len(absent), self._root, join_first(absent)),
            )

    def _find(self, filename: str) -> Path | None:
        scheme, separator, rest = filename.partition("://")
        candidates: list[Path] = []
        if not separator:
            candidates = [self._urdf.parent / filename]
        elif scheme == "file":
            candidates = [Path(rest)]
        elif scheme in ("package", "model"):
            candidates = [self._root / rest, self._root / rest.partition("/")[2]]
        paths = (inside(self._root, c, source=self._urdf) for c in candidates)
        return next((path for path in paths if path.is_file()), None)


def _package_of(urdf: Path) -> Path:
    """Return the ROS package that contains a file, or else the file's folder.

    A package has a `package.xml`, or a folder `urdf` with the file.
    """
    folder = urdf.resolve().parent
    for parent in (folder, *folder.parents[:3]):
        if (parent / "package.xml").is_file():
            return parent
    return folder.parent if folder.name in ("urdf", "robots") else folder


class UrdfShapes:
    """Reads shapes of links; `colors` are those of the materials, by valid name."""

    def __init__(self, robot: Element, meshes: MeshFolder) -> None:
        self._meshes = meshes
        self._materials: dict[str, str] = {}
        self.colors: dict[str, tuple[float, ...]] = {}
        names = NameTable()
        for material in robot.iter("material"):
            original, color = material.get("name", ""), material.find("color")
            if color is not None and original not in self._materials:
                name = names.take(original, "material")
                rgba = numbers(color, "rgba", 4, where=f"material '{original}'")
                self._materials[original] = name
                self.colors[name] = tuple(np.clip(rgba, 0.0, 1.0).tolist())

    def of(self, link: Element) -> dict[str, list[dict[str, Any]]]:
        """Return a link's shapes; without readable visuals, collision is drawn."""
        visual = [
            shape | {"color": self._color(item)}
            for item in link.findall("visual")
            for shape in self._shapes(item, link)
        ]
        collision = [
            shape
            for item in link.findall("collision")
            for shape in self._shapes(item, link)
        ]
        first = link.find("visual")
        if not visual and first is not None:
            visual = [shape | {"color": self._color(first)} for shape in collision]
        return {"visual": visual, "collision": collision}

    def _color(self, visual: Element) -> str:
        """Return the name of a visual's material, grey if it has none."""
        material = visual.find("material")
        name = "" if material is None else material.get("name", "")
        return self._materials.get(name, "grey")

    def _shapes(self, item: Element, link: Element) -> Iterator[dict[str, Any]]:
        """Yield the shape of an item, or nothing for a mesh that is ignored."""
        where = f"link '{link.get('name')}', {item.tag}"
        geometry = item.find("geometry")
        if geometry is None or len(geometry) == 0:
            raise DescriptionError(f"{where}: <geometry> is missing.")
        form = geometry[0]
        pose = pose_of(item, where=where)
        if form.tag != "mesh":
            yield _primitive(form, where) | pose_fields(pose)
            return
        scale = numbers(form, "scale", 3, where=where, default=(1.0, 1.0, 1.0))
        shape = self._meshes.hull(form.get("filename", ""), scale)
        if shape is None:
            return
        if "pos" in shape:  # a thin box has its own centre
            pose = pose * pin.SE3(np.eye(3), np.asarray(shape["pos"]))
        yield shape | pose_fields(pose)


def _primitive(form: Element, where: str) -> dict[str, Any]:
    match form.tag:
        case "box":
            size = numbers(form, "size", 3, where=where) / 2
            return {"shape": "box", "size": size.tolist()}
        case "sphere":
            return {"shape": "sphere", "radius": number(form, "radius", where=where)}
        case "cylinder" | "capsule":
            half = number(form, "length", where=where) / 2
            return {
                "shape": form.tag,
                "from": [0.0, 0.0, -half],
                "to": [0.0, 0.0, half],
                "radius": number(form, "radius", where=where),
            }
        case _:
            raise DescriptionError(f"{where}: unknown geometry <{form.tag}>.")
