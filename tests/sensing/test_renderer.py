from pathlib import Path

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
    monkeypatch.setattr(gl_backend, "_gl_renderer", lambda name: None)
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
    gl_backend._cache_file().write_text("{")
    assert gl_backend._remembered() is None


def test_depth_of_a_camera_is_metric(model):
    camera = mujoco.MjvCamera()
    camera.distance = 2.0
    with make_renderer(model, width=33, height=33) as renderer:
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        renderer.update_scene(data, camera)
        renderer.draw_surfaces()
        depth = renderer.read_depth()
    # The front of the sphere is its radius nearer than its middle.
    assert np.isclose(depth[16, 16], 2.0 - 0.1, atol=0.01)


def test_two_renderers_of_one_thread_keep_apart(model):
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with (
        make_renderer(model, width=24, height=16, preset="fast") as small,
        make_renderer(model, width=48, height=32, preset="fast") as large,
    ):
        for renderer in (small, large, small):
            renderer.update_scene(data)
            assert renderer.render()[renderer.height // 2, renderer.width // 2, 0] > 100


def test_a_renderer_can_be_closed_twice(model):
    renderer = make_renderer(model, width=8, height=8)
    renderer.close()
    renderer.close()


@pytest.fixture
def wheel(monkeypatch, tmp_path):
    """A wheel lavavu-osmesa in a folder of `sys.path`, and no other backend."""
    library = tmp_path / "site" / "lavavu_osmesa.libs" / "libOSMesa-1a2b.so.8.0.0"
    library.parent.mkdir(parents=True)
    library.touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setenv("LD_LIBRARY_PATH", "/own")
    monkeypatch.setattr(gl_backend.platform, "system", lambda: "Linux")
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    monkeypatch.setattr(
        gl_backend, "_gl_renderer", lambda n: "llvmpipe" if n == "wheel" else None
    )
    gl_backend.activate.cache_clear()
    yield library
    gl_backend.activate.cache_clear()


def test_a_wheel_needs_its_libraries_on_the_path_from_the_start(wheel, monkeypatch):
    assert gl_backend.missing_environment() == {}  # nothing is known yet
    with pytest.raises(DeviceError, match="LD_LIBRARY_PATH=") as caught:
        gl_backend.activate()
    missing = gl_backend.missing_environment()
    links, libraries, own = missing["LD_LIBRARY_PATH"].split(":")
    assert f"LD_LIBRARY_PATH={missing['LD_LIBRARY_PATH']}" in str(caught.value)
    assert (Path(links) / "libOSMesa.so.8").resolve() == wheel
    assert (Path(libraries), own) == (wheel.parent, "/own")
    for key, value in missing.items():  # as the command line starts itself again
        monkeypatch.setenv(key, value)
    assert gl_backend.missing_environment() == {}
    assert gl_backend.activate().name == "osmesa"


def test_a_wheel_that_was_removed_is_forgotten(wheel):
    with pytest.raises(DeviceError, match="lavavu-osmesa"):
        gl_backend.activate()
    wheel.unlink()
    assert gl_backend.missing_environment() == {}
