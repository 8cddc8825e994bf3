"""Schunk SVH hands: mass, couplings, exports, left against right, on GR1."""

import mujoco
import numpy as np
import pytest
from hand_checks import assert_links_agree, at_ready, landmarks

import wbc_suite


@pytest.fixture(scope="module", params=["right", "left"])
def hand(request):
    return wbc_suite.load_robot(f"gripper/schunk_svh_{request.param}_hand")


def moved(hand, values):
    """Return MuJoCo's state with drives at values and followers behind them."""
    model, data = at_ready(hand)
    for joint in hand.joints:
        if joint.mimic is None:
            value = values.get(joint.name, 0.0)
        else:
            value = joint.mimic.ratio * values.get(joint.mimic.joint, 0.0)
        data.joint(joint.name).qpos = value
    mujoco.mj_forward(model, data)
    return data


def test_hand_weighs_what_the_data_sheet_says(hand):
    assert hand.mass == pytest.approx(1.3, abs=1e-6)


def test_nine_drives_move_twenty_joints_within_their_ranges(hand):
    assert hand.dof == 9
    leaders = {joint.name: joint for joint in hand.joints if joint.mimic is None}
    followers = [joint for joint in hand.joints if joint.mimic is not None]
    assert len(followers) == 11
    for joint in followers:
        end = joint.mimic.ratio * leaders[joint.mimic.joint].range[1]
        assert joint.range[1] - 1e-3 < end <= joint.range[1]


def test_fingers_close_and_open_within_a_second(hand):
    model, data = at_ready(hand)
    side = hand.links[0].name.split("_")[0]
    for posture, low, high in (("closed", 0.8, 1.4), ("open", -0.05, 0.12)):
        for synergy in hand.synergies["gripper"]:
            if "index" in synergy.name or "middle" in synergy.name:
                for joint, value in getattr(synergy, posture).items():
                    data.actuator(joint).ctrl[0] = value
        mujoco.mj_step(model, data, round(1.0 / model.opt.timestep))
        for finger in ("Index", "Middle"):
            bent = data.joint(f"{side}_hand_{finger}_Finger_Distal").qpos[0]
            assert low < bent < high


def test_both_engines_agree_on_every_link(hand):
    values = {j.name: 0.4 * j.range[1] for j in hand.joints if j.mimic is None}
    assert_links_agree(hand, moved(hand, values))


def test_left_hand_is_the_mirror_image():
    places = {}
    for side in ("right", "left"):
        hand = wbc_suite.load_robot(f"gripper/schunk_svh_{side}_hand")
        values = {j.name: 0.3 * j.range[1] for j in hand.joints if j.mimic is None}
        places[side] = landmarks(moved(hand, values))
    np.testing.assert_allclose(places["left"], places["right"] * [1, -1, 1], atol=1e-7)


def test_gr1_carries_both_hands():
    robot = wbc_suite.load_robot("GR1ArmsOnly", gripper="SchunkSvhHand")
    model, data = at_ready(robot)
    assert data.ncon == 0
    for side in ("right", "left"):
        assert model.joint(f"{side}_hand_Thumb_Opposition").id >= 0
