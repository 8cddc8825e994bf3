"""Skins change only the drawing; missing meshes give one message."""

import sys
import tomllib
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh

import wbc_suite
from wbc_suite.catalogue import Catalogue
from wbc_suite.errors import ConfigError
from wbc_suite.robot.assembly import describe_component
from wbc_suite.robot.robot_file import read_robot_file
from wbc_suite.robot.skins import SkinFinder, read_skin

TABLES = Catalogue().files("robots/skin")
COMPONENTS = [
    read_robot_file(path)
    for folder in ("arm", "body", "gripper", "base")
    for path in Catalogue().files(f"robots/{folder}")
]


@pytest.fixture(autouse=True)
def _no_alias_of_robosuite(monkeypatch):
    """Other tests give our own package the name of the one with meshes."""
    for name in list(sys.modules):
        if name.split(".")[0] == "robosuite":
            monkeypatch.delitem(sys.modules, name)


def files_of(name):
    table = tomllib.loads(
        Catalogue().find("robots/skin", name, kind="skin").read_text()
    )
    pieces = [piece for link in table["link"].values() for piece in link]
    return table["provider"], table.get("folder", ""), {p["file"] for p in pieces}


def write_meshes(folder, names, mesh=None):
    """Write what the tables of components ask for, below a folder."""
    mesh = trimesh.creation.icosphere(2, radius=0.05) if mesh is None else mesh
    for name in names:
        _, inside, files = files_of(name)
        for file in files:
            path = folder / inside / file
            path.parent.mkdir(parents=True, exist_ok=True)
            mesh.export(path, file_type=path.suffix[1:].lower())


@pytest.fixture(autouse=True)
def _own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("MENAGERIE_ROOT", raising=False)
    monkeypatch.delenv("MENAGERIE_CACHE_DIR", raising=False)


@pytest.fixture
def package(tmp_path, monkeypatch):
    """A package `robosuite` with meshes, which must never be imported."""
    root = tmp_path / "site" / "robosuite"
    root.mkdir(parents=True)
    (root / "__init__.py").write_text("raise RuntimeError('imported')\n")
    monkeypatch.syspath_prepend(str(root.parent))
    return root


def same_dynamics(one, other):
    for name in (
        "body_mass",
        "body_inertia",
        "body_ipos",
        "body_iquat",
        "dof_armature",
    ):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    for model in (one, other):
        touching = (model.geom_contype > 0) | (model.geom_conaffinity > 0)
        yield [
            (model.geom(g).name, *model.geom_size[g], *model.geom_pos[g])
            for g in np.flatnonzero(touching)
        ]


@pytest.mark.slow
def test_a_skin_changes_what_is_drawn_and_nothing_else(package):
    write_meshes(package, ["panda", "panda_gripper", "rethink_mount"])
    plain, skinned = (
        wbc_suite.load_robot("Panda"),
        wbc_suite.load_robot("Panda", skin="meshes"),
    )
    assert "robosuite" not in sys.modules
    one, other = plain.to_mjspec().compile(), skinned.to_mjspec().compile()
    before, after = same_dynamics(one, other)
    assert before == after
    drawn = [g for g in range(other.ngeom) if "_visual" in other.geom(g).name]
    meshes = {
        other.geom(g).name
        for g in drawn
        if other.geom_type[g] == mujoco.mjtGeom.mjGEOM_MESH
    }
    pieces = sum(len(pieces) for pieces in skinned.skins.values())
    faces = [other.mesh_facenum[other.geom_dataid[other.geom(g).id]] for g in meshes]
    assert sum(faces) == pieces * len(trimesh.creation.icosphere(2).faces)
    assert 5 < len(meshes) < pieces
    states = []
    for model in (one, other):
        data = mujoco.MjData(model)
        data.qpos[:7] = (0.1, -0.3, 0.2, -2.0, 0.1, 1.6, 0.5)
        for _ in range(50):
            mujoco.mj_step(model, data)
        states.append(data.qpos.copy())
    np.testing.assert_array_equal(*states)
    assert skinned.to_urdf() == plain.to_urdf()


