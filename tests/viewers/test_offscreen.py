import mujoco
import numpy as np
import pytest

from wbc_suite.errors import UnknownNameError
from wbc_suite.robot import load_robot
from wbc_suite.viewers.model_scene import subject_corners
from wbc_suite.viewers.offscreen import (
    VIEWS,
    Camera,
    Mark,
    View,
    add_studio,
    render_model,
    render_robot,
)

POLE = """<mujoco><worldbody><body pos="0 0 .5">
<geom type="box" size=".05 .02 .5" rgba="1 0 0 1"/></body></worldbody></mujoco>"""


def _studio() -> tuple[mujoco.MjModel, mujoco.MjData]:
    spec = mujoco.MjSpec.from_string(POLE)
    add_studio(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def _red(image):
    red, green, _ = np.moveaxis(image.astype(int), 2, 0)
    return red > green + 60


def test_a_model_without_shapes_is_a_point_at_its_bodies():
    spec = mujoco.MjSpec.from_string(
        "<mujoco><worldbody><body pos='1 2 3'/></worldbody></mujoco>"
    )
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert subject_corners(model, data)[-1].tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("size", [(120, 90), (90, 120)])
def test_the_subject_fills_the_picture_and_stays_inside(view, size):
    model, data = _studio()
    image = render_model(model, data, width=size[0], height=size[1], camera=view)
    rows = np.flatnonzero(_red(image).any(axis=1))
    assert rows[0] > 0
    assert rows[-1] < size[1] - 1
    # The pole is tall: it takes the height but for the 8 % of margin.
    assert rows[-1] - rows[0] > 0.85 * size[1]


@pytest.mark.slow
def test_the_front_view_sees_the_wide_face_from_plus_x():
    model, data = _studio()
    widths = {}
    for name in ("front", "side"):
        image = render_model(model, data, width=200, height=200, camera=name)
        widths[name] = _red(image).any(axis=0).sum()
    # 0.10 m deep along x, 0.04 m wide along y.
    assert widths["side"] > 2 * widths["front"]


def test_the_studio_is_bright_and_neutral():
    model, data = _studio()
    image = render_model(model, data, width=120, height=120).astype(int)
    corner = image[2, 2]
    assert corner.min() > 140
    assert np.ptp(corner) < 20


def test_an_own_view_is_taken():
    model, data = _studio()
    image = render_model(model, data, camera=View(azimuth=30, elevation=-80), width=64)
    assert _red(image).any()


def test_an_unknown_view_is_answered_with_the_nearest():
    model, data = _studio()
    with pytest.raises(UnknownNameError, match="Did you mean 'front'"):
        render_model(model, data, camera="fornt")


@pytest.mark.slow
def test_a_robot_stands_on_the_ground_in_its_ready_posture():
    robot = load_robot("Panda")
    image = render_robot(robot, size=(96, 96), view="side", preset="fast")
    background = image[2, 2].astype(int)
    robot_pixels = np.abs(image.astype(int) - background).max(axis=2) > 60
    assert robot_pixels.mean() > 0.1


def test_an_unknown_posture_is_refused():
    with pytest.raises(UnknownNameError, match="keyframe"):
        render_robot(load_robot("Panda"), keyframe="sleeping")


def test_a_camera_stays_where_it_is_and_shows_marks():
    model, data = _studio()
    mark = Mark(position=np.array([0.0, 0.0, 0.9]), rgba=(0, 1, 0, 1), radius=0.1)
    with Camera(model, data, width=96, height=96, preset="fast") as camera:
        plain = camera.take(data)
        marked = camera.take(data, [mark])
        again = camera.take(data)
    green = marked[..., 1].astype(int) > marked[..., 0].astype(int) + 60
    assert green.sum() > 50
    assert np.array_equal(plain, again)


def test_a_camera_fits_the_subject_only():
    spec = mujoco.MjSpec.from_string(POLE)
    spec.worldbody.add_geom(size=[0.1] * 3, pos=[0, 3, 0], rgba=[0, 0, 1, 1])
    spec.bodies[1].name = "robot0_pole"
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    tall = {}
    for subject in ("", "robot0_"):
        with Camera(
            model, data, view="front", width=96, height=96, subject=subject
        ) as camera:
            tall[subject] = _red(camera.take(data)).any(axis=1).sum()
    assert tall["robot0_"] > 2 * tall[""]
