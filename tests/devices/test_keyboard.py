import os
import pty

import numpy as np
import pytest

from wbc_suite.devices.keyboard import Keyboard, parse_keys
from wbc_suite.errors import DeviceError


class Clock:
    now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def terminal():
    master, slave = pty.openpty()
    clock = Clock()
    keyboard = Keyboard(slave, clock)
    keyboard.start()

    def press(keys, later=0.0):
        os.write(master, keys)
        clock.now += later
        return keyboard.read()

    yield press
    keyboard.stop()
    os.close(master)
    os.close(slave)


def test_keys_are_parsed_with_arrows_and_names():
    assert list(parse_keys(b"wW\x1b[A\t\x1b \x7f")) == [
        "w", "w", "up", "tab", "escape", " ", "backspace",
    ]  # fmt: skip


def test_held_keys_make_a_twist_and_end_a_moment_later(terminal):
    state = terminal(b"wrj")
    twist = state.limbs["hand"].twist
    assert (np.sign(twist) == [1, 0, 1, 0, 0, 1]).all()
    np.testing.assert_array_equal(terminal(b"", 0.2).limbs["hand"].twist, np.zeros(6))


def test_repeats_of_a_held_key_press_its_button_once(terminal):
    assert terminal(b"\t").buttons == {"next"}
    assert terminal(b"\t", 0.03).buttons == frozenset()
    assert terminal(b"\t", 0.5).buttons == {"next"}


def test_space_asks_for_the_gripper_and_plus_is_faster(terminal):
    slow = terminal(b"w").limbs["hand"].twist[0]
    state = terminal(b" +w", 0.05)
    assert state.buttons == {"grip"}
    assert state.limbs["hand"].grip is None
    assert terminal(b"").limbs["hand"].twist[0] == pytest.approx(1.5 * slow)


def test_arrows_drive_the_base(terminal):
    state = terminal(b"\x1b[A\x1b[D")
    assert (np.sign(state.base) == [1, 0, 1]).all()


def test_key_v_lets_the_other_keys_drive_until_they_are_released(terminal):
    state = terminal(b"vwqf")
    assert (np.sign(state.base) == [1, 0, 1]).all()
    assert state.height < 0.0
    assert not state.limbs["hand"].twist.any()
    state = terminal(b"i", 0.2)
    assert not state.base.any()
    assert state.height == 0.0
    assert state.limbs["hand"].twist[4] > 0.0  # turns of the hand have their keys
    assert terminal(b"vw", 0.2).limbs["hand"].twist[0] > 0.0


def test_a_pipe_is_no_terminal():
    reader, writer = os.pipe()
    with pytest.raises(DeviceError, match="needs a terminal"):
        Keyboard(reader).start()
    os.close(reader)
    os.close(writer)
