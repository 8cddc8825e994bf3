"""Read the shapes, meshes and colours of a URDF file."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from pydantic import TypeAdapter

from wbc_suite import logs
from wbc_suite.errors import ConfigError, DescriptionError, join_first
from wbc_suite.robot.adopt.importing import NameTable
from wbc_suite.robot.mesh_files import (
    MeshIndex,
    can_read,
    read_points,
    read_triangles,
)
from wbc_suite.robot.poses import pose_fields
from wbc_suite.robot.shape_geometry import fit_hull
from wbc_suite.robot.shapes import Drawn
from wbc_suite.robot.slab_hulls import slab_hulls
from wbc_suite.robot.surfaces import surfaces_of_file
from wbc_suite.robot.urdf_elements import numbers, place_of, pose_of
from wbc_suite.robot.xml_files import (
    MAX_ABOVE,
    PACKAGE,
    Element,
    model_root,
    package_folder,
)
from wbc_suite.typing import Vector

LOG = logs.logger(__name__)

_DRAWN: TypeAdapter[Drawn] = TypeAdapter(Drawn)

MIN_SIZE = 2e-6  # smallest size of a shape in m; smaller ones are left out


class MeshFolder:
    """Finds mesh files in one folder, and in other ROS packages if `root` is None."""

    def __init__(
        self, urdf: Path, root: Path | str | None, references: Iterable[str] = ()
    ) -> None:
        self._urdf, self._is_given = urdf, root is not None
        self._root = Path(root or model_root(urdf, references)).resolve()
        self._packages: dict[str, Path | None] = {}
        self._index = MeshIndex(self._root)
        self._shapes: dict[tuple[str | float, ...], dict[str, Any] | None] = {}

    def hull(self, filename: str, scale: Vector) -> dict[str, Any] | None:
        """Return the fields of a hull, scaled (3,); None without a readable mesh."""
        key = (filename, *scale.tolist())
        if key not in self._shapes:
            path = self.find(filename)
            self._shapes[key] = None
            if path is not None and can_read(path):
                self._shapes[key] = fit_hull(read_points(path) * scale)
        return self._shapes[key]

    def slabs(self, filename: str, scale: Vector) -> list[dict[str, Any]]:
        """Return the fields of hulls of the mesh's slabs; none if it has no faces."""
        path = self.find(filename)
        if path is None or not can_read(path):
            return []
        vertices, faces = read_triangles(path)
        return slab_hulls(vertices * scale, faces) if len(faces) else []

    def surfaces(self, filename: str, scale: Vector) -> list[dict[str, Any]]:
        """Return the surfaces of a mesh, scaled (3,); raises ConfigError."""
        path, factors = self.find(filename), tuple(scale.tolist())
        if path is None:
            return []
        return [
            {"shape": "skin", "file": str(path), "surface": own, "color": own.color}
            for own in surfaces_of_file(path, factors, folder=self._root)
        ]

    def find(self, filename: str) -> Path | None:
        """Return the file of a reference, if there is one in the folder or package."""
        if path := self._packaged(filename):
            return path
        scheme, separator, rest = filename.partition("://")
        folder = self._urdf.resolve().parent
        candidates = [folder / (rest or filename)]
        if scheme in ("package", "model") and separator:
            whole = Path(rest.lstrip("/"))
            above = (folder, *folder.parents[:MAX_ABOVE], self._root)
            short = Path(*whole.parts[1:])
            candidates = [start / path for path in (whole, short) for start in above]
        for candidate in candidates:
            path = candidate.resolve()
            if path.is_relative_to(self._root) and path.is_file():
                return path
        path = self._index.find(Path(rest or filename))
        return path if path and path.resolve().is_relative_to(self._root) else None

    def _packaged(self, filename: str) -> Path | None:
        """Return the file of `package://NAME/...` in the package NAME, if there."""
        if self._is_given or not (match := PACKAGE.match(filename)):
            return None
        name, rest = match[1], match[2]
        if name not in self._packages:
            self._packages[name] = package_folder(name, self._urdf)
        if (folder := self._packages[name]) is None:
            return None
        path = (folder / rest).resolve()
        inside = path.is_relative_to(folder.resolve()) and path.is_file()
        return path if inside else None

    def report(self) -> None:
        """Log one line with the number of meshes, and a warning about absent ones."""
        files = {
            name: self.find(name) for name in {str(key[0]) for key in self._shapes}
        }
        missing = sorted(name for name, path in files.items() if path is None)
        unread = sorted(
            name for name, path in files.items() if path and not can_read(path)
        )
        read = len(files) - len(missing) - len(unread)
        LOG.info("%s: %d of %d meshes read.", self._urdf, read, len(files))
        if missing:
            counts, shown = (len(missing), len(files)), join_first(missing)
            ros = any(map(PACKAGE.match, missing)) and not self._is_given
            LOG.warning(
                "%s: %d of %d meshes are not in %s: %s. Give another folder by "
                "--mesh-root%s.",
                *(self._urdf, *counts, self._root, shown),
                ", or that of the package by ROS_PACKAGE_PATH" * ros,
            )
        if unread:
            LOG.warning(
                "%s: %d of %d meshes are not read: %s. Convert them to STL, OBJ, "
                "GLB or COLLADA (.dae).",
                *(self._urdf, len(unread), len(files), join_first(unread)),
            )


