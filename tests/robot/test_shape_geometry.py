"""Generated meshes: closed, outward, of the right volume, and kept by MJCF text."""

import mujoco
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from wbc_suite.errors import DescriptionError
from wbc_suite.robot import load_robot
from wbc_suite.robot.assembly import describe_component
from wbc_suite.robot.mjcf_export import build_mjspec
from wbc_suite.robot.robot_file import Component
from wbc_suite.robot.shape_geometry import (
    convex_hull,
    fit_hull,
    mesh_of,
    shape_bounds,
    support_points,
)
from wbc_suite.robot.shapes import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    Hull,
    Loft,
    Sphere,
)

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


POSE = {"pos": (0.1, -0.2, 0.3), "quat": (0.5, 0.5, -0.5, 0.5)}
BOUNDED = [
    Sphere(shape="sphere", radius=0.1, **POSE),
    Capsule(shape="capsule", start=(0, 0, 0), end=(0.3, 0, 0.1), radius=0.05, **POSE),
    Hull(shape="hull", spheres=((0, 0, 0, 0.1), (0.3, 0, 0, 0.02)), **POSE),
    Box(shape="box", size=(0.1, 0.2, 0.3), **POSE),
    Box(shape="box", size=(0.1, 0.2, 0.3), radius=0.05, **POSE),
    Ellipsoid(shape="ellipsoid", size=(0.1, 0.2, 0.3), **POSE),
    Cylinder(shape="cylinder", start=(0, 0, 0), end=(0, 0.3, 0.1), radius=0.1, **POSE),
    Loft(shape="loft", sections=RINGS, **POSE),
]


def lowest(shape):
    """Return the least coordinates of MuJoCo's own geom for a shape."""
    robot = Component.model_validate(
        {
            "format": 1,
            "component": {"name": "a", "kind": "body"},
            "link": [{"name": "a", "visual": [shape.model_dump(by_alias=True)]}],
        }
    )
    described = describe_component(robot, source="test")
    model = build_mjspec(described, merged=False).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    R, p = data.geom_xmat[0].reshape(3, 3), data.geom_xpos[0]
    kind, size = model.geom_type[0], model.geom_size[0]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        points = model.mesh_vert
    else:
        u = np.random.default_rng(1).normal(size=(200_000, 3))
        u /= np.linalg.norm(u, axis=1, keepdims=True)
        u = np.concatenate([u, np.eye(3), -np.eye(3), R, -R])
        points = support(kind, size, u)
    return (points @ R.T + p).min(axis=0), (points @ R.T + p).max(axis=0)


def support(kind, size, u):
    """Return the points of a primitive that are extreme along directions u."""
    kinds = mujoco.mjtGeom
    if kind == kinds.mjGEOM_SPHERE:
        return size[0] * u
    if kind == kinds.mjGEOM_BOX:
        return np.sign(u) * size
    if kind == kinds.mjGEOM_ELLIPSOID:
        return size**2 * u / np.linalg.norm(size * u, axis=1, keepdims=True)
    ends = np.sign(u[:, 2:]) * [[0, 0, size[1]]]
    if kind == kinds.mjGEOM_CAPSULE:
        return ends + size[0] * u
    ring = u[:, :2] / np.maximum(np.linalg.norm(u[:, :2], axis=1, keepdims=True), 1e-12)
    return ends + size[0] * np.column_stack([ring, np.zeros(len(u))])


@pytest.mark.parametrize("shape", BOUNDED, ids=lambda s: s.shape)
def test_bounds_are_those_of_the_geom_in_mujoco(shape):
    low, high = shape_bounds(shape)
    least, most = lowest(shape)
    # Meshes of rounded shapes lie inside them by up to 3 % of their radius.
    slack = 4e-3 if mesh_of(shape) is not None else 1e-5
    assert np.all(low <= least + 1e-6)
    assert np.all(high >= most - 1e-6)
    np.testing.assert_allclose(low, least, atol=slack)
    np.testing.assert_allclose(high, most, atol=slack)


@pytest.mark.parametrize("kind", ["sphere", "capsule", "ellipsoid"])
def test_round_shapes_have_no_support_points(kind):
    shape = next(s for s in BOUNDED if s.shape == kind)
    with pytest.raises(DescriptionError, match=f"'{kind}' is not the convex hull"):
        support_points(shape)


def test_a_fitted_hull_touches_the_cloud_along_the_axes_and_stays_inside():
    points = np.random.default_rng(4).normal(size=(5000, 3)) * [1.0, 0.5, 0.2]
    fields = fit_hull(points)
    kept = np.array(fields["spheres"])
    assert fields["shape"] == "hull"
    assert len(kept) <= 64
    assert {tuple(p) for p in kept[:, :3]} <= {tuple(p) for p in points}
    np.testing.assert_array_equal(kept[:, :3].min(axis=0), points.min(axis=0))
    np.testing.assert_array_equal(kept[:, :3].max(axis=0), points.max(axis=0))


def test_a_fitted_hull_keeps_the_corners_of_a_flat_sole():
    rng = np.random.default_rng(2)
    sole = np.array([[x, y, 0.0] for x in (-0.1, 0.15) for y in (-0.05, 0.06)])
    upper = rng.normal(size=(2000, 3))
    upper *= 0.08 / np.linalg.norm(upper, axis=1, keepdims=True)
    upper[:, 2] += 0.08
    kept = np.array(fit_hull(np.concatenate([upper, sole]))["spheres"])
    assert {tuple(p) for p in sole} <= {tuple(p) for p in kept[:, :3]}
    planes = ConvexHull(kept[:, :3]).equations
    outside = upper @ planes[:, :3].T + planes[:, 3]
    assert outside.max() < 0.004  # of a radius of 80 mm; without any point it is 80


@pytest.mark.parametrize("count", [1, 3, 50])
def test_a_flat_cloud_becomes_a_thin_box(count):
    points = np.random.default_rng(4).uniform(size=(count, 3)) * [1.0, 1.0, 0.0]
    fields = fit_hull(points)
    assert fields["shape"] == "box"
    assert min(fields["size"]) == 1e-3
    np.testing.assert_allclose(fields["pos"][2], 0.0)


@pytest.mark.parametrize(
    "scale", [(1.0, 1.0, 1.0), (1e-3, 1e-3, 1e-3), (0.3, 0.02, 1e-3)]
)
def test_hulls_are_those_of_scipy_with_faces_outward(scale):
    points = np.random.default_rng(5).normal(size=(300, 3)) * scale
    corners, faces = convex_hull(points)
    expected = ConvexHull(points)
    np.testing.assert_array_equal(corners, points[np.sort(expected.vertices)])
    places = [np.flatnonzero((points == c).all(axis=1)).item() for c in corners]
    ours = {tuple(sorted(np.array(places)[face])) for face in faces}
    assert ours == {tuple(sorted(face)) for face in expected.simplices.tolist()}
    np.testing.assert_allclose(signed_volume(corners, faces), expected.volume)
