"""Sliders of grippers show what anybody commands, and leave a person's touch alone."""

import numpy as np
import pytest
from fake_env import FakeEnv

from wbc_suite.viewers import gripper_sliders
from wbc_suite.viewers.page_server import PageServer
from wbc_suite.viewers.teleop_page import TeleopPage
from wbc_suite.viewers.teleop_session import TeleopSession

GRIPPER = "right_gripper"


@pytest.fixture
def session():
    return TeleopSession(FakeEnv(), period=0.02)


@pytest.fixture
def page(session):
    made = TeleopPage(session, PageServer(port=0), label="test")
    yield made
    made.stop()


def shown(page):
    """What the whole gripper's slider says, and those of its fingers."""
    handles = page.server.gui._gui_input_handle_from_uuid.values()
    sliders = {h.label: h.value for h in handles if getattr(h, "step", 0) == 0.02}
    return sliders["Right gripper"], [sliders["thumb"], sliders["fingers"]]


def test_sliders_follow_a_device_and_a_reset(session, page):
    assert shown(page) == (-1.0, [-1.0, -1.0])
    session.set_gripper(GRIPPER, 1, 0.5)  # not by the page
    session.tick()
    page.update()
    assert shown(page) == (-0.25, [-1.0, 0.5])
    session.reset()
    session.tick()
    page.update()
    assert shown(page) == (-1.0, [-1.0, -1.0])


def test_slider_in_a_persons_hand_is_left_to_the_person(session, page, monkeypatch):
    sliders = gripper_sliders.GripperSliders(page.server.gui, session, GRIPPER)
    now = [100.0]
    monkeypatch.setattr(gripper_sliders.time, "monotonic", lambda: now[0])
    sliders.touch()
    sliders.update(np.array([1.0, 1.0]))
    assert shown(page) == (-1.0, [-1.0, -1.0])
    now[0] += gripper_sliders.USER_TIME
    sliders.update(np.array([1.0, 1.0]))
    assert shown(page) == (1.0, [1.0, 1.0])
