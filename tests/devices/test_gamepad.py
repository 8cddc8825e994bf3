import os
import struct
from dataclasses import replace

import numpy as np
import pytest

from wbc_suite.devices.gamepad import (
    DualSense,
    Gamepad,
    Pad,
    pad_state,
    parse_dualsense,
    parse_joystick,
)
from wbc_suite.errors import DeviceError


def dualsense(
    left=(127, 127), right=(127, 127), triggers=(0, 0), hat=8, face=0, rest=0
):
    return bytes([1, *left, *right, *triggers, 0, hat | face << 4, rest, 0, 0])


def test_dualsense_at_rest_is_at_rest():
    pad = parse_dualsense(dualsense())
    np.testing.assert_allclose([*pad.left, *pad.right], 0.0, atol=0.005)
    assert (pad.triggers, pad.cross, pad.down) == ((0, 0), (0, 0), frozenset())


def test_dualsense_sticks_triggers_cross_and_buttons():
    pad = parse_dualsense(
        dualsense((255, 0), (0, 255), (51, 255), hat=1, face=0b0010, rest=0b100010)
    )
    np.testing.assert_allclose([*pad.left, *pad.right], [1, 1, -1, -1])
    assert pad.triggers == (0.2, 1.0)
    assert pad.cross == (1, 1)
    assert pad.down == {"south", "r1", "start"}


def test_dualsense_by_bluetooth_has_one_byte_more():
    report = dualsense((255, 0))
    assert parse_dualsense(b"\x31\x02" + report[1:]) == parse_dualsense(report)


@pytest.mark.parametrize("broken", [b"", b"\x01", b"\x05" * 64])
def test_other_reports_are_not_read(broken):
    assert parse_dualsense(broken) is None


def event(kind, number, value):
    return struct.pack("<IhBB", 0, value, kind, number)


def test_joystick_events_change_what_they_name():
    pad = Pad()
    for kind, number, value in [
        (0x82, 0, 32767), (2, 1, 32767), (2, 5, 0), (2, 7, -32767),
        (1, 0, 1), (1, 3, 1), (1, 0, 0), (1, 40, 1), (2, 30, 1),
    ]:  # fmt: skip
        pad = parse_joystick(event(kind, number, value), pad)
    assert pad.left == (1.0, -1.0)
    assert pad.triggers == (0.0, 0.5)
    assert pad.cross == (0, 1)
    assert pad.down == {"north"}


def test_pad_moves_the_hand_and_says_its_buttons():
    down = frozenset({"south", "l1"})
    pad = Pad(left=(0.0, 1.0), right=(1.0, 0.0), cross=(1, 0), down=down)
    state = pad_state(0.0, pad, {"north"})
    assert (np.sign(state.limbs["hand"].twist) == [1, 0, 0, 0, 0, -1]).all()
    assert (np.sign(state.base) == [0, 0, -1]).all()
    assert state.buttons == {"grip", "next"}
    state = pad_state(0.0, replace(pad, down=down | {"r1"}))
    assert (np.sign(state.limbs["hand"].twist) == [1, 0, 0, 1, 0, 0]).all()


@pytest.mark.parametrize("drives", [False, True])
def test_pad_moves_nothing_unless_its_enable_button_is_held(drives):
    down = frozenset({"south", "west", "north", "east", "start", "select", "r1"})
    pad = Pad((1.0, 1.0), (1.0, 1.0), (0.3, 1.0), (1, 1), down)
    state = pad_state(0.0, pad, drives=drives)
    assert state.at_rest
    assert state.buttons == {"next", "discard", "keep", "reset"}
    enabled = pad_state(0.0, replace(pad, down=down | {"l1"}), drives=drives)
    assert not enabled.at_rest
    assert {"grip", "home"} < enabled.buttons


def test_both_sticks_drive_after_a_press_of_the_left_one(tmp_path):
    file = tmp_path / "js0"
    os.mkfifo(file)
    gamepad = Gamepad(file)
    gamepad.start()
    with file.open("wb", buffering=0) as writer:
        writer.write(event(1, 4, 1) + event(1, 9, 1) + event(1, 9, 0))
        writer.write(event(2, 1, -32767) + event(2, 3, 32767) + event(2, 4, 32767))
        state = gamepad.read()
        assert state.base[0] > 0.0 > state.base[2]
        assert state.height < 0.0
        assert not state.limbs["hand"].twist.any()
        writer.write(event(2, 1, 0) + event(2, 3, 0) + event(2, 4, 0))
        state = gamepad.read()
        assert not state.base.any()
        assert state.height == 0.0
        writer.write(event(1, 9, 1) + event(2, 1, -32767))
        assert gamepad.read().limbs["hand"].twist[0] > 0.0
    gamepad.stop()


def test_dualsense_names_presses_of_its_sticks():
    assert parse_dualsense(dualsense(rest=0b1000000)).down == {"l3"}


def test_small_deflections_are_rest():
    down = frozenset({"l1"})
    state = pad_state(0.0, Pad(left=(0.06, 0.06), right=(0.0, -0.09), down=down))
    assert state.at_rest


def test_gamepad_reads_the_kernels_file(tmp_path):
    file = tmp_path / "js0"
    os.mkfifo(file)
    gamepad = Gamepad(file)
    gamepad.start()
    with file.open("wb", buffering=0) as writer:
        writer.write(event(1, 4, 1) + event(2, 1, -32767))
        writer.write(event(1, 0, 1) + event(1, 0, 0))
        state = gamepad.read()
        assert state.limbs["hand"].twist[0] > 0
        assert state.buttons == {"grip"}  # though it is up again
        state = gamepad.read()
        assert state.limbs["hand"].twist[0] > 0  # it is still held
        assert state.buttons == frozenset()
        writer.write(event(1, 4, 0))
        assert gamepad.read().at_rest
    gamepad.stop()


class Hid:
    """Holds reports until they are read."""

    def __init__(self, waiting):
        self.waiting, self.closed = waiting, False

    def read(self, _):
        return self.waiting.pop(0) if self.waiting else b""

    def close(self):
        self.closed = True


def test_dualsense_that_lost_its_connection_with_a_stick_held_has_no_new_data():
    now, held = [5.0], dualsense((127, 0), rest=1)
    full = held + bytes(64 - len(held))
    hid = Hid([full, full])
    pad = DualSense(find=lambda: [hid], clock=lambda: now[0])
    pad.start()
    assert not pad.read().at_rest
    now[0] = 6.0
    assert pad.read().time == 5.0
    hid.waiting = [full]
    assert pad.read().time == 6.0


def test_dualsense_takes_the_newest_of_many_reports():
    hid = Hid([dualsense((255, 127), rest=1), dualsense((127, 0), rest=1)])
    pad = DualSense(find=lambda: [hid])
    pad.start()
    twist = pad.read().limbs["hand"].twist
    assert twist[0] > 0
    assert abs(twist[1]) < 0.01
    pad.stop()
    assert hid.closed


def test_no_gamepad_is_said_plainly(tmp_path):
    with pytest.raises(DeviceError, match="No gamepad at"):
        Gamepad(tmp_path / "js9").start()
