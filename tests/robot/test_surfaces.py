"""Imports are drawn with their own meshes, in the colours of their materials."""

import mujoco
import numpy as np
import pytest
import trimesh
from PIL import Image

from wbc_suite.robot import load_robot
from wbc_suite.robot.poses import se3_of
from wbc_suite.robot.surfaces import surfaces_of_file, texels

ONES = (1.0, 1.0, 1.0)


@pytest.fixture(autouse=True)
def _own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def square(side=0.1, cells=8):
    """A square in the plane z = 0 with texture coordinates from 0 to 1."""
    steps = np.linspace(0.0, 1.0, cells + 1)
    u, v = np.meshgrid(steps, steps)
    uv = np.column_stack([u.ravel(), v.ravel()])
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    quad = np.array([[0, 1, cells + 2], [0, cells + 2, cells + 1]])
    faces = (corner[:, None, None] + quad).reshape(-1, 3)
    return np.column_stack([side * uv, np.zeros(len(uv))]), faces, uv


def half_red():
    """A picture of 16 x 16 pixels: red above, blue below."""
    pixels = np.zeros((16, 16, 3), np.uint8)
    pixels[:8, :, 0] = pixels[8:, :, 2] = 255
    return pixels


def heights_by_color(surfaces, color_of=lambda s: s.color):
    return {
        tuple(np.round(color_of(s)[:3], 2)): s.vertices[s.faces][..., 1].mean(axis=1)
        for s in surfaces
    }


def test_a_triangle_has_the_colour_of_its_texture(tmp_path):
    vertices, faces, uv = square()
    visual = trimesh.visual.TextureVisuals(uv=uv, image=Image.fromarray(half_red()))
    mesh = trimesh.Trimesh(vertices, faces, visual=visual, process=False)
    path = tmp_path / "square.glb"
    path.write_bytes(mesh.export(file_type="glb"))
    heights = heights_by_color(surfaces_of_file(path, ONES, folder=tmp_path))
    assert set(heights) == {(1, 0, 0), (0, 0, 1)}
    assert heights[1, 0, 0].min() > 0.05 > heights[0, 0, 1].max()


@pytest.mark.parametrize("where", ["beside", "outside"])
def test_materials_of_obj_are_read_from_the_folder_alone(tmp_path, where):
    folder = tmp_path / "robot"
    folder.mkdir()
    lines = "newmtl paint\nKd 0.2 0.4 0.6\n"
    (tmp_path / "paint.mtl").write_text(lines)
    (folder / "paint.mtl").write_text(lines)
    name = "paint.mtl" if where == "beside" else "../paint.mtl"
    box = trimesh.creation.box((0.1, 0.1, 0.1)).export(file_type="obj")
    path = folder / "box.obj"
    path.write_text(f"mtllib {name}\nusemtl paint\n{box}")
    (surface,) = surfaces_of_file(path, ONES, folder=folder)
    expected = pytest.approx((0.2, 0.4, 0.6, 1.0), abs=2e-3)
    assert (surface.color == expected) is (where == "beside")


def test_each_material_is_a_surface_of_its_own(tmp_path):
    scene = trimesh.Scene()
    for k, color in enumerate([(255, 0, 0, 255), (0, 255, 0, 255), (255, 0, 0, 255)]):
        box = trimesh.creation.box((0.1, 0.1, 0.1))
        box.visual = trimesh.visual.TextureVisuals(
            material=trimesh.visual.material.PBRMaterial(baseColorFactor=color)
        )
        scene.add_geometry(
            box,
            transform=trimesh.transformations.translation_matrix((0.0, 0.0, 0.2 * k)),
        )
    path = tmp_path / "boxes.glb"
    path.write_bytes(scene.export(file_type="glb"))
    found = {
        s.color: len(s.faces) for s in surfaces_of_file(path, ONES, folder=tmp_path)
    }
    assert found == {(1.0, 0.0, 0.0, 1.0): 24, (0.0, 1.0, 0.0, 1.0): 12}


def test_texels_count_from_the_lower_left_corner():
    colors = texels(half_red(), np.array([[0.1, 0.1], [0.1, 0.9], [1.1, -0.1]]))
    np.testing.assert_array_equal(colors, [[0, 0, 1], [1, 0, 0], [1, 0, 0]])


