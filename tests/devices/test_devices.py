"""Devices by name, ports of real environments, and a loop around both."""

from contextlib import nullcontext

import numpy as np
import pytest
from floating import FloatingEnv

import wbc_suite
from wbc_suite.cli.options import device_options
from wbc_suite.devices import (
    DEVICES,
    DeviceState,
    LimbInput,
    Pipeline,
    PipelineConfig,
    Scripted,
    drive,
    make_device,
    register_device,
)
from wbc_suite.devices.action_ports import joint_ports, speed_ports
from wbc_suite.devices.mjgui import MjGui
from wbc_suite.errors import ConfigError, UnknownNameError


def test_devices_are_made_by_name(forget):
    forget(DEVICES, "Nodding")
    assert {"keyboard", "spacemouse", "gamepad", "stream"} <= set(DEVICES)
    with pytest.raises(UnknownNameError, match="Did you mean 'keyboard'"):
        make_device("keybord")
    register_device("Nodding", lambda: Scripted([]))
    assert isinstance(make_device("nodding"), Scripted)
    with pytest.raises(ConfigError, match="exists already"):
        register_device("keyboard", lambda: Scripted([]))


def test_drive_steps_until_quit_and_resets_and_pauses():
    env, up = FloatingEnv(), LimbInput(twist=np.array([0, 0, 0.3, 0, 0, 0]))

    def press(k):
        names = {20: "reset", 25: "pause", 35: "pause", 60: "quit"}
        return frozenset({names[k]}) if k in names else frozenset()

    says = [
        DeviceState(time=k * 0.01, limbs={"right": up}, buttons=press(k))
        for k in range(1, 99)
    ]
    seen = []
    info = drive(
        env,
        Scripted(says),
        Pipeline(env, PipelineConfig(ramp=0.0)),
        real_time=False,
        on_step=lambda state, info: seen.append(env.simulation.data.qpos[2]),
    )
    assert info == {"success": False}
    assert len(seen) == 59 - 10  # ten were paused
    assert seen[18] > 1.03  # it went up, ...
    assert seen[19] < 1.001  # ... and began again


@pytest.fixture(scope="module")
def lift():
    env = wbc_suite.make("Lift", robots="Panda", controller_configs="BASIC")
    yield env
    env.close()


def test_arm_under_osc_goes_where_the_hand_says(lift):
    lift.reset(seed=0)
    pipeline = Pipeline(lift, PipelineConfig(ramp=0.0))
    hand = pipeline.limbs["right"]
    twist = np.array([0.1, 0.1, 0.1, 0, 0, 0.4])
    for k in range(1, 31):
        said = LimbInput(twist=twist if k <= 20 else np.zeros(6))
        lift.step(pipeline.update(DeviceState(time=0.05 * k, limbs={"hand": said})))
    measured = hand.port.measure()
    moved = measured.translation - hand.home.translation
    np.testing.assert_allclose(moved, [0.1, 0.1, 0.1], atol=0.01)
    turned = measured.rotation @ hand.home.rotation.T
    assert np.arctan2(turned[1, 0], turned[0, 0]) == pytest.approx(0.4, abs=0.03)


class FakeWindow:
    def __init__(self, model, data):
        self.model, self.data, self.open = model, data, True

    def is_running(self):
        return self.open

    def lock(self):
        return nullcontext()

    def sync(self):
        pass

    def close(self):
        self.open = False


def test_box_that_is_dragged_in_mujocos_window_moves_the_hand(lift):
    lift.reset(seed=0)
    windows = []

    def launch(model, data):
        windows.append(FakeWindow(model, data))
        return windows[-1]

    gui = MjGui(lift, launch=launch)
    gui.start()
    pose = gui.read().limbs["right"].pose
    hand = Pipeline(lift).limbs["right"].port.measure()
    assert pose.isApprox(hand, 1e-6)
    windows[0].data.mocap_pos[0] += [0.0, 0.0, 0.05]
    moved = gui.read().limbs["right"].pose.translation - hand.translation
    np.testing.assert_allclose(moved, [0, 0, 0.05], atol=1e-6)
    windows[0].open = False
    assert gui.read().buttons == {"quit"}
    gui.stop()


def test_leader_arm_drives_joints_within_their_limits():
    env = wbc_suite.make("Lift", robots="Panda", controller_configs="JOINT_POSITION")
    env.reset(seed=0)
    ports = joint_ports(env)
    assert speed_ports(env) == {}
    (port,) = ports.values()
    pipeline = Pipeline(env, PipelineConfig(ramp=0.0))
    start = port.measure()
    goal = dict(zip(port.joints, start + 0.2, strict=True))
    for k in range(40):
        env.step(pipeline.update(DeviceState(time=0.05 * k, joints=goal)))
    np.testing.assert_allclose(port.measure(), start + 0.2, atol=0.02)
    env.close()


def test_device_of_a_users_own_module_is_found(tmp_path, monkeypatch):
    (tmp_path / "my_devices.py").write_text(
        "from wbc_suite.devices import Scripted\n"
        "class Stick(Scripted):\n"
        "    def __init__(self, gain=1.0):\n"
        "        super().__init__([])\n"
        "        self.gain = gain\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    assert make_device("my_devices:Stick", gain=2.0).gain == 2.0
    with pytest.raises(ConfigError, match="'my_devices:Stock' cannot be found"):
        make_device("my_devices:Stock")
    with pytest.raises(ConfigError, match="PYTHONPATH"):
        make_device("my_devises:Stick")


def test_options_on_the_command_line_are_values_or_text():
    pairs = ["port=0", "tls=true", 'hands=["right", "left"]', "host=0.0.0.0"]
    assert device_options(pairs) == {
        "port": 0,
        "tls": True,
        "hands": ["right", "left"],
        "host": "0.0.0.0",
    }
    with pytest.raises(ConfigError, match="NAME=VALUE"):
        device_options(["tls"])
