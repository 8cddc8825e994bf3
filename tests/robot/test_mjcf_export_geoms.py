"""Visual shapes become fewer geoms, without a change of surface or contacts."""

import mujoco
import numpy as np
import pytest

from wbc_suite.robot import load_robot
from wbc_suite.robot.mjcf_export import build_mjspec
from wbc_suite.robot.mjcf_export_geoms import VISUAL_GROUP
from wbc_suite.robot.triangle_meshes import merge
from wbc_suite.viewers.model_scene import colored_meshes

ROBOTS = ("Panda", "GR1", "Tiago", "SpotWithArm", "Baxter")


def drawn_meshes(model):
    """Map body and colour to one mesh of all that is drawn, in the body's frame."""
    parts = {}
    for geom in np.flatnonzero(model.geom_group == VISUAL_GROUP):
        turn = np.empty(9)
        mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
        for rgba, mesh in colored_meshes(model, geom):
            key = (
                model.body(model.geom_bodyid[geom]).name,
                *np.rint(255 * np.array(rgba)),
            )
            placed = mesh.moved(model.geom_pos[geom], turn.reshape(3, 3))
            parts.setdefault(key, []).append(placed)
    return {key: merge(meshes) for key, meshes in parts.items()}


def volume(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return np.sum(np.cross(a, b) * c) / 6


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_merged_links_have_the_surface_of_their_shapes(name):
    robot = load_robot(name)
    apart, merged = (build_mjspec(robot, merged=m).compile() for m in (False, True))
    assert merged.ngeom < 0.7 * apart.ngeom
    one, other = drawn_meshes(apart), drawn_meshes(merged)
    assert len(one) == len(other)
    for (body, *rgba), mesh in one.items():
        (found,) = [  # a palette has 256 steps
            candidate
            for (owner, *color), candidate in other.items()
            if owner == body and np.abs(np.subtract(rgba, color)).max() <= 1.0
        ]
        for corner in (np.min, np.max):  # vertices are kept in single precision
            np.testing.assert_allclose(
                corner(found.vertices, axis=0), corner(mesh.vertices, axis=0), atol=2e-6
            )
        assert volume(found) == pytest.approx(volume(mesh), rel=1e-3, abs=1e-9)


def test_a_link_is_drawn_with_one_geom():
    model = load_robot("Panda").to_mjspec().compile()
    bodies = model.geom_bodyid[model.geom_group == VISUAL_GROUP]
    assert len(bodies) == len(set(bodies)) == 15


def test_glass_stays_in_pieces(tmp_path):
    path = tmp_path / "jar.toml"
    box = '{shape = "box", size = [0.1, 0.1, 0.1], color = %s}'
    glass, red, blue = "[0.5, 0.5, 0.5, 0.3]", "[1, 0, 0]", "[0, 0, 1]"
    boxes = ",\n".join(box % color for color in (glass, red, glass, blue, red))
    path.write_text(
        'format = 1\n[component]\nname = "jar"\nkind = "body"\n[[link]]\nname = "jar"\n'
        f"mass = 1.0\ninertia = [0.01, 0.01, 0.01, 0, 0, 0]\nvisual = [{boxes}]\n"
    )
    model = load_robot(path).to_mjspec().compile()
    kinds = [mujoco.mjtGeom(t).name for t in model.geom_type]
    assert kinds == ["mjGEOM_MESH", "mjGEOM_BOX", "mjGEOM_BOX"]