class UrdfShapes:
    """Reads shapes of links.

    Attributes:
        colors: Those of the materials, by valid name.
        skins: What draws the links that have readable meshes, by the name in the file.
    """

    def __init__(self, robot: Element, meshes: MeshFolder, *, strict: bool) -> None:
        self._meshes, self._strict = meshes, strict
        self._dropped: list[str] = []
        self.skins: dict[str, tuple[Drawn, ...]] = {}
        self._materials: dict[str, str] = {}
        self.colors: dict[str, tuple[float, ...]] = {}
        names = NameTable()
        for material in robot.iter("material"):
            original, color = material.get("name", ""), material.find("color")
            if color is not None and original not in self._materials:
                name = names.take(original, "material")
                rgba = numbers(color, "rgba", 4, where=place_of(material))
                self._materials[original] = name
                self.colors[name] = tuple(np.clip(rgba, 0.0, 1.0).tolist())

    def of(self, link: Element) -> dict[str, list[dict[str, Any]]]:
        """Return a link's shapes; without readable visuals, collision is drawn."""
        visual, drawn = list[dict[str, Any]](), list[dict[str, Any]]()
        for item in link.findall("visual"):
            color = self._color(item)
            own = [shape | {"color": color} for shape in self._shapes(item, link)]
            visual += own
            drawn += (own and self._surfaces(item, link, color)) or own
        collision = [
            shape
            for item in link.findall("collision")
            for shape in self._shapes(item, link)
        ]
        first = link.find("visual")
        if not visual and first is not None:
            visual = [shape | {"color": self._color(first)} for shape in collision]
        if any(shape["shape"] == "skin" for shape in drawn):
            self.skins[link.get("name", "")] = tuple(map(_DRAWN.validate_python, drawn))
        return {"visual": visual, "collision": collision}

    def slabs(self, link: Element) -> list[dict[str, Any]]:
        """Return a link's collision shapes, or else visual ones, with cut meshes."""
        items = link.findall("collision") or link.findall("visual")
        found: list[dict[str, Any]] = []
        for item in items:
            form = item.find("geometry/mesh")
            pieces: list[dict[str, Any]] = []
            if form is not None:
                scale = _scale(form, place_of(link))
                pieces = self._meshes.slabs(form.get("filename", ""), scale)
            pose = pose_of(item, where=place_of(link))
            placed = [_placed(piece, pose) for piece in pieces]
            found += placed or self._shapes(item, link)
        return found

    def report(self, path: Path) -> None:
        """Log which meshes are absent, and which shapes were left out."""
        self._meshes.report()
        if self._dropped:
            LOG.warning("%s: shapes left out: %s.", path, "; ".join(self._dropped))

    def _surfaces(
        self, item: Element, link: Element, color: str
    ) -> list[dict[str, Any]]:
        """Return the mesh of a visual as surfaces; its own colours come first."""
        form = item.find("geometry/mesh")
        if form is None:
            return []
        where = place_of(link)
        try:
            found = self._meshes.surfaces(form.get("filename", ""), _scale(form, where))
        except ConfigError as error:
            LOG.warning("%s: %s It is drawn as a hull.", where, error)
            return []
        pose = pose_fields(pose_of(item, where=where))
        return [fields | {"color": fields["color"] or color} | pose for fields in found]

    def _color(self, visual: Element) -> str:
        """Return the name of a visual's material, grey if it has none."""
        material = visual.find("material")
        name = "" if material is None else material.get("name", "")
        return self._materials.get(name, "grey")

    def _shapes(self, item: Element, link: Element) -> Iterator[dict[str, Any]]:
        """Yield the shape of an item, or nothing for one that is left out."""
        where = f"{place_of(link)}, {item.tag}"
        try:
            shape = self._shape(item, where)
        except DescriptionError as error:
            if self._strict:
                raise
            self._dropped.append(str(error).removesuffix("."))
            return
        if shape is not None:
            yield shape

    def _shape(self, item: Element, where: str) -> dict[str, Any] | None:
        geometry = item.find("geometry")
        if geometry is None or len(geometry) == 0:
            raise DescriptionError(f"{where}: <geometry> is missing.")
        form = geometry[0]
        pose = pose_of(item, where=where)
        if form.tag != "mesh":
            return _primitive(form, where) | pose_fields(pose)
        shape = self._meshes.hull(form.get("filename", ""), _scale(form, where))
        if shape is None:
            return None
        return _placed(shape, pose)


def _placed(shape: dict[str, Any], pose: pin.SE3) -> dict[str, Any]:
    """Return a hull at a pose; a thin box has its own centre."""
    if "pos" in shape:
        pose = pose * pin.SE3(np.eye(3), np.asarray(shape["pos"]))
    return shape | pose_fields(pose)


def _scale(form: Element, where: str) -> Vector:
    return numbers(form, "scale", 3, where=where, default=(1.0, 1.0, 1.0))


def _sizes(form: Element, key: str, count: int, where: str) -> Vector:
    """Read positive sizes; raises DescriptionError."""
    sizes = numbers(form, key, count, where=where)
    if sizes.min() < MIN_SIZE:
        raise DescriptionError(f"{where}: <{form.tag}> has the {key} {sizes.min():g}.")
    return sizes


def _primitive(form: Element, where: str) -> dict[str, Any]:
    match form.tag:
        case "box":
            size = _sizes(form, "size", 3, where) / 2
            return {"shape": "box", "size": size.tolist()}
        case "sphere":
            return {
                "shape": "sphere",
                "radius": float(_sizes(form, "radius", 1, where)[0]),
            }
        case "cylinder" | "capsule":
            half = float(_sizes(form, "length", 1, where)[0]) / 2
            return {
                "shape": form.tag,
                "from": [0.0, 0.0, -half],
                "to": [0.0, 0.0, half],
                "radius": float(_sizes(form, "radius", 1, where)[0]),
            }
        case _:
            raise DescriptionError(f"{where}: unknown geometry <{form.tag}>.")
