"""The view page in a real browser."""

import pytest
from conftest import Viewer, wait_until

import wbc_suite
from wbc_suite.viewers.page_server import PageServer
from wbc_suite.viewers.robot_page import RobotPage

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def test_buttons_and_toggles_change_what_is_seen(context):
    page = RobotPage(wbc_suite.load_robot("GR1"), PageServer(port=0))
    try:
        viewer = Viewer(context, page.site, dots=1.0)
        elbow = "right_elbow_pitch_joint"
        assert page.position(elbow) != 0.0
        viewer.page.get_by_role("button", name="zero").click()
        wait_until(lambda: page.position(elbow) == 0.0, "the posture changes")
        viewer.page.get_by_role("button", name="ready").click()
        wait_until(lambda: page.position(elbow) != 0.0, "the posture changes back")
        shapes = page.scene.collision_shapes
        assert not any(shape.visible for shape in shapes)
        viewer.page.get_by_label("Collision shapes").click()
        wait_until(lambda: all(s.visible for s in shapes), "collision shapes appear")
        viewer.screenshot("view_gr1")
    finally:
        page.site.stop()
