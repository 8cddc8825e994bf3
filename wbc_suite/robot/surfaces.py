"""Surfaces of meshes as they are drawn: decimated, one for each colour, and cached.

Textures are not kept. A triangle gets the colour that its texture has at its centre,
one of `TEXTURE_COLORS` in a mesh.
"""

import hashlib
import importlib
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from scipy.spatial import cKDTree

from wbc_suite.catalogue import user_cache
from wbc_suite.errors import ConfigError, DescriptionError, WbcError
from wbc_suite.files import check_file, read_bytes
from wbc_suite.robot.mesh_files import (
    MAX_BYTES,
    load_scene,
    read_triangles,
    triangles_of,
)
from wbc_suite.robot.shapes import (
    Rgba,
    SkinMesh,
    Surface,
    Vector3,
    cached_by_shape,
)
from wbc_suite.robot.xml_files import inside
from wbc_suite.typing import Indices, Matrix

EDGE = 0.008
"""Edge length in m to which skins are decimated; finer meshes render slowly."""
MIN_TRIANGLES = 400  # number of triangles below which a skin is not decimated
AGGRESSION = 5.0  # how quickly edges are collapsed; the default of 7 tears thin shells
CACHE_VERSION = 2  # raised when the content of the cache changes
TEXTURE_COLORS = 8  # most colours of a mesh with a texture, or with colours of vertices
MAX_PIXELS = 20_000_000  # of a texture; 60 MB as RGB


@cached_by_shape
def skin_triangles(shape: SkinMesh) -> tuple[Matrix, Indices]:
    """Return vertices (n, 3) in the shape's frame and faces (m, 3), decimated.

    Raises:
        ConfigError: If the file is not a mesh.
    """
    surface = shape.surface
    if surface is None:
        path = Path(shape.file)
        key = f"one {_state(path)} {shape.scale}"
        surface = _kept(key, lambda: [_decimated(_read_one(path, shape.scale))])[0]
    return surface.vertices.astype(np.float64), surface.faces.astype(np.int64)


def surfaces_of_file(
    path: Path, scale: Vector3, *, folder: Path
) -> tuple[Surface, ...]:
    """Return the surfaces of a mesh file in its own frame, scaled.

    Materials and pictures that it names are read from the folder alone.

    Raises:
        ConfigError: If it is not a mesh.
    """
    return _surfaces_of_file(path, scale, folder, _state(path))


@lru_cache(maxsize=256)
def _surfaces_of_file(
    path: Path, scale: Vector3, folder: Path, state: str
) -> tuple[Surface, ...]:
    def read() -> list[Surface]:
        try:
            return list(_colored(path, scale, folder))
        except Exception:  # noqa: BLE001  (trimesh raises anything for odd materials)
            return [_decimated(_read_one(path, scale))]

    return _kept(f"colored {state} {scale}", read)


def surfaces_of_triangles(
    vertices: Matrix, faces: Indices, colors: Matrix | None
) -> tuple[Surface, ...]:
    """Return the surfaces of triangles (m, 3) into vertices (n, 3), m.

    Colours, shape (m, 3), are those of the triangles, red green blue from 0 to 1.

    Raises:
        ValueError: If they are no triangles.
    """
    whole = Surface(*_merged(vertices, faces))
    if colors is None:
        return _kept(whole.digest, lambda: [_decimated(whole)])
    key = hashlib.sha256(colors.astype(np.float32).tobytes()).hexdigest()
    return _kept(whole.digest + key, lambda: list(_painted(whole, colors)))


def _state(path: Path) -> str:
    """Return what tells one version of a file from another."""
    state = check_file(path, most=MAX_BYTES)
    return f"{path} {state.st_size} {state.st_mtime_ns}"


def _kept(key: str, make: Callable[[], list[Surface]]) -> tuple[Surface, ...]:
    """Return surfaces from the user's cache folder; make those that it lacks."""
    name = hashlib.sha256(f"{CACHE_VERSION} {key}".encode()).hexdigest()[:32]
    file = user_cache() / "skins" / f"{name}.npz"
    try:
        with np.load(file, allow_pickle=False) as data:
            return tuple(
                Surface(
                    *_checked(data[f"vertices{k}"], data[f"faces{k}"]),
                    _rgba(data["colors"][k]),
                )
                for k in range(len(data["colors"]))
            )
    except Exception:  # noqa: BLE001  (numpy raises anything for a damaged file)
        made = tuple(make())
    arrays: dict[str, Any] = {
        "colors": np.array([surface.color or [np.nan] * 4 for surface in made])
    }
    for k, surface in enumerate(made):
        arrays |= {f"vertices{k}": surface.vertices, f"faces{k}": surface.faces}
    with suppress(OSError):  # the folder cannot be written
        file.parent.mkdir(parents=True, exist_ok=True)
        part = file.with_suffix(f".{os.getpid()}.npz")
        np.savez_compressed(part, **arrays)
        part.replace(file)
    return made


def _rgba(values: Any) -> Rgba | None:
    red, green, blue, alpha = (round(float(v), 4) for v in values)
    return None if np.isnan(alpha) else (red, green, blue, alpha)


def _read_one(path: Path, scale: Vector3) -> Surface:
    """Read a file as one mesh, without its colours."""
    try:
        vertices, faces = read_triangles(path)
    except DescriptionError as error:
        raise ConfigError(str(error)) from error
    try:
        return _scaled(vertices, faces, scale)
    except ValueError as error:
        raise ConfigError(f"{path}: not a readable mesh: {error}.") from error