URDF = """<robot name="r"><link name="a">
<visual><origin xyz="0 0 1"/><geometry><mesh filename="ring.stl" scale="2 1 1"/>
</geometry><material name="green"><color rgba="0 1 0 1"/></material></visual>
<visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual>
<collision><geometry><mesh filename="ring.stl"/></geometry></collision>
</link></robot>"""
RING = trimesh.creation.annulus(0.04, 0.05, 0.02)


def test_a_urdf_is_drawn_with_its_mesh_and_collides_with_its_hull(tmp_path):
    RING.export(tmp_path / "ring.stl")
    path = tmp_path / "ring.urdf"
    path.write_text(URDF)
    robot, hulls = load_robot(path), load_robot(path, skin="none")
    assert not hulls.skins
    mesh, box = robot.skins["a"]
    assert (mesh.shape, box.shape) == ("skin", "box")
    assert robot.materials[mesh.color] == (0.0, 1.0, 0.0, 1.0)
    model, plain = (r.to_mjspec().compile() for r in (robot, hulls))
    points = drawn_points(model)
    top = points[points[:, 2] > 0.5]
    np.testing.assert_allclose(top.max(axis=0), (0.1, 0.05, 1.01), atol=1e-4)
    inner = np.hypot(top[:, 0] / 2, top[:, 1]).min()
    assert inner == pytest.approx(0.04, abs=1e-3), "a hull has no hole"
    for m in (model, plain):
        solid = (m.geom_contype | m.geom_conaffinity) > 0
        assert (m.geom_type[solid] == mujoco.mjtGeom.mjGEOM_MESH).all()
    assert model.body_mass.sum() == plain.body_mass.sum()


def test_a_mesh_that_cannot_be_drawn_is_drawn_as_a_hull(tmp_path, caplog):
    points = "".join(f"v {x} {y} {z}\n" for x, y, z in np.eye(4, 3) * 0.1)
    (tmp_path / "ring.stl").unlink(missing_ok=True)
    (tmp_path / "cloud.obj").write_text(points)
    path = tmp_path / "cloud.urdf"
    path.write_text(URDF.replace("ring.stl", "cloud.obj"))
    robot = load_robot(path)
    assert not robot.skins
    assert robot.to_mjspec().compile().ngeom >= 2


MJCF = """<mujoco><asset>
<texture name="t" type="2d" file="half.png"/><material name="m" texture="t"/>
<mesh name="s" file="square.obj" scale="2 2 2" inertia="shell"/></asset>
<worldbody><body pos="0 0 1"><geom type="sphere" size="0.01" mass="1"/>
<geom type="mesh" mesh="s" material="m" contype="0" conaffinity="0" group="1"
 pos="0 0 0.5" mass="0"/></body></worldbody></mujoco>"""


def test_an_mjcf_file_is_drawn_with_its_mesh_and_the_colours_of_its_texture(tmp_path):
    vertices, faces, uv = square()
    visual = trimesh.visual.TextureVisuals(uv=uv)
    mesh = trimesh.Trimesh(vertices, faces, visual=visual, process=False)
    (tmp_path / "square.obj").write_text(mesh.export(file_type="obj"))
    Image.fromarray(half_red()).save(tmp_path / "half.png")
    path = tmp_path / "square.xml"
    path.write_text(MJCF)
    robot = load_robot(path)
    ((_, drawn),) = robot.skins.items()
    assert {shape.shape for shape in drawn} == {"skin"}, "what only collides is hidden"
    points = drawn_points(robot.to_mjspec().compile()) - (0.0, 0.0, 1.5)
    np.testing.assert_allclose(points.max(axis=0), (0.2, 0.2, 0.0), atol=1e-5)
    heights = {tuple(np.round(s.color[:3])): placed(s)[:, 1] for s in drawn}
    assert heights[1, 0, 0].mean() > 0.1 > heights[0, 0, 1].mean()


def placed(shape):
    """Return the vertices of a shape in its link."""
    pose = se3_of(shape)
    return shape.surface.vertices @ pose.rotation.T + pose.translation


def drawn_points(model):
    """Return the vertices that are drawn and do not collide, in the world."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    found = []
    for g in np.flatnonzero((model.geom_contype | model.geom_conaffinity) == 0):
        if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_MESH:
            mesh = model.geom_dataid[g]
            first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
            points = model.mesh_vert[first : first + count]
            R = data.geom_xmat[g].reshape(3, 3)
            found.append(data.geom_xpos[g] + points @ R.T)
    return np.concatenate(found)
