"""Arenas: floor, tables, cameras, and their checks."""

import mujoco
import numpy as np
import pytest
from pydantic import ValidationError

from wbc_suite.errors import UnknownNameError
from wbc_suite.scene import (
    TableConfig,
    add_camera,
    add_table,
    add_table_cameras,
    add_tables,
    compile_scene,
    empty_arena,
)
from wbc_suite.scene.furniture import BinConfig
from wbc_suite.scene.materials import MATERIALS, material_named, use_material
from wbc_suite.scene.objects import box
from wbc_suite.sensing.projection import Projection, camera_id


def test_a_box_put_on_the_table_stays_on_it():
    spec = empty_arena()
    add_table(spec, TableConfig())
    box("cube", (0.02, 0.02, 0.02)).add_to(spec)
    model = compile_scene(spec)
    data = mujoco.MjData(model)
    data.joint("cube_joint").qpos[:3] = 0.1, 0.1, 0.83
    for _ in range(500):
        mujoco.mj_step(model, data)
    np.testing.assert_allclose(data.body("cube").xpos, (0.1, 0.1, 0.82), atol=1e-3)


def test_legs_end_on_the_floor():
    spec = empty_arena()
    add_table(spec, TableConfig(center=(0.3, 0.2, 0.7), size=(0.6, 0.4, 0.04)))
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for k in range(4):
        leg = model.geom(f"table_leg{k}")
        assert data.geom(leg.id).xpos[2] - leg.size[2] == pytest.approx(0.0)
        assert abs(data.geom(leg.id).xpos[0] - 0.3) == pytest.approx(0.15)


@pytest.mark.parametrize(
    "wrong",
    [
        {"center": (0.0, 0.0, 0.05)},
        {"size": (0.8, 0.8, 0.8)},
        {"size": (0.8, -0.8, 0.05)},
        {"friction": (1.0, 0.005, -1.0)},
        {"legs": 3},
    ],
)
def test_impossible_tables_are_refused(wrong):
    with pytest.raises(ValidationError):
        TableConfig(**wrong)


def test_impossible_bins_are_refused():
    with pytest.raises(ValidationError, match="no room for legs"):
        BinConfig(size=(0.3, 0.3, 0.1), center=(0.0, 0.0, 0.01))


def test_tables_keep_their_size_and_get_their_centers():
    spec = empty_arena()
    add_tables(spec, TableConfig(), {"a": (0.0, -1.0, 0.8), "b": (0.0, 1.0, 0.8)})
    model = spec.compile()
    np.testing.assert_allclose(model.geom("a").size, model.geom("b").size)
    np.testing.assert_allclose(model.body("b").pos, (0.0, 1.0, 0.8))


@pytest.mark.parametrize(
    ("eye", "target"),
    [
        ((1, 0, 1), (0, 0, 0)),
        ((0, 0, 3), (0, 0, 0)),
        ((1.0, -2.0, 0.5), (0.2, 0.1, 0.9)),
    ],
)
def test_a_camera_has_its_target_in_the_middle_of_the_picture(eye, target):
    spec = empty_arena()
    add_camera(spec, "eye", eye, target)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    view = Projection.of(model, data, camera_id(model, "eye"), width=65, height=49)
    pixel, depth = view.to_pixels(np.array(target, float))
    np.testing.assert_allclose(pixel, (32.0, 24.0), atol=1e-6)
    assert depth == pytest.approx(np.linalg.norm(np.subtract(eye, target)))
    assert view.T_wc[2, 0] == pytest.approx(0.0, abs=1e-6)  # x is level


def test_table_cameras_see_the_table():
    spec = empty_arena()
    table = TableConfig()
    add_table(spec, table)
    add_table_cameras(spec, table.center)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for name in ("frontview", "agentview", "sideview", "birdview"):
        view = Projection.of(model, data, camera_id(model, name), width=64, height=64)
        pixel, depth = view.to_pixels(np.array(table.center))
        assert depth > 0.3
        assert ((pixel > 0) & (pixel < 63)).all(), name


def test_side_cameras_stand_on_the_side_that_is_asked_for():
    for side in (-1.0, 1.0):
        spec = empty_arena()
        add_table_cameras(spec, (0.0, 0.0, 0.8), side=side)
        model = spec.compile()
        assert np.sign(model.camera("sideview").pos[1]) == side


def test_small_scenes_solve_all_constraints_at_once_and_large_ones_do_not():
    def scene(boxes):
        spec = empty_arena()
        for k in range(boxes):
            box(f"b{k}", (0.02, 0.02, 0.02)).add_to(spec)
        return compile_scene(spec)

    islands = mujoco.mjtDisableBit.mjDSBL_ISLAND
    assert scene(4).opt.disableflags & islands
    assert not scene(5).opt.disableflags & islands


def test_a_thing_that_is_flung_spinning_gains_no_energy():
    """A slab about its middle axis, which is unstable, at 15 turns a second."""
    spec = empty_arena()
    box("slab", (0.06, 0.03, 0.005)).add_to(spec)
    model = compile_scene(spec)
    model.opt.gravity[:] = 0.0
    data = mujoco.MjData(model)
    data.qpos[2], data.qvel[3:] = 1.0, (1.0, 94.0, 1.0)
    inertia = model.body("slab").inertia
    energy = [inertia @ data.qvel[3:] ** 2]
    for _ in range(500):
        mujoco.mj_step(model, data)
        energy.append(inertia @ data.qvel[3:] ** 2)
    assert max(energy) <= 1.01 * energy[0]


def test_materials_are_found_by_name():
    assert material_named("wood").density == 700.0
    with pytest.raises(UnknownNameError, match="Did you mean 'metal'"):
        material_named("metl")


@pytest.mark.parametrize("name", MATERIALS)
def test_a_material_is_added_once_with_its_texture(name):
    spec = mujoco.MjSpec()
    assert use_material(spec, name) == use_material(spec, name) == f"object_{name}"
    spec.worldbody.add_geom(size=(1, 1, 1), material=f"object_{name}")
    model = spec.compile()
    assert model.nmat == 1
    assert model.ntex == (MATERIALS[name].pixels is not None)
    pixels = MATERIALS[name].pixels
    if pixels is not None:
        picture = pixels(32)
        assert picture.shape == (32, 32, 3)
        assert not picture.flags.writeable
        assert picture.mean() > 150  # light, to be coloured
        assert picture.std() > 1  # not plain
