"""Generated meshes: closed, outward, of the right volume, and kept by MJCF text."""

import mujoco
import numpy as np
import pytest

from wbc_suite.errors import DescriptionError
from wbc_suite.robot import load_robot
from wbc_suite.robot.mjcf import build_mjspec
from wbc_suite.robot.shapes import Box, Cylinder, Hull, Loft
from wbc_suite.robot.surfaces import mesh_of

RINGS = ((0.0, 0.0, 0.0, 0.1, 0.1), (0.5, 0.0, 0.0, 0.1, 0.1))
SHAPES = {
    "sphere": (
        Hull(shape="hull", spheres=((0.1, 0.2, 0.3, 0.5),)),
        4 / 3 * np.pi * 0.5**3,
        0.05,
    ),
    "swept sphere": (
        Hull(shape="hull", spheres=((0, 0, 0, 0.1), (0, 0, 1, 0.1))),
        np.pi * 0.01 + 4 / 3 * np.pi * 0.001,
        0.05,
    ),
    "tetrahedron": (
        Hull(
            shape="hull",
            spheres=((0, 0, 0, 0), (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0)),
        ),
        1 / 6,
        1e-12,
    ),
    "rounded box": (
        Box(shape="box", size=(0.3, 0.2, 0.1), radius=0.02),
        0.6 * 0.4 * 0.2,
        0.05,
    ),
    "cone": (
        Cylinder(
            shape="cylinder", start=(0, 0, 0), end=(0, 1, 0), radius=0.2, radius_to=0.1
        ),
        np.pi / 3 * (0.04 + 0.02 + 0.01),
        0.012,  # a ring of 24 points holds 98.9 % of its circle
    ),
    "loft along z": (Loft(shape="loft", sections=RINGS), np.pi * 0.01 * 0.5, 0.012),
    "loft along y": (
        Loft(shape="loft", axis="y", sections=RINGS),
        np.pi * 0.01 * 0.5,
        0.012,
    ),
    "loft along x, boxy": (
        Loft(shape="loft", axis="x", sections=RINGS, exponent=20),
        0.2 * 0.2 * 0.5,
        0.05,
    ),
}


def signed_volume(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


@pytest.mark.parametrize("name", SHAPES)
def test_meshes_are_closed_and_have_the_analytic_volume(name):
    shape, volume, tolerance = SHAPES[name]
    vertices, faces = mesh_of(shape)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    directed = {tuple(edge) for edge in edges.tolist()}
    assert len(directed) == len(edges)
    assert all((b, a) in directed for a, b in directed)
    assert signed_volume(vertices, faces) == pytest.approx(volume, rel=tolerance)


def test_a_flat_hull_is_refused():
    points = ((0, 0, 0, 0), (1, 0, 0, 0), (0, 1, 0, 0), (1, 1, 0, 0))
    with pytest.raises(DescriptionError, match="flat"):
        mesh_of(Hull(shape="hull", spheres=points))


def test_smooth_lofts_pass_through_their_rings():
    sections = ((0, 0, 0, 0.1, 0.1), (0.2, 0.05, 0, 0.2, 0.1), (0.3, 0, 0, 0.05, 0.05))
    vertices, _ = mesh_of(Loft(shape="loft", sections=sections))
    for z, x, _, half, _ in sections:
        ring = vertices[np.abs(vertices[:, 2] - z) < 1e-9]
        assert ring[:, 0].max() == pytest.approx(x + half)
        assert ring[:, 0].min() == pytest.approx(x - half)


def test_mjcf_text_carries_meshes_with_all_digits(tmp_path):
    path = tmp_path / "lump.toml"
    path.write_text("""
format = 1
[component]
name = "lump"
kind = "body"
[[link]]
name = "lump"
mass = 1.2345678901234
inertia = [0.0101, 0.0202, 0.0203, 0.0001, 0.0002, 0.0003]
visual = [
  { shape = "hull", spheres = [[0, 0, 0, 0.1], [0.123456789012, 0, 0, 0.05]] },
  { shape = "loft", sections = [[0, 0, 0, 0.1, 0.1], [0.3, 0, 0, 0.05, 0.08]] },
]
""")
    robot = load_robot(path)
    direct = build_mjspec(robot, merged=False).compile()
    read = mujoco.MjModel.from_xml_string(robot.to_mjcf())
    assert direct.nmesh == read.nmesh == 2
    np.testing.assert_allclose(read.mesh_vert, direct.mesh_vert, atol=1e-7)
    np.testing.assert_array_equal(read.body_mass, direct.body_mass)
    np.testing.assert_allclose(read.body_inertia, direct.body_inertia, rtol=1e-14)


def test_small_shapes_cost_fewer_triangles():
    finger = Hull(shape="hull", spheres=((0, 0, 0, 0.01), (0.04, 0, 0, 0.008)))
    limb = Hull(shape="hull", spheres=((0, 0, 0, 0.1), (0.4, 0, 0, 0.08)))
    (_, few), (_, many) = mesh_of(finger), mesh_of(limb)
    assert 2 * len(few) < len(many)
