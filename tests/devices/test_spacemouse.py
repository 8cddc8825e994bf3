import struct

import numpy as np
import pytest

from wbc_suite.devices.hid import open_hid
from wbc_suite.devices.spacemouse import SpaceMouse, parse_axes, parse_buttons, shaped
from wbc_suite.errors import DeviceError

REST = np.zeros(6)


def report(number, *values):
    return bytes([number]) + struct.pack(f"<{len(values)}h", *values)


class FakeHid:
    def __init__(self, *reports):
        self.waiting, self.closed = list(reports), False

    def read(self, size):
        return list(self.waiting.pop(0)[:size]) if self.waiting else []

    def close(self):
        self.closed = True


class PulledOut(FakeHid):
    def read(self, size):
        raise OSError("read error")


def test_translation_and_rotation_come_in_two_reports():
    axes = parse_axes(report(1, 350, -175, 0), REST)
    axes = parse_axes(report(2, 0, 0, 70), axes)
    np.testing.assert_allclose(axes, [1, -0.5, 0, 0, 0, 0.2])


def test_newer_models_say_all_six_axes_in_one_report():
    axes = parse_axes(report(1, 35, 0, 0, 0, 350, 5000), REST)
    np.testing.assert_allclose(axes, [0.1, 0, 0, 0, 1, 1])


@pytest.mark.parametrize("broken", [b"", b"\x01", b"\x01\x02\x03", b"\x17" * 13])
def test_other_and_broken_reports_change_nothing(broken):
    np.testing.assert_array_equal(parse_axes(broken, REST), REST)
    assert parse_buttons(broken) is None


def test_buttons_are_bits():
    assert parse_buttons(b"\x03\x05\x00") == {0, 2}
    assert parse_buttons(b"\x03\x00\x00\x00\x80") == {31}


def test_near_rest_is_rest_and_full_is_full():
    axes = shaped(np.array([0.05, -0.05, 1.0, -1.0, 0.5, 0.0]))
    np.testing.assert_array_equal(axes[[0, 1, 2, 3, 5]], [0, 0, 1, -1, 0])
    assert 0 < axes[4] < 0.45


def test_push_away_moves_forward_and_twist_left_turns_left():
    hid = FakeHid(report(1, 0, -350, 0), report(2, 0, 0, -350))
    mouse = SpaceMouse(find=lambda: [hid])
    mouse.start()
    twist = mouse.read().limbs["hand"].twist
    assert (np.sign(twist) == [1, 0, 0, 0, 0, 1]).all()
    mouse.stop()
    assert hid.closed


def test_two_mice_move_two_hands_and_buttons_close_and_send_home():
    right = FakeHid(report(1, 0, 0, -350), b"\x03\x01\x00")
    left = FakeHid(report(1, 0, 0, 350), b"\x03\x02\x00")
    mouse = SpaceMouse(("right", "left"), find=lambda: [right, left])
    mouse.start()
    state = mouse.read()
    assert state.limbs["right"].twist[2] > 0 > state.limbs["left"].twist[2]
    assert (state.limbs["right"].grip, state.limbs["left"].grip) == (1.0, -1.0)
    assert state.buttons == {"home"}


def test_mouse_that_goes_from_hand_to_hand_says_buttons():
    hid = FakeHid(b"\x03\x01\x00", b"\x03\x03\x00")
    mouse = SpaceMouse(find=lambda: [hid])
    mouse.start()
    state = mouse.read()
    assert state.buttons == {"grip", "next"}
    assert state.limbs["hand"].grip is None
    assert mouse.read().buttons == frozenset()


def test_mouse_that_falls_silent_or_is_pulled_out_stops_the_hand():
    now = [0.0]
    mice = [FakeHid(report(1, 350, 0, 0)), PulledOut()]
    mouse = SpaceMouse(("right", "left"), lambda: mice, lambda: now[0])
    mouse.start()
    assert mouse.read().limbs["right"].twist.any()
    now[0] = 1.0
    state = mouse.read()
    assert not state.limbs["right"].twist.any()
    assert not state.limbs["left"].twist.any()


def test_missing_package_or_mouse_is_said_plainly():
    with pytest.raises(DeviceError, match=r"hidapi|0 found"):
        open_hid("SpaceMouse", (0xFFFF,), (1,))
