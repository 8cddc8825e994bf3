"""Mesh files (STL, OBJ, glTF, COLLADA): write them, read points and skins."""

import hashlib
import importlib
import io
import os
from contextlib import suppress
from functools import cached_property
from itertools import islice, takewhile
from pathlib import Path
from typing import Any

import numpy as np

from wbc_suite.catalogue import user_cache
from wbc_suite.errors import ConfigError, DescriptionError
from wbc_suite.files import check_file, read_bytes
from wbc_suite.robot.shapes import SkinMesh, Vector3, cached_by_shape
from wbc_suite.typing import Indices, Matrix

READABLE = (".stl", ".obj", ".glb", ".dae")  # suffixes of files that are meshes
MAX_BYTES = 100_000_000  # largest mesh file that is read
MAX_FILES = 20_000  # of a folder that is searched for meshes

EDGE = 0.008
"""Edge length in m to which skins are decimated; finer meshes render slowly."""
MIN_TRIANGLES = 400  # number of triangles below which a skin is not decimated
AGGRESSION = 5.0  # how quickly edges are collapsed; the default of 7 tears thin shells
CACHE_VERSION = 1  # raised when the content of the cache changes


class MeshIndex:
    """The meshes among the first `MAX_FILES` files of a folder, found by their ends."""

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
            if path.suffix.casefold() in READABLE:
                found.setdefault(path.name.casefold(), []).append(path)
        return found


def _common_end(one: Path, other: Path) -> int:
    """Return how many trailing parts of two paths are equal, ignoring case."""
    pairs = zip(reversed(one.parts), reversed(other.parts), strict=False)
    same = (a.casefold() == b.casefold() for a, b in pairs)
    return sum(takewhile(bool, same))


def write_stl(path: Path, vertices: Matrix, faces: Indices) -> None:
    """Write triangles, shape (m, 3) into vertices (n, 3), as a binary STL file."""
    mesh = _trimesh().Trimesh(vertices, faces, process=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(mesh.export(file_type="stl"))


def can_read(path: Path) -> bool:
    """Whether `read_points` can read a file, by its suffix."""
    return path.suffix.lower() in READABLE


def read_points(path: Path) -> Matrix:
    """Read the vertices (n, 3) of an STL, OBJ, COLLADA or glTF file, m.

    Raises:
        DescriptionError: If it is not a mesh.
    """
    data = read_bytes(path, most=MAX_BYTES, error=DescriptionError)
    try:
        points = _vertices(_loaded(path, data))
    except Exception as error:  # trimesh raises anything for a malformed file
        raise DescriptionError(f"{path}: not a readable mesh: {error}.") from error
    if points.shape[1:] != (3,) or not len(points) or not np.isfinite(points).all():
        raise DescriptionError(f"{path}: not a readable mesh: no finite points.")
    return np.unique(points, axis=0)


def _trimesh() -> Any:
    """Import trimesh, which takes 0.3 s and has no types."""
    return importlib.import_module("trimesh")


def _loaded(path: Path, data: bytes) -> Any:
    """Return trimesh's mesh of a file, or its points if it has no faces."""
    # by its content, since trimesh would open the files that a path's file names
    kind = path.suffix[1:].lower()
    with np.errstate(invalid="ignore"):  # of NaN, which is refused
        scene = _trimesh().load_scene(
            io.BytesIO(data), file_type=kind, process=False, skip_materials=True
        )
        return scene.to_geometry()


@cached_by_shape
def skin_triangles(shape: SkinMesh) -> tuple[Matrix, Indices]:
    """Return vertices (n, 3) in the shape's frame and faces (m, 3), decimated.

    Results are kept in the user's cache folder.

    Raises:
        ConfigError: If the file is not a mesh, or the extra `skins` is not installed.
    """
    path = Path(shape.file)
    state = check_file(path, most=MAX_BYTES)
    key = f"{CACHE_VERSION} {path} {state.st_size} {state.st_mtime_ns} {shape.scale}"
    name = hashlib.sha256(key.encode()).hexdigest()[:32]
    kept = user_cache() / "skins" / f"{name}.npz"
    try:
        with np.load(kept, allow_pickle=False) as data:
            vertices, faces = _checked(data["vertices"], data["faces"])
    except Exception:  # noqa: BLE001  (numpy raises anything for a damaged file)
        vertices, faces = _decimated(*_read_mesh(path, shape.scale))
        with suppress(OSError):  # the folder cannot be written
            kept.parent.mkdir(parents=True, exist_ok=True)
            part = kept.with_suffix(f".{os.getpid()}.npz")
            np.savez_compressed(part, vertices=vertices.astype(np.float32), faces=faces)
            part.replace(kept)
    return vertices.astype(np.float64), faces.astype(np.int64)


def _read_mesh(path: Path, scale: Vector3) -> tuple[Matrix, Indices]:
    """Read a file; equal points are merged, so that decimation keeps the surface."""
    data = read_bytes(path, most=MAX_BYTES)
    try:
        mesh = _loaded(path, data)
        mesh.merge_vertices(merge_tex=True, merge_norm=True)
        # a reflection turns the faces inside out
        faces = mesh.faces[:, ::-1] if np.prod(scale) < 0.0 else mesh.faces
        return _checked(_vertices(mesh) * scale, np.asarray(faces))
    except Exception as error:  # trimesh raises anything for a malformed file
        raise ConfigError(f"{path}: not a readable mesh: {error}.") from error


def _vertices(mesh: Any) -> Matrix:
    """Return the vertices of trimesh's mesh, m."""
    factor, times, _ = str(mesh.units).partition(" * ")  # "0.0254 * meters"
    return np.asarray(mesh.vertices, np.float64) * (float(factor) if times else 1.0)


def _checked(vertices: Matrix, faces: Indices) -> tuple[Matrix, Indices]:
    """Return triangles; raises ValueError if they are none."""
    shapes = vertices.shape[1:] == faces.shape[1:] == (3,)
    if not (shapes and faces.size and np.isfinite(vertices).all()):
        raise ValueError("no finite triangles")
    if len(vertices) < 4:
        raise ValueError("fewer than 4 vertices, which MuJoCo refuses")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise ValueError("triangles of vertices that it lacks")
    return vertices, faces


def _decimated(vertices: Matrix, faces: Indices) -> tuple[Matrix, Indices]:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    target = max(MIN_TRIANGLES, round(area / (0.433 * EDGE**2)))
    if target >= len(faces):
        return vertices, faces
    points, triangles = _import_extra("fast_simplification").simplify(
        vertices.astype(np.float32),
        faces.astype(np.int32),
        target_count=target,
        agg=AGGRESSION,
    )
    return np.asarray(points), np.asarray(triangles)


def _import_extra(name: str) -> Any:
    """Import a module of the extra `skins`; these modules have no types."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise ConfigError(
            f"Meshes need the package of '{name}', which is not installed. "
            "Install it with: pip install 'wbc-suite[skins]'"
        ) from None
