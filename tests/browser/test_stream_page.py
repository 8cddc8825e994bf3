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


GAMEPAD = """
    window.pad = { mapping: "standard", axes: [0, 0, 0, 0],
                   buttons: [...Array(17)].map(() => ({ pressed: false, value: 0 })) }
    navigator.getGamepads = () => [window.pad]
    window.sockets = []
    window.WebSocket = class extends WebSocket {
        constructor(...options) { super(...options); sockets.push(this) }
    }
"""
PRESS = "([number, pressed]) => { pad.buttons[number] = { pressed, value: +pressed } }"


@pytest.fixture
def page(stream, context):
    page = context.new_page()
    page.add_init_script(GAMEPAD)
    page.goto(stream.url)
    page.get_by_text("connected").wait_for()
    return page


def test_gamepad_moves_the_hand_while_its_enable_button_is_held(stream, page):
    page.evaluate("pad.axes = [0, -1, 0, 0]")
    page.evaluate(PRESS, [0, True])
    page.evaluate(PRESS, [3, True])
    wait_until(lambda: "next" in says(stream)[2].buttons, "the gamepad is read")
    assert says(stream)[2].at_rest
    assert "grip" not in says(stream)[2].buttons
    page.evaluate(PRESS, [4, True])
    wait_until(lambda: says(stream)[0][0] > 0, "it moves the hand")
    wait_until(lambda: "grip" in says(stream)[2].buttons, "it grips")
    page.evaluate(PRESS, [4, False])
    wait_until(lambda: says(stream)[2].at_rest, "it stops")


def test_what_is_held_while_the_connection_drops_has_to_be_pressed_anew(stream, page):
    page.keyboard.down("w")
    wait_until(lambda: says(stream)[0][0] > 0, "the key moves the hand")
    page.evaluate("sockets.at(-1).close()")
    page.get_by_text("waiting for the robot").wait_for()
    page.get_by_text("connected").wait_for()
    wait_until(lambda: says(stream)[2].at_rest, "nothing moves")
    page.keyboard.up("w")
    page.keyboard.down("w")
    wait_until(lambda: says(stream)[0][0] > 0, "the key moves the hand again")


def test_key_with_another_sign_when_it_is_released_is_released(stream, page):
    """Comma is `<` while shift is held, on most keyboards."""
    page.keyboard.down(",")
    wait_until(lambda: not says(stream)[2].at_rest, "the base moves")
    page.keyboard.down("Shift")
    page.keyboard.up("<")  # the same key
    wait_until(lambda: says(stream)[2].at_rest, "the base stops")
