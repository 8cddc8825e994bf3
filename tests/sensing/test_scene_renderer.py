"""Pictures are those of MuJoCo's own renderer, for less work."""

import json
import os
import subprocess
import sys

import mujoco
import numpy as np
import pytest

from wbc_suite.sensing import gl_backend
from wbc_suite.sensing.renderer import (
    Renderer,
    coarse_floors,
    make_renderer,
    outside,
)

SCENE = """
<mujoco>
  <asset>
    <texture name="tiles" type="2d" builtin="checker" rgb1="1 1 1" rgb2="0 0 1"
      width="64" height="64" mark="edge" markrgb="1 0 0"/>
    <texture type="skybox" builtin="gradient" rgb1="1 1 1" rgb2="0 0 0" width="16"
      height="96"/>
    <material name="tiles" texture="tiles" texrepeat="3 0.7" texuniform="true"/>
  </asset>
  <worldbody>
    <light pos="1 1 4" dir="-1 -1 -4" type="directional"/>
    <geom name="floor" type="plane" size="0 0 .1" material="tiles"/>
    <geom name="rug" type="plane" size="1 1 .1" pos="0 2 .01"/>
    <geom name="seen" size=".2" pos="0 0 .5" rgba="1 0 0 1"/>
    <geom name="behind" type="box" size=".1 .1 .1" pos="-5 0 1"/>
    <geom name="half" size=".4" pos="0 1.4 .5" rgba="0 1 0 1"/>
    <geom name="beside" type="capsule" size=".1 .3" pos="0 9 1"/>
    <camera name="eye" pos="-2 0 1" xyaxes="0 -1 0 .3 0 1"/>
  </worldbody>
</mujoco>
"""
SIZE = {"width": 60, "height": 48}


THEIRS = """
import json, sys, mujoco, numpy as np
folder, flags = sys.argv[1], json.loads(sys.argv[2])
model = mujoco.MjModel.from_xml_path(folder + "/scene.xml")
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
quality = model.vis.quality
quality.offsamples, quality.numslices, quality.numstacks = 0, 16, 8
with mujoco.Renderer(model, 48, 60) as renderer:
    renderer.scene.flags[:] = flags
    renderer.update_scene(data, "eye")
    colors = renderer.render()
    renderer.enable_depth_rendering()
    depth = renderer.render()
    renderer.enable_segmentation_rendering()
    geoms = renderer.render()
np.savez(folder + "/pictures.npz", colors=colors, depth=depth, geoms=geoms)
"""


@pytest.fixture(scope="module")
def scene():
    model = mujoco.MjModel.from_xml_string(SCENE)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@pytest.fixture(scope="module")
def theirs(scene, tmp_path_factory):
    """What MuJoCo draws without our help: colours, depth, segmentation."""
    model, data = scene
    del data
    with make_renderer(model, preset="fast", **SIZE) as given:
        flags = given.scene.flags.tolist()
    folder = tmp_path_factory.mktemp("theirs")
    (folder / "scene.xml").write_text(SCENE)
    subprocess.run(
        [sys.executable, "-c", THEIRS, str(folder), json.dumps(flags)],
        env=os.environ | {"MUJOCO_GL": gl_backend.activate().name},
        check=True,
    )
    found = np.load(folder / "pictures.npz")
    return found["colors"], found["depth"], found["geoms"]


def indices(model):
    """Return each geom's own index, and -1 for none."""
    return np.array([*range(model.ngeom), -1], dtype=np.int32)


@pytest.mark.slow
def test_less_work_gives_the_same_pictures(scene, theirs):
    model, data = scene
    sizes = model.geom_size.copy()
    with make_renderer(model, preset="fast", **SIZE) as renderer:
        assert isinstance(renderer, Renderer)
        renderer.update_scene(data, model.camera("eye").id)
        drawn = {geom.objid for geom in renderer.scene.geoms[: renderer.scene.ngeom]}
        colors = renderer.render()
        renderer.draw_surfaces()
        depth, geoms = renderer.read_depth(), renderer.read_geoms(indices(model))
    assert {model.geom(i).name for i in drawn} == {"floor", "rug", "seen", "half"}
    np.testing.assert_array_equal(model.geom_size, sizes)
    assert not model.geom_group.any()
    difference = np.abs(colors.astype(int) - theirs[0])
    assert np.mean(difference.max(axis=-1) > 8) < 0.01  # highlights move a little
    floor = (geoms == 0) & (theirs[2][..., 0] == 0)
    assert floor.mean() > 0.2
    assert difference[floor].mean() < 1.0
    np.testing.assert_allclose(depth[floor], theirs[1][floor], rtol=1e-3)
    assert np.mean(geoms != theirs[2][..., 0]) < 0.01
    assert set(np.unique(geoms)) == {-1, 0, 1, 2, 4}


def test_shadows_of_what_is_outside_stay(scene):
    model, data = scene
    with make_renderer(model, preset="balanced", **SIZE) as renderer:
        renderer.update_scene(data, model.camera("eye").id)
        assert renderer.scene.ngeom == model.ngeom


def test_only_what_lies_outside_is_left_out(scene):
    model, data = scene
    camera = model.camera("eye").id
    names = {model.geom(i).name for i in outside(model, data, camera, 1.25)}
    assert names == {"behind", "beside"}
    everything = outside(model, data, camera, 20.0)
    assert {model.geom(i).name for i in everything} == {"behind"}


def test_coarse_floors_hold_whole_tiles_and_only_infinite_planes(scene):
    model, _ = scene
    (floor,) = coarse_floors(model).values()
    half = floor[:2]
    assert (half > model.vis.map.zfar * model.stat.extent).all()
    tiles = 0.5 * half * model.material("tiles").texrepeat
    np.testing.assert_allclose(tiles, np.round(tiles), atol=1e-4)


def test_many_geoms_are_told_apart():
    balls = "".join(
        f'<geom size=".02" pos="{x * 0.1} {y * 0.1} 0"/>'
        for x in range(20)
        for y in range(20)
    )
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><worldbody>{balls}
        <camera name="over" pos=".95 .95 5" fovy="25"/></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with make_renderer(model, width=200, height=200) as renderer:
        renderer.update_scene(data, model.camera("over").id)
        renderer.draw_surfaces()
        geoms = renderer.read_geoms(indices(model))
    assert set(np.unique(geoms)) == {*range(-1, 400)}
    assert geoms[:20].max() % 20 == 19  # row 0 is the upper edge
    assert geoms[-20:][geoms[-20:] >= 0].min() == 0
