"""Read, thin out and keep the meshes of skins."""

import hashlib
import importlib
import os
from pathlib import Path
from typing import Any

import numpy as np

from wbc_suite.errors import ConfigError
from wbc_suite.robot.mesh_files import MAX_BYTES
from wbc_suite.robot.shapes import SkinMesh, Vector3, kept_by_shape
from wbc_suite.typing import Indices, Matrix
from wbc_suite.user_cache import user_cache

__all__ = ["skin_triangles"]

EDGE = 0.008
"""Edge in m of the triangles that are kept: finer ones only slow software renderers."""
LEAST = 400
"""Triangles that even a small mesh may keep."""
AGGRESSION = 5.0
"""How quickly edges are collapsed; the default of 7 tears thin shells."""
VERSION = 1
"""Raised when what is kept changes."""


@kept_by_shape
def skin_triangles(shape: SkinMesh) -> tuple[Matrix, Indices]:
    """Return vertices (n, 3) in the shape's frame and faces (m, 3), thinned out.

    Raises:
        ConfigError: If the file is no mesh, or what thins meshes is not installed.
    """
    path = Path(shape.file)
    kept = _cache_folder() / f"{_digest(path, shape.scale)}.npz"
    if kept.is_file():
        with np.load(kept, allow_pickle=False) as data:
            vertices, faces = data["vertices"], data["faces"]
    else:
        vertices, faces = _thinned(*_read(path, shape.scale))
        _keep(kept, vertices, faces)
    return vertices.astype(np.float64), faces.astype(np.int64)


def _read(path: Path, scale: Vector3) -> tuple[Matrix, Indices]:
    """Read a file; equal points become one, or the surface would come apart."""
    if path.stat().st_size > MAX_BYTES:
        raise ConfigError(
            f"{path}: larger than the {MAX_BYTES} bytes of a skin's mesh."
        )
    try:
        mesh = _extra("trimesh").load_mesh(path, skip_materials=True)
    except ConfigError:
        raise
    except Exception as error:  # whatever a reader of foreign files meets
        raise ConfigError(f"{path}: not a readable mesh: {error}.") from error
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    vertices, faces = np.asarray(mesh.vertices) * scale, np.asarray(mesh.faces)
    if np.prod(scale) < 0.0:  # mirrored: what was outside is inside
        faces = faces[:, ::-1]
    if not len(faces) or not np.isfinite(vertices).all():
        raise ConfigError(f"{path}: not a readable mesh: no finite triangles in it.")
    return vertices, faces


def _thinned(vertices: Matrix, faces: Indices) -> tuple[Matrix, Indices]:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    area = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    target = max(LEAST, round(area / (0.433 * EDGE**2)))
    if target >= len(faces):
        return vertices, faces
    points, triangles = _extra("fast_simplification").simplify(
        vertices.astype(np.float32),
        faces.astype(np.int32),
        target_count=target,
        agg=AGGRESSION,
    )
    return np.asarray(points), np.asarray(triangles)


def _extra(name: str) -> Any:
    """Import a module of the extra `skins`; they have no types."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise ConfigError(
            f"skin: meshes need {name.replace('_', '-')}, which is not installed. "
            "Install it with: pip install 'wbc-suite[skins]'"
        ) from None


def _digest(path: Path, scale: Vector3) -> str:
    state = path.stat()
    text = f"{VERSION} {path} {state.st_size} {state.st_mtime_ns} {scale}"
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def _cache_folder() -> Path:
    return user_cache() / "skins"


def _keep(path: Path, vertices: Matrix, faces: Indices) -> None:
    """Store what was thinned out, unless the folder cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(f".{os.getpid()}.npz")
        np.savez_compressed(part, vertices=vertices.astype(np.float32), faces=faces)
        part.replace(path)
    except OSError:
        return
