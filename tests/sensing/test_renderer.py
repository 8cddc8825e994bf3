import mujoco
import numpy as np
import pytest

from wbc_suite.errors import DeviceError
from wbc_suite.sensing import gl_backend
from wbc_suite.sensing.gl_backend import GlBackend
from wbc_suite.sensing.renderer import RenderPreset, make_renderer

SPHERE = """<mujoco><worldbody><light pos="0 0 3"/>
<geom size=".1" rgba="1 0 0 1"/></worldbody></mujoco>"""


@pytest.fixture
def model() -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(SPHERE)


def test_llvmpipe_counts_as_software_and_a_card_does_not():
    assert GlBackend(name="egl", renderer="llvmpipe (LLVM 15.0.6, 256 bits)").software
    assert not GlBackend(name="egl", renderer="NVIDIA RTX A4000/PCIe/SSE2").software


@pytest.mark.parametrize("preset", RenderPreset)
def test_every_preset_shows_a_red_sphere_in_the_middle(model, preset):
    with make_renderer(model, width=48, height=32, preset=preset) as renderer:
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        renderer.update_scene(data)
        image = renderer.render()
    assert image.shape == (32, 48, 3)
    red, green, _ = image[16, 24].astype(int)
    assert red > green + 100


def test_making_a_renderer_leaves_the_model_as_it_was(model):
    before = model.vis.global_.offwidth, model.vis.quality.shadowsize
    make_renderer(model, width=2000, height=8, preset="quality").close()
    assert (model.vis.global_.offwidth, model.vis.quality.shadowsize) == before


def test_a_machine_that_cannot_draw_is_told_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(gl_backend, "_ask_subprocess", lambda name: None)
    gl_backend.activate.cache_clear()
    try:
        with pytest.raises(DeviceError, match=r"apt-get install libegl1"):
            gl_backend.activate()
    finally:
        gl_backend.activate.cache_clear()


def test_the_verdict_is_remembered_and_can_be_forgotten(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    backend = GlBackend(name="egl", renderer="a card")
    gl_backend._remember(backend)
    assert gl_backend._remembered() == backend
    gl_backend.forget()
    assert gl_backend._remembered() is None


def test_a_damaged_verdict_is_ignored(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    gl_backend._remember(GlBackend(name="egl", renderer="a card"))
    gl_backend._verdict_path().write_text("{")
    assert gl_backend._remembered() is None


def test_depth_of_a_camera_is_metric(model):
    camera = mujoco.MjvCamera()
    camera.distance = 2.0
    with make_renderer(model, width=33, height=33) as renderer:
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        renderer.enable_depth_rendering()
        renderer.update_scene(data, camera)
        depth = renderer.render()
    # The front of the sphere is its radius nearer than its middle.
    assert np.isclose(depth[16, 16], 2.0 - 0.1, atol=0.01)
