"""Inspire hands: mass, coupled joints, closing, left against right, on the Panda."""

import mujoco
import numpy as np
import pytest

import wbc_suite
from wbc_suite.control.ik.config import default_whole_body_config

FINGERS = ("index", "middle", "ring", "pinky")
RATIOS = {"thumb_intermediate": 1.6, "thumb_distal": 2.4}  # to the thumb's pitch


@pytest.fixture(scope="module", params=["right", "left"])
def hand(request):
    return wbc_suite.load_robot(f"gripper/inspire_{request.param}_hand")


def run(model, data, hand, **commands):
    """Send synergies to `open` or `closed` and simulate half a second."""
    for synergy in hand.synergies["gripper"]:
        if synergy.name in commands:
            for joint, value in getattr(synergy, commands[synergy.name]).items():
                data.actuator(joint).ctrl[0] = value
    mujoco.mj_step(model, data, round(0.5 / model.opt.timestep))


def test_hand_weighs_what_the_data_sheet_says(hand):
    assert hand.mass == pytest.approx(0.54, abs=1e-6)
    palm = hand.links[1]
    assert -0.142 < palm.com[2] < 0.0
    assert abs(palm.com[1]) < 0.02  # inside the palm, unlike the source's


def test_six_motors_move_twelve_joints_within_their_ranges(hand):
    assert hand.dof == 6
    leaders = {joint.name: joint for joint in hand.joints if joint.mimic is None}
    followers = [joint for joint in hand.joints if joint.mimic is not None]
    assert len(followers) == 6
    for joint in followers:
        ratio = RATIOS.get(joint.name[2:].removesuffix("_joint"), 1.0)
        assert joint.mimic.ratio == ratio
        ends = ratio * np.array(leaders[joint.mimic.joint].range)
        np.testing.assert_allclose(ends, joint.range)


def test_fingers_close_and_open_within_half_a_second(hand):
    model = hand.to_mjspec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("ready").id)
    for posture, low, high in (("closed", 1.55, 1.75), ("open", -0.05, 0.1)):
        run(model, data, hand, **dict.fromkeys(FINGERS, posture))
        for finger in FINGERS:
            side = hand.links[0].name[0]
            root = data.joint(f"{side}_{finger}_proximal_joint").qpos[0]
            outer = data.joint(f"{side}_{finger}_intermediate_joint").qpos[0]
            assert low < root < high
            assert outer == pytest.approx(root, abs=0.03)


def test_fingertips_of_left_and_right_are_reflections():
    """To the maker's tolerance: knuckles splay up to 2 mm otherwise at the tips."""
    tips = {}
    for side in ("right", "left"):
        hand = wbc_suite.load_robot(f"gripper/inspire_{side}_hand")
        model = hand.to_mjspec().compile()
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, model.key("ready").id)
        mujoco.mj_forward(model, data)
        names = [f"{finger}_tip" for finger in (*FINGERS, "thumb")] + ["tcp"]
        tips[side] = np.array([data.site(name).xpos for name in names])
    mirrored = tips["right"] * [1, -1, 1]
    assert np.abs(tips["left"] - mirrored).max() < 0.012


@pytest.mark.parametrize("name", ["PandaDexRH", "PandaDexLH"])
def test_panda_carries_the_hand_with_its_palm_inward(name):
    robot = wbc_suite.load_robot(name)
    side = "right" if name.endswith("RH") else "left"
    model = robot.to_mjspec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("ready").id)
    mujoco.mj_forward(model, data)
    assert data.ncon == 0
    flange, tool = data.site(f"{side}_eef").xpos, data.site(f"{side}_tcp").xpos
    inward = 1.0 if side == "right" else -1.0
    assert inward * (tool - flange)[1] > 0.03
    thumb, pinky = (data.site(f"{side}_{tip}_tip").xpos for tip in ("thumb", "pinky"))
    assert thumb[0] > pinky[0] + 0.1  # forward, as of a hand that shakes another
    (frame,) = default_whole_body_config(robot)["frame"]
    assert frame["name"] == f"{side}_hand"
