"""Mesh files (STL, OBJ, COLLADA, glTF): find, read and write them."""

import importlib
import io
from functools import cached_property
from itertools import islice, takewhile
from pathlib import Path
from typing import Any, Literal

import numpy as np

from wbc_suite.errors import DescriptionError
from wbc_suite.files import read_bytes
from wbc_suite.typing import Indices, Matrix

READABLE = (".stl", ".obj", ".glb", ".dae")  # suffixes of files that are meshes
MODELS = (".urdf", ".xml")  # suffixes of models that name meshes
MAX_BYTES = 100_000_000  # largest mesh file that is read
MAX_FILES = 20_000  # of a folder that is searched for meshes


class MeshIndex:
    """The meshes and models among the first `MAX_FILES` files of a folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def find(self, file: Path) -> Path | None:
        """Return the only file with the longest common end, ignoring case."""
        named = self._by_name.get(file.name.casefold(), [])
        longest = max((_common_end(path, file) for path in named), default=0)
        best = [path for path in named if _common_end(path, file) == longest]
        return best[0] if len(best) == 1 else None

    @cached_property
    def _by_name(self) -> dict[str, list[Path]]:
        found: dict[str, list[Path]] = {}
        for path in islice(self._folder.rglob("*"), MAX_FILES):
            if path.suffix.casefold() in (*READABLE, *MODELS):
                found.setdefault(path.name.casefold(), []).append(path)
        return found


def _common_end(one: Path, other: Path) -> int:
    """Return how many trailing parts of two paths are equal, ignoring case."""
    pairs = zip(reversed(one.parts), reversed(other.parts), strict=False)
    same = (a.casefold() == b.casefold() for a, b in pairs)
    return sum(takewhile(bool, same))


def write_stl(path: Path, vertices: Matrix, faces: Indices) -> None:
    """Write triangles, shape (m, 3) into vertices (n, 3), as a binary STL file."""
    write_mesh(path, vertices, faces, kind="stl")


def write_mesh(
    path: Path, vertices: Matrix, faces: Indices, *, kind: Literal["stl", "obj"]
) -> None:
    """Write triangles, shape (m, 3) into vertices (n, 3), as binary STL or OBJ."""
    mesh = _trimesh().Trimesh(vertices, faces, process=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    content = mesh.export(file_type=kind)
    path.write_bytes(content.encode() if isinstance(content, str) else content)


def can_read(path: Path) -> bool:
    """Whether `read_points` can read a file, by its suffix."""
    return path.suffix.lower() in READABLE


def read_points(path: Path) -> Matrix:
    """Read the vertices (n, 3) of an STL, OBJ, COLLADA or glTF file, m.

    Raises:
        DescriptionError: If it is not a mesh.
    """
    points, _ = read_triangles(path)
    if points.shape[1:] != (3,) or not len(points) or not np.isfinite(points).all():
        raise DescriptionError(f"{path}: not a readable mesh: no finite points.")
    return np.unique(points, axis=0)


def read_triangles(path: Path) -> tuple[Matrix, Indices]:
    """Read vertices (n, 3) and triangles (m, 3) of a mesh file, m; none if it has none.

    Raises:
        DescriptionError: If it is not a mesh.
    """
    data = read_bytes(path, most=MAX_BYTES, error=DescriptionError)
    try:
        return triangles_of(load_scene(path, data, skip_materials=True).to_geometry())
    except Exception as error:  # trimesh raises anything for a malformed file
        raise DescriptionError(f"{path}: not a readable mesh: {error}.") from error


def _trimesh() -> Any:
    """Import trimesh, which takes 0.3 s and has no types."""
    return importlib.import_module("trimesh")


def load_scene(path: Path, data: bytes, **options: Any) -> Any:
    """Return trimesh's scene of a file; raises anything for a malformed one."""
    # by its content, since trimesh would open the files that a path's file names
    kind = path.suffix[1:].lower()
    with np.errstate(invalid="ignore"):  # of NaN, which is refused
        return _trimesh().load_scene(
            io.BytesIO(data), file_type=kind, process=False, **options
        )


def triangles_of(mesh: Any) -> tuple[Matrix, Indices]:
    """Return vertices (n, 3), m, and triangles (m, 3) of trimesh's mesh, or points."""
    factor, times, _ = str(mesh.units).partition(" * ")  # "0.0254 * meters"
    unit = float(factor) if times else 1.0
    faces = np.asarray(getattr(mesh, "faces", np.empty((0, 3))), np.int64)
    return np.asarray(mesh.vertices, np.float64) * unit, faces
