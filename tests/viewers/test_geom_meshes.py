import mujoco
import numpy as np
import pytest

from wbc_suite.robot.triangle_meshes import merge
from wbc_suite.viewers.model_scene import colored_meshes, geom_mesh

VOLUMES = {
    'type="box" size="0.1 0.2 0.3"': 8 * 0.1 * 0.2 * 0.3,
    'type="sphere" size="0.1"': 4 / 3 * np.pi * 0.1**3,
    'type="ellipsoid" size="0.1 0.2 0.3"': 4 / 3 * np.pi * 0.1 * 0.2 * 0.3,
    'type="capsule" size="0.1 0.3"': np.pi * 0.1**2 * (4 / 3 * 0.1 + 0.6),
    'type="cylinder" size="0.1 0.3"': np.pi * 0.1**2 * 0.6,
}


def compiled(geom, asset=""):
    xml = (
        f"<mujoco><asset>{asset}</asset><worldbody><geom {geom}/></worldbody></mujoco>"
    )
    return mujoco.MjModel.from_xml_string(xml)


def volume(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return np.sum(np.cross(a, b) * c) / 6


@pytest.mark.parametrize("geom", VOLUMES)
def test_mesh_encloses_the_volume_with_faces_outwards(geom):
    mesh = geom_mesh(compiled(geom), 0)
    # A polygon of 24 sides has 0.989 of its circle's area; inside-out would be < 0.
    assert volume(mesh) == pytest.approx(VOLUMES[geom], rel=0.03)


def test_mesh_asset_comes_with_its_own_vertices():
    asset = '<mesh name="m" vertex="0 0 0  1 0 0  0 1 0  0 0 1"/>'
    mesh = geom_mesh(compiled('type="mesh" mesh="m"', asset), 0)
    assert volume(mesh) == pytest.approx(1 / 6)


def test_plane_has_no_mesh():
    assert geom_mesh(compiled('type="plane" size="1 1 1"'), 0) is None


def test_merged_and_moved_meshes_keep_their_triangles():
    mesh = geom_mesh(compiled('type="box" size="0.1 0.2 0.3"'), 0)
    assert mesh is not None
    away = mesh.moved(np.array([1.0, 0, 0]), np.eye(3)[[1, 2, 0]])
    both = merge([mesh, away])
    assert volume(both) == pytest.approx(2 * volume(mesh))
    np.testing.assert_allclose(away.vertices.mean(axis=0), [1, 0, 0], atol=1e-12)


GREY_WOOD = """
<texture name="wood" type="2d" builtin="flat" rgb1="0.5 0.5 0.5" width="8" height="8"/>
<material name="wood" texture="wood" rgba="0.2 0.4 0.6 1"/>"""


@pytest.mark.parametrize(
    ("geom", "color"),
    [
        ('rgba="0.8 0.2 0.1 1"', (0.8, 0.2, 0.1)),
        ('material="wood"', (0.1, 0.2, 0.3)),
        ('material="wood" rgba="0.8 0.2 0.1 1"', (0.4, 0.1, 0.05)),
    ],
)
def test_a_page_draws_the_colours_that_mujoco_draws(geom, color):
    model = compiled(f'type="box" size="1 1 1" {geom}', GREY_WOOD)
    ((drawn, _),) = colored_meshes(model, 0)
    np.testing.assert_allclose(drawn, (*color, 1.0), atol=2e-3)  # pixels have 8 bits
