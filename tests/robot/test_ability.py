"""PSYONIC Ability Hands: mass, coupled fingers, exports, left against right."""

import mujoco
import numpy as np
import pytest
from hand_checks import assert_links_agree, at_ready, landmarks

import wbc_suite

FINGERS = ("index", "middle", "ring", "pinky")
RATIO, OFFSET = 1.05851325, 0.72349796  # of the maker's four-bar linkage


@pytest.fixture(scope="module", params=["right", "left"])
def hand(request):
    return wbc_suite.load_robot(f"gripper/ability_{request.param}_hand")


def test_hand_weighs_what_the_data_sheet_says(hand):
    assert hand.mass == pytest.approx(0.49, abs=1e-6)
    for link in hand.links[1:]:
        gyration = np.sqrt(sum(link.inertia[:3]) / 2 / link.mass)
        assert gyration < 0.03  # the source's is up to 0.59 m


def test_outer_joints_follow_and_reach_their_limits_together(hand):
    assert hand.dof == 6
    leaders = {joint.name: joint for joint in hand.joints if joint.mimic is None}
    followers = [joint for joint in hand.joints if joint.mimic is not None]
    assert len(followers) == 4
    for joint in followers:
        assert (joint.mimic.ratio, joint.mimic.offset) == (RATIO, OFFSET)
        end = OFFSET + RATIO * leaders[joint.mimic.joint].range[1]
        assert joint.range[1] - 1e-4 < end <= joint.range[1]


def test_fingers_close_and_open_within_half_a_second(hand):
    model, data = at_ready(hand)
    side = hand.links[0].name[0]
    for posture, low, high in (("closed", 1.55, 1.83), ("open", -0.05, 0.12)):
        for synergy in hand.synergies["gripper"]:
            if synergy.name in FINGERS:
                for joint, value in getattr(synergy, posture).items():
                    data.actuator(joint).ctrl[0] = value
        mujoco.mj_step(model, data, round(0.5 / model.opt.timestep))
        for finger in FINGERS:
            root = data.joint(f"{side}_{finger}_q1").qpos[0]
            outer = data.joint(f"{side}_{finger}_q2").qpos[0]
            assert low < root < high
            assert outer == pytest.approx(OFFSET + RATIO * root, abs=0.03)


def test_both_engines_agree_on_every_link(hand):
    assert_links_agree(hand, at_ready(hand)[1])


def test_left_hand_is_the_mirror_image():
    right, left = (
        landmarks(at_ready(wbc_suite.load_robot(f"gripper/ability_{side}_hand"))[1])
        for side in ("right", "left")
    )
    np.testing.assert_allclose(left, right * [1, -1, 1], atol=1e-7)
