import numpy as np
import pinocchio as pin
import pytest
from floating import FloatingEnv
from hypothesis import given, settings
from hypothesis import strategies as st

from wbc_suite.devices import DeviceState, LimbInput, Pipeline, PipelineConfig
from wbc_suite.devices.pipeline.retarget import curls, opposition, pinch, retarget

SHADOW = ("thumb_yaw", "thumb_pitch", "index", "middle", "ring", "pinky")


def person(bend=0.0, *, thumb=0.0, across=0.0):
    """A hand with x to the fingertips, y to the thumb, and palm down."""
    joints = np.zeros((25, 3))
    for k in range(4):
        place, angle = np.array([0.03, 0.03 - 0.02 * k, 0.0]), 0.0
        joints[5 + 5 * k] = place
        for j, length in enumerate((0.06, 0.04, 0.025, 0.02)):
            place = place + length * np.array([np.cos(angle), 0.0, -np.sin(angle)])
            joints[6 + 5 * k + j] = place
            angle += bend
    place, angle = np.array([0.01, 0.03, 0.0]), 0.0
    for j, length in enumerate((0.0, 0.04, 0.03, 0.025)):
        toward = np.array([np.sin(angle), np.cos(angle + across), 0.0])
        place = place + length * toward
        joints[1 + j], angle = place, angle + thumb
    return joints


def test_straight_hand_is_open_and_a_fist_is_closed():
    assert max(curls(person()).values()) < 0.05
    fist = curls(person(1.3, thumb=0.9))
    assert min(fist[name] for name in ("index", "middle", "ring", "pinky")) == 1.0
    assert fist["thumb"] > 0.8
    halfway = curls(person(0.6))["ring"]
    assert 0.3 < halfway < 0.7


@settings(max_examples=30)
@given(
    size=st.floats(0.5, 2.0),
    turn=st.tuples(*[st.floats(-2.0, 2.0)] * 3),
    place=st.tuples(*[st.floats(-5.0, 5.0)] * 3),
)
def test_where_the_hand_is_and_how_large_does_not_matter(size, turn, place):
    joints = person(0.5, thumb=0.4)
    moved = size * joints @ pin.exp3(np.array(turn)).T + np.array(place)
    for labels in (SHADOW, ("grasp",)):
        np.testing.assert_allclose(
            retarget(moved, labels, by_pinch=False),
            retarget(joints, labels, by_pinch=False),
            atol=1e-6,
        )


def test_pinch_closes_a_gripper_and_opening_opens_it():
    joints = person()
    assert retarget(joints, ("grasp",), by_pinch=False)[0] == pytest.approx(-1.0)
    joints[4] = joints[9]  # thumb's tip on the index finger's
    assert pinch(joints) == 1.0
    assert retarget(joints, SHADOW, by_pinch=True).tolist() == [1.0] * 6


def test_each_finger_moves_its_synergy():
    joints = person()
    bent = person(1.2)
    joints[5:10] = bent[5:10]  # only the index finger
    values = dict(zip(SHADOW, retarget(joints, SHADOW, by_pinch=False), strict=True))
    assert values["index"] == pytest.approx(1.0)
    assert max(values["middle"], values["ring"], values["pinky"]) < -0.9
    joints[4] = joints[16]  # the thumb reaches across the palm
    assert opposition(joints) == 1.0


def test_flat_or_empty_hand_gives_numbers():
    values = retarget(np.zeros((25, 3)), SHADOW, by_pinch=False)
    assert np.isfinite(values).all()


def test_pipeline_closes_the_robots_hand_with_the_persons():
    env = FloatingEnv()
    pipeline = Pipeline(env, PipelineConfig(ramp=0.0))
    for k in range(100):
        said = LimbInput(fingers=person(1.3, thumb=0.9))
        state = DeviceState(time=float(k), limbs={"right": said})
        values = env.action_layout.unpack(pipeline.update(state))
    assert values["right_gripper"][1] == pytest.approx(1.0, abs=1e-3)
