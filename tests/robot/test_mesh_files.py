"""Mesh files: written ones are read back, and broken ones are refused."""

import numpy as np
import pytest

from wbc_suite.errors import DescriptionError
from wbc_suite.robot import mesh_files
from wbc_suite.robot.mesh_files import read_points, write_stl
from wbc_suite.robot.triangle_meshes import box_mesh

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("tag", "<u2")])
"""One record of a binary STL file, which begins with 80 bytes and a count."""
SIGNALLING = b"\0\0\xa0\x7f"  # NaN, of which numpy warns in a cast
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-2, 2) for z in (-3, 3)])


def test_an_stl_file_keeps_its_points(tmp_path):
    mesh = box_mesh(np.array([1.0, 2.0, 3.0]))
    path = tmp_path / "new" / "box.stl"
    write_stl(path, mesh.vertices, mesh.faces)
    np.testing.assert_array_equal(read_points(path), CORNERS)
    assert path.stat().st_size == 84 + 50 * len(mesh.faces)


def test_normals_of_an_stl_file_point_outward(tmp_path):
    mesh = box_mesh(np.array([1.0, 2.0, 3.0]))
    write_stl(tmp_path / "box.stl", mesh.vertices, mesh.faces)
    data = (tmp_path / "box.stl").read_bytes()
    records = np.frombuffer(data, dtype=TRIANGLE, offset=84)
    np.testing.assert_allclose(np.linalg.norm(records["normal"], axis=1), 1, atol=1e-6)
    outward = np.einsum("ij,ij->i", records["normal"], records["corners"].mean(axis=1))
    assert outward.min() > 0.0


def test_a_triangle_without_area_has_no_normal(tmp_path):
    write_stl(tmp_path / "flat.stl", np.zeros((3, 3)), np.array([[0, 1, 2]]))
    np.testing.assert_array_equal(read_points(tmp_path / "flat.stl"), [[0, 0, 0]])


def test_text_files_are_read(tmp_path):
    obj, stl = tmp_path / "a.OBJ", tmp_path / "a.stl"
    obj.write_text(
        "# made by hand\nv 1 2 3\nvn 0 0 1\nv -1 0 0.5 0.2 0.2 0.2\nf 1 2 1\n"
    )
    np.testing.assert_array_equal(read_points(obj), [[-1, 0, 0.5], [1, 2, 3]])
    corners = "".join(f" vertex {x} 2 3\n" for x in (1, 2, 3))
    facet = f"facet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\n"
    stl.write_text(f"solid a\n{facet}endsolid a\n")
    np.testing.assert_array_equal(read_points(stl), [[1, 2, 3], [2, 2, 3], [3, 2, 3]])


def test_points_without_faces_are_read(tmp_path):
    (tmp_path / "a.obj").write_text("v 1 2 3\nv 0 0 0\n")
    np.testing.assert_array_equal(
        read_points(tmp_path / "a.obj"), [[0, 0, 0], [1, 2, 3]]
    )


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.stl", b"", "no finite points"),
        ("a.obj", b"f 1 2 3\n", "no finite points"),
        ("a.obj", b"v 1 2 nan\n", "no finite points"),
        ("a.obj", b"v 1 2 x\n", "not a readable mesh: string or file"),
        ("a.obj", b"v 1 2\nv 1 2 3\n", "not a readable mesh"),
        ("a.stl", b"\0" * 80 + b"\1\0\0\0" + b"\xff" * 50, "no finite points"),
        ("a.stl", bytes(80) + b"\1\0\0\0" + SIGNALLING * 12 + b"\0\0", "no finite"),
    ],
)
def test_broken_files_are_refused(tmp_path, name, content, message):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(DescriptionError, match=message) as caught:
        read_points(path)
    assert str(path) in str(caught.value)


def test_large_files_are_not_read(tmp_path, monkeypatch):
    monkeypatch.setattr(mesh_files, "MAX_BYTES", 10)
    path = tmp_path / "a.obj"
    path.write_text("v 1 2 3 # and more")
    with pytest.raises(DescriptionError, match="has 18 bytes; at most 10 are read"):
        read_points(path)
