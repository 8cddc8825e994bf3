"""Read and write the points of mesh files (STL, OBJ)."""

from pathlib import Path

import numpy as np

from wbc_suite.errors import DescriptionError
from wbc_suite.typing import Indices, Matrix

__all__ = ["READABLE", "read_points", "write_stl"]

READABLE = (".stl", ".obj")
"""Endings of the files that `read_points` understands."""
MAX_BYTES = 100_000_000
"""Largest mesh file that is read."""

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("tag", "<u2")])
"""One record of a binary STL file, which begins with 80 bytes and a count."""
HEADER = 84


def write_stl(path: Path, vertices: Matrix, faces: Indices) -> None:
    """Write triangles, shape (m, 3) into vertices (n, 3), as a binary STL file."""
    records = np.zeros(len(faces), dtype=TRIANGLE)
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    records["normal"] = normal / np.where(length > 0.0, length, 1.0)
    records["corners"] = corners
    path.parent.mkdir(parents=True, exist_ok=True)
    count = np.array([len(faces)], dtype="<u4").tobytes()
    path.write_bytes(b"\0" * (HEADER - len(count)) + count + records.tobytes())


def read_points(path: Path) -> Matrix:
    """Read the vertices, shape (n, 3), of an STL or OBJ file.

    Raises:
        DescriptionError: If the file is too large, of another kind, or broken.
    """
    size = path.stat().st_size
    if size > MAX_BYTES:
        raise DescriptionError(
            f"{path}: {size} bytes, more than the {MAX_BYTES} that a mesh may have."
        )
    try:
        data = path.read_bytes()
        if path.suffix.lower() == ".obj":
            points = _text_points(data, b"v")
        elif len(data) >= HEADER and _stl_size(data) == size:
            records = np.frombuffer(data, dtype=TRIANGLE, offset=HEADER)
            points = records["corners"].reshape(-1, 3).astype(np.float64)
        else:
            points = _text_points(data, b"vertex")
    except ValueError as error:
        raise DescriptionError(f"{path}: not a readable mesh: {error}.") from error
    if len(points) == 0 or not np.isfinite(points).all():
        raise DescriptionError(f"{path}: not a readable mesh: no finite points in it.")
    return np.unique(points, axis=0)


def _stl_size(data: bytes) -> int:
    count = int(np.frombuffer(data, dtype="<u4", offset=HEADER - 4, count=1)[0])
    return HEADER + count * TRIANGLE.itemsize


def _text_points(data: bytes, keyword: bytes) -> Matrix:
    """Read the lines `keyword x y z` of a text file."""
    rows = (line.split() for line in data.splitlines())
    points = [row[1:4] for row in rows if row and row[0] == keyword]
    return np.array(points, dtype=np.float64).reshape(-1, 3)