def test_a_mesh_lies_where_its_table_says(package):
    corner = trimesh.Trimesh(
        [[0, 0, 0], [0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.3]],
        [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    )
    write_meshes(package, ["panda_gripper"], corner)
    robot = wbc_suite.load_robot("gripper/panda_gripper", skin="meshes")
    model = robot.to_mjspec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    corners = {}
    for name in ("panda_leftfinger", "panda_rightfinger"):
        geom = model.geom(f"{name}_visual0").id
        mesh = model.geom_dataid[geom]
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        points = model.mesh_vert[first : first + count]
        placed = data.geom_xpos[geom] + points @ data.geom_xmat[geom].reshape(3, 3).T
        corners[name] = placed - data.body(name).xpos
    top = corners["panda_leftfinger"].max(axis=0)
    np.testing.assert_allclose(top, (0.1, 0.2, 0.3), atol=1e-6)
    turned = corners["panda_rightfinger"].min(axis=0)
    np.testing.assert_allclose(turned, (-0.1, -0.2, 0.0), atol=1e-6)


def test_meshes_are_found_in_a_folder_of_the_user(tmp_path):
    folder = tmp_path / "mine"
    write_meshes(folder / "deep" / "down", ["iiwa14"])
    robot = wbc_suite.load_robot("IIWA14", skin=folder, gripper="none", base="none")
    assert set(robot.skins) == {f"link_{k}" for k in range(8)} or len(robot.skins) >= 7


def test_meshes_are_decimated_once(package, tmp_path, monkeypatch):
    fine = trimesh.creation.icosphere(5, radius=0.05)
    assert len(fine.faces) > 20_000
    write_meshes(package, ["panda_gripper"], fine)
    robot = wbc_suite.load_robot("gripper/panda_gripper", skin="meshes")
    model = robot.to_mjspec().compile()
    mesh = model.geom_dataid[model.geom("panda_hand_visual0").id]
    assert 300 < model.mesh_facenum[mesh] < 2000
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    radii = np.linalg.norm(model.mesh_vert[first : first + count], axis=1)
    np.testing.assert_allclose(radii, 0.05, rtol=0.03)
    assert list((tmp_path / "cache" / "wbc_suite" / "skins").glob("*.npz"))
    from wbc_suite.robot import surfaces

    forget = surfaces.skin_triangles.cache_clear  # pyright: ignore[reportFunctionMemberAccess]
    forget()
    monkeypatch.setattr(surfaces, "_read_one", None)  # not read again
    again = robot.to_mjspec().compile()
    assert again.nmeshface == model.nmeshface


@pytest.mark.parametrize("change", ["cut", "bits", "no vertices", "no file at all"])
def test_a_damaged_mesh_in_the_cache_is_made_again(package, tmp_path, change):
    from wbc_suite.robot import surfaces

    write_meshes(package, ["panda_gripper"])
    robot = wbc_suite.load_robot("gripper/panda_gripper", skin="meshes")
    forget = surfaces.skin_triangles.cache_clear  # pyright: ignore[reportFunctionMemberAccess]
    forget()
    whole = robot.to_mjspec().compile()
    for kept in (tmp_path / "cache" / "wbc_suite" / "skins").glob("*.npz"):
        content = bytearray(kept.read_bytes())
        with np.load(kept) as data:
            kept_arrays = dict(data)
        match change:
            case "cut":
                kept.write_bytes(content[:-30])
            case "bits":
                content[len(content) // 2] ^= 255
                kept.write_bytes(content)
            case "no vertices":
                np.savez(kept, **kept_arrays | {"vertices0": np.zeros((2, 3))})
            case _:
                kept.write_bytes(b"")
    forget()
    assert robot.to_mjspec().compile().nmeshvert == whole.nmeshvert


def test_the_error_of_missing_meshes_names_the_command():
    with pytest.raises(ConfigError, match="pip install --no-deps robosuite"):
        wbc_suite.load_robot("Panda", skin="meshes")


def test_what_is_partly_missing_is_a_warning(package, caplog):
    write_meshes(package, ["panda"])
    robot = wbc_suite.load_robot("Panda", skin="meshes")
    assert "panda_link3" in robot.skins
    assert "panda_hand" not in robot.skins
    assert "PandaGripper" in caplog.text
    assert "pip install" in caplog.text


def test_a_skin_that_is_neither_is_an_error(tmp_path):
    with pytest.raises(ConfigError, match="neither 'meshes', nor a folder"):
        wbc_suite.load_robot("Panda", skin="mesh")


def test_a_component_that_extends_another_wears_its_skin(tmp_path):
    write_meshes(tmp_path, ["jaco_three_finger_gripper"])
    plain, dexterous = (
        wbc_suite.load_robot(f"gripper/jaco_three_finger{kind}_gripper", skin=tmp_path)
        for kind in ("", "_dexterous")
    )
    assert plain.skins == dexterous.skins != {}


ONE_TRIANGLE = bytes(80) + b"\1\0\0\0" + np.eye(4, 3, -1, "<f4").tobytes() + b"\0\0"


@pytest.mark.parametrize("content", [b"solid nothing\n", ONE_TRIANGLE])
def test_a_broken_mesh_names_the_file(package, content):
    write_meshes(package, ["panda_gripper"])
    path = next(package.rglob("hand_vis.stl"))
    path.write_bytes(content)
    robot = wbc_suite.load_robot("gripper/panda_gripper", skin="meshes")
    with pytest.raises(ConfigError, match=r"hand_vis\.stl"):
        robot.to_mjspec()


def is_table_of(path, name):
    return path.stem.replace("_", "") == name.replace("_", "").casefold()


@pytest.mark.parametrize("path", TABLES, ids=lambda p: p.stem)
def test_every_table_fits_its_component(path, tmp_path):
    """Each link exists, each provider is known, and the skin loads."""
    table = read_skin(path)
    (component,) = [c for c in COMPONENTS if is_table_of(path, c.component.name)]
    for model in table.model:
        assert Path(model.file).suffix in (".urdf", ".xml")
    if table.link:
        write_meshes(tmp_path, [path.stem])
        robot = describe_component(component, source=path.name)
        finder = SkinFinder(tmp_path, Catalogue())
        skinned = finder.meshes(component.component.name, robot)
        assert set(skinned) == set(table.link)
        assert finder.found == {component.component.name: table.provider}


def test_a_component_is_dressed_by_the_first_model_that_is_found(tmp_path):
    plain = wbc_suite.load_robot("gripper/pr2_gripper")
    tables, vendor = tmp_path / "own" / "robots" / "skin", tmp_path / "vendor"
    tables.mkdir(parents=True)
    vendor.mkdir()
    lines = [
        f'[[model]]\nprovider = "mjlab"\nfile = "pr2/{name}.urdf"\n'
        for name in ("absent", "hand")
    ]
    (tables / "pr2_gripper.toml").write_text("format = 1\n" + "\n".join(lines))
    text = plain.to_urdf(mesh_dir=vendor / "meshes")
    (vendor / "hand.urdf").write_text(text)
    own = Catalogue(extra=(tmp_path / "own",))
    robot = wbc_suite.load_robot("gripper/pr2_gripper", skin=vendor, catalogue=own)
    assert set(robot.skins) == {link.name for link in plain.links}
    with pytest.raises(ConfigError, match="pip install --no-deps mjlab"):
        wbc_suite.load_robot("gripper/pr2_gripper", skin="meshes", catalogue=own)


def test_a_model_that_mujoco_refuses_is_a_warning(tmp_path, caplog):
    (tmp_path / "hand.xml").write_text("<mujoco><body/></mujoco>")
    tables = tmp_path / "own" / "robots" / "skin"
    tables.mkdir(parents=True)
    (tables / "pr2_gripper.toml").write_text(
        'format = 1\n[[model]]\nprovider = "mjlab"\nfile = "hand.xml"\n'
    )
    own = Catalogue(extra=(tmp_path / "own",))
    with pytest.raises(ConfigError, match="not found"):
        wbc_suite.load_robot("gripper/pr2_gripper", skin=tmp_path, catalogue=own)
    assert "hand.xml" in caplog.text
