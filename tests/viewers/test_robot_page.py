import mujoco
import numpy as np
import pytest

import wbc_suite
from wbc_suite.viewers.page_server import PageServer
from wbc_suite.viewers.robot_page import RobotPage, equivalent_box


@pytest.fixture(scope="module")
def page():
    page = RobotPage(wbc_suite.load_robot("Panda"), PageServer(port=0))
    yield page
    page.site.stop()


def test_page_opens_in_the_first_keyframe(page):
    page.set_keyframe("ready")
    for joint, value in page.robot.keyframe("ready").items():
        assert page.position(joint) == pytest.approx(value)


def test_setting_a_joint_moves_the_bodies_that_it_carries(page):
    page.set_keyframe("ready")
    joint = page.robot.joint_names[0]
    body = page.model.body(page.robot.links[-1].name).id
    before = page.data.xpos[body].copy()
    page.set_joints({joint: page.position(joint) + 0.5})
    assert np.linalg.norm(page.data.xpos[body] - before) > 0.05


def test_followers_keep_to_their_leader(page):
    follower = next(j for j in page.robot.joints if j.mimic is not None)
    page.set_joints({follower.mimic.joint: 0.02})
    expected = follower.mimic.ratio * 0.02 + follower.mimic.offset
    assert page.position(follower.name) == pytest.approx(expected)


def test_every_independent_joint_has_a_slider_in_its_range(page):
    free = {j.name for j in page.robot.joints if j.mimic is None}
    assert set(page._sliders) == free
    for name, slider in page._sliders.items():
        assert (slider.min, slider.max) == tuple(page.model.joint(name).range)


def test_equivalent_box_of_a_box_is_that_box():
    half, mass = np.array([0.1, 0.2, 0.3]), 2.0
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><freejoint/>"
        f"<geom type='box' size='0.1 0.2 0.3' mass='{mass}'/>"
        "</body></worldbody></mujoco>"
    )
    box = equivalent_box(model.body_mass[1], model.body_inertia[1])
    np.testing.assert_allclose(np.sort(box), half, rtol=1e-9)
