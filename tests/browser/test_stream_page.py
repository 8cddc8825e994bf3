"""The stream's page as a person uses it: real keys, a real mouse, a real Chromium."""

import numpy as np
import pytest
from conftest import wait_until

from wbc_suite.devices.stream import Stream

pytestmark = pytest.mark.browser


@pytest.fixture
def stream():
    stream = Stream(port=0)
    stream.start()
    yield stream
    stream.stop()


def says(stream):
    state = stream.read()
    hand = state.limbs.get("hand")
    return (np.zeros(6) if hand is None else hand.twist), hand, state


def test_held_keys_and_buttons_move_the_hand_and_let_it_go(stream, context):
    page = context.new_page()
    faults = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.goto(stream.url)
    page.get_by_text("connected").wait_for()
    page.keyboard.down("w")
    wait_until(lambda: says(stream)[0][0] > 0, "the key moves the hand forward")
    page.keyboard.up("w")
    wait_until(lambda: not says(stream)[0].any(), "the hand stops")
    box = page.get_by_text("yaw +").bounding_box()
    page.mouse.move(box["x"] + 10, box["y"] + 10)
    page.mouse.down()
    wait_until(lambda: says(stream)[0][5] > 0, "the button turns the hand")
    page.mouse.up()
    wait_until(lambda: not says(stream)[0].any(), "the hand stops again")
    page.keyboard.press("Space")
    wait_until(lambda: "grip" in says(stream)[2].buttons, "the key grips")
    page.get_by_text("gripper", exact=True).click()
    wait_until(lambda: "grip" in says(stream)[2].buttons, "the button grips")
    page.keyboard.down("ArrowUp")
    wait_until(lambda: says(stream)[2].base[0] > 0, "the base drives")
    page.keyboard.up("ArrowUp")
    page.get_by_text("next hand", exact=True).click()
    wait_until(lambda: "next" in says(stream)[2].buttons, "the next hand")
    assert stream.refused == ""
    assert faults == []