def _scaled(vertices: Matrix, faces: Indices, scale: Vector3) -> Surface:
    # a reflection turns the faces inside out
    turned = faces[:, ::-1] if np.prod(scale) < 0.0 else faces
    return Surface(*_merged(vertices * scale, turned))


def _colored(path: Path, scale: Vector3, folder: Path) -> Iterator[Surface]:
    """Yield the surfaces of a file by the colours of its materials."""
    data = read_bytes(path, most=MAX_BYTES)
    scene = load_scene(path, data, resolver=_Beside(path, folder))
    plain: dict[Rgba | None, list[Any]] = {}
    for mesh in scene.dump():
        if len(getattr(mesh, "faces", ())) == 0:
            continue
        mesh.units = mesh.units or scene.units
        color, colors = _colors_of(mesh)
        if colors is None:
            plain.setdefault(color, []).append(mesh)
        else:
            yield from _painted(_scaled(*triangles_of(mesh), scale), colors)
    for color, meshes in plain.items():
        parts = [_scaled(*triangles_of(mesh), scale) for mesh in meshes]
        starts = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
        faces = [p.faces + start for p, start in zip(parts, starts, strict=True)]
        vertices = np.concatenate([part.vertices for part in parts])
        yield _decimated(Surface(*_merged(vertices, np.concatenate(faces)), color))


def _colors_of(mesh: Any) -> tuple[Rgba | None, Matrix | None]:
    """Return the colour of a mesh of trimesh's, or those of its faces, shape (m, 3)."""
    visual = mesh.visual
    if visual.kind in ("vertex", "face"):
        colors = np.asarray(visual.face_colors[:, :3], np.float64) / 255.0
        same = (colors == colors[0]).all()
        return (_rgba([*colors[0], 1.0]), None) if same else (None, colors)
    if visual.kind != "texture" or getattr(visual, "material", None) is None:
        return None, None
    material, image = visual.material, None
    blended = getattr(material, "alphaMode", None) == "BLEND"
    for key in ("image", "baseColorTexture"):
        image = getattr(material, key, None) or image
    if image is not None and visual.uv is not None:
        if image.width * image.height > MAX_PIXELS:
            return None, None
        uv = visual.uv[mesh.faces].mean(axis=1)
        return None, texels(np.asarray(image.convert("RGB")), uv)
    if getattr(material, "name", None) is None and not blended:
        stated = getattr(material, "baseColorFactor", None) is not None
        if not stated and getattr(material, "diffuse", None) is None:
            return None, None
    red, green, blue, alpha = np.asarray(material.main_color[:4], np.float64) / 255.0
    return _rgba([red, green, blue, alpha if blended else 1.0]), None


def texels(pixels: Any, uv: Matrix) -> Matrix:
    """Return the colours, shape (m, 3), of a picture (h, w, 3) at places (m, 2).

    Places count from the lower left corner and repeat beyond 1.
    """
    height, width = pixels.shape[:2]
    u, v = np.nan_to_num(uv).T % 1.0
    row = np.minimum(((1.0 - v) * height).astype(np.int64), height - 1)
    return pixels[row, np.minimum((u * width).astype(np.int64), width - 1)] / 255.0


def _painted(whole: Surface, colors: Matrix) -> Iterator[Surface]:
    """Yield a surface by the colours of its triangles, of which it keeps a few."""
    strip = Image.fromarray(np.rint(255.0 * colors).astype(np.uint8)[None])
    quantised = strip.quantize(TEXTURE_COLORS)
    centres = whole.vertices[whole.faces].mean(axis=1)
    few = _decimated(whole)
    _, nearest = cKDTree(centres).query(few.vertices[few.faces].mean(axis=1))
    index = np.asarray(quantised)[0][nearest]
    palette = np.asarray(quantised.getpalette(), np.float64).reshape(-1, 3) / 255.0
    for k in np.unique(index):
        used, faces = np.unique(few.faces[index == k], return_inverse=True)
        own = few.vertices[used], faces.reshape(-1, 3)
        yield Surface(*own, _rgba([*palette[k], 1.0]))


def _merged(vertices: Matrix, faces: Indices) -> tuple[Matrix, Indices]:
    """Merge equal vertices, so that decimation keeps the surface; see `_checked`."""
    vertices, faces = _checked(vertices, faces)
    own, place = np.unique(vertices.astype(np.float32), axis=0, return_inverse=True)
    faces = place.ravel()[faces]
    a, b, c = faces.T
    return _checked(own, faces[(a != b) & (b != c) & (c != a)])


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


def _decimated(surface: Surface) -> Surface:
    vertices, faces = surface.vertices, surface.faces
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    target = max(MIN_TRIANGLES, round(area / (0.433 * EDGE**2)))
    if target >= len(faces):
        return surface
    # it has no types
    points, triangles = importlib.import_module("fast_simplification").simplify(
        vertices, faces, target_count=target, agg=AGGRESSION
    )
    return Surface(np.asarray(points), np.asarray(triangles), surface.color)


class _Beside(Mapping[str, bytes]):
    """The files that a mesh file names, in one folder."""

    def __init__(self, path: Path, folder: Path) -> None:
        self._path, self._folder = path, folder

    def __getitem__(self, name: str) -> bytes:
        try:
            file = inside(self._folder, self._path.parent / name, source=self._path)
            return read_bytes(file, most=MAX_BYTES)
        except WbcError as error:
            raise KeyError(name) from error

    def get(self, key: str, default: Any = None) -> bytes:
        """Return the content of a file; raises KeyError, as trimesh expects."""
        return self[key]

    def __iter__(self) -> Iterator[str]:
        return iter(())

    def __len__(self) -> int:
        return 0
