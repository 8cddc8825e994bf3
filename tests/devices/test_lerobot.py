import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.devices import DeviceState, LimbInput, Scripted
from wbc_suite.devices.lerobot import (
    DEGREES,
    FromLeRobot,
    ToLeRobot,
    flatten,
    unflatten,
)
from wbc_suite.errors import DeviceError

POSE = pin.SE3(pin.exp3(np.array([0.3, -0.2, 1.0])), np.array([0.1, 0.2, 0.3]))
SAID = DeviceState(
    time=3.0,
    limbs={
        "right": LimbInput(pose=POSE, engaged=False, grip=np.array([0.5, -1.0])),
        "left": LimbInput(twist=np.arange(6.0), grip=np.array(0.25)),
    },
    joints={"elbow": 0.7},
    base=np.array([0.1, 0.0, -0.2]),
    buttons=frozenset({"grip", "keep"}),
)


def test_state_goes_through_a_flat_dictionary_and_back():
    flat = flatten(SAID)
    assert all(type(value) is float for value in flat.values())
    again = unflatten(flat, 3.0)
    assert again.limbs["right"].pose.isApprox(POSE, 1e-12)
    assert not again.limbs["right"].engaged
    assert flatten(again) == pytest.approx(flat)
    assert again.buttons == {"grip", "keep"}


def test_our_device_is_a_teleoperator():
    teleoperator = ToLeRobot(Scripted([SAID] * 5))
    assert not teleoperator.is_connected
    teleoperator.connect(calibrate=False)
    assert teleoperator.is_connected
    assert teleoperator.is_calibrated
    assert set(teleoperator.action_features) == set(teleoperator.get_action())
    assert set(teleoperator.action_features.values()) == {float}
    assert teleoperator.feedback_features == {}
    teleoperator.disconnect()
    assert not teleoperator.is_connected


class LeaderArm:
    connected = False

    def connect(self):
        self.connected = True

    def get_action(self):
        return {"shoulder_pan.pos": np.float32(90.0), "gripper": 3.0}

    def disconnect(self):
        self.connected = False


def test_their_leader_arm_is_a_device():
    arm, ours = LeaderArm(), "right_shoulder_joint.pos"
    names, scale = {"shoulder_pan.pos": ours}, {ours: DEGREES}
    device = FromLeRobot(arm, names=names, scale=scale, clock=lambda: 7.0)
    device.start()
    assert arm.connected
    state = device.read()
    assert state.time == 7.0
    assert state.joints == {"right_shoulder_joint": pytest.approx(np.pi / 2)}
    assert state.limbs == {}
    device.stop()
    assert not arm.connected


def test_what_is_no_number_is_named():
    with pytest.raises(DeviceError, match=r"'a\.pos' is not a number"):
        unflatten({"a.pos": [1, 2]}, 0.0)
