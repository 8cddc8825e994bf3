"""Grippers and bases that the caller chooses: sides, roots, heights."""

import mujoco
import numpy as np
import pytest

import wbc_suite
from wbc_suite.catalogue import Catalogue
from wbc_suite.errors import ConfigError, DescriptionError, UnknownNameError
from wbc_suite.scene import place_robot

CATALOGUE = Catalogue().root / "robots"


def test_base_brings_its_own_root_and_height():
    at = {b: wbc_suite.load_robot("Panda", base=b) for b in (None, *BASES)}
    assert {b: (r.root.kind, r.root.pos[2]) for b, r in at.items()} == {
        None: ("fixed", 0.912),
        "RethinkMount": ("fixed", 0.912),
        "NullMount": ("fixed", 0.0),
        "none": ("fixed", 0.0),
        "NullMobileBase": ("planar", 0.0),
        "NoActuationBase": ("free", 0.0),
    }


BASES = ("RethinkMount", "NullMount", "none", "NullMobileBase", "NoActuationBase")


def test_a_legged_robot_accepts_only_a_base_without_body():
    own = wbc_suite.load_robot("GR1")
    planar = wbc_suite.load_robot("GR1", base="FloatingLeggedBase")
    assert planar.root.kind == "planar"
    assert planar.root.pos == own.root.pos
    assert planar.links == own.links
    with pytest.raises(DescriptionError, match=r"GR1 has its own .* NullMount"):
        wbc_suite.load_robot("GR1", base="RethinkMount")


def test_left_hand_does_not_fit_a_right_arm():
    with pytest.raises(DescriptionError, match=r"These fit: .*FourierRightHand"):
        wbc_suite.load_robot("Panda", gripper="FourierLeftHand")
    with pytest.raises(DescriptionError, match="left arm; give one for each side"):
        wbc_suite.load_robot("GR1", gripper="FourierRightHand")
    with pytest.raises(DescriptionError, match="does not fit the right arm"):
        wbc_suite.load_robot("Tiago", gripper={"right": "FourierLeftHand"})


def test_name_without_side_is_the_hand_of_each_side():
    robot = wbc_suite.load_robot("Tiago", gripper="FourierHand")
    explicit = {"right": "fourier_right_hand", "left": "fourier_left_hand"}
    assert robot == wbc_suite.load_robot("Tiago", gripper=explicit)
    assert wbc_suite.load_robot("GR1", gripper="FourierHand") == wbc_suite.load_robot(
        "GR1"
    )


def test_the_error_of_an_unknown_gripper_or_base_names_the_nearest():
    with pytest.raises(UnknownNameError, match="Did you mean 'PandaGripper'"):
        wbc_suite.load_robot("Panda", gripper="PandaGriper")
    with pytest.raises(UnknownNameError, match="Did you mean 'NullMount'"):
        wbc_suite.load_robot("Panda", base="NulMount")


def test_omron_base_carries_the_arm_on_its_lift():
    robot = wbc_suite.load_robot("PandaOmron")
    model = robot.to_mjspec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("ready").id)
    for height in (0.0, 0.34):
        data.joint("joint_torso_height").qpos = height
        mujoco.mj_forward(model, data)
        foot = data.body("panda_link0").xpos
        np.testing.assert_allclose(foot, [0, 0, 0.7 + height], atol=1e-12)
        assert data.ncon == 0
    base = sum(robot.link(name).mass for name in ("base", "wheeled_base"))
    assert base == 62.0  # Omron's data sheet of the LD-60
    assert robot.groups["torso"] == ("joint_torso_height",)
    chosen = wbc_suite.load_robot("Panda", base="Omron_Mobile_Base")
    assert chosen.links == robot.links
    assert chosen.root == robot.root


def test_arms_stand_where_they_are_placed_though_the_base_turns_behind_them():
    robot = place_robot(wbc_suite.load_robot("PandaOmron"), (1.0, 2.0), np.pi / 2)
    model = robot.to_mjspec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.body("panda_link0").xpos[:2], [1, 2], atol=1e-12)
    np.testing.assert_allclose(data.body("base").xpos[:2], [1, 1.79], atol=1e-12)


def test_two_different_grippers_with_equal_names_of_links_fit_one_robot():
    pair = {"right": "Robotiq140Gripper", "left": "XArm7Gripper"}
    robot = wbc_suite.load_robot("Tiago", gripper=pair)
    alone = wbc_suite.load_robot("gripper/xarm7_gripper").joint_names
    assert {f"left_{name}" for name in alone} <= set(robot.joint_names)


def test_every_part_keeps_its_own_colours():
    """Components call different colours 'white' or 'black'."""
    whole = wbc_suite.load_robot(
        "Panda", gripper="XArm7Gripper", base="OmronMobileBase"
    )
    for name in ("arm/panda", "gripper/xarm7_gripper", "base/omron_mobile_base"):
        part = wbc_suite.load_robot(name)
        for link in part.links:
            shapes = zip(link.visual, whole.link(link.name).visual, strict=True)
            for own, mounted in shapes:
                assert colour(part, own) == colour(whole, mounted)


def colour(robot, shape):
    return robot.materials.get(shape.color, shape.color)


def test_a_gripper_can_be_a_file(tmp_path, monkeypatch):
    own = CATALOGUE / "gripper" / "panda_gripper.toml"
    (tmp_path / "mine.toml").write_text(own.read_text())
    monkeypatch.chdir(tmp_path)
    robot = wbc_suite.load_robot("Panda", gripper="mine.toml")
    same = wbc_suite.load_robot("Panda", gripper=str(tmp_path / "mine.toml"))
    assert robot == same
    assert robot.joint_names == wbc_suite.load_robot("Panda").joint_names
    with pytest.raises(ConfigError, match=r"nowhere\.toml: cannot be read"):
        wbc_suite.load_robot("Panda", gripper="nowhere.toml")


def test_without_a_gripper_the_tool_point_is_at_the_flange():
    robot = wbc_suite.load_robot("GR1", gripper={"right": "none"})
    whole = wbc_suite.load_robot("GR1")
    assert set(whole.groups) - set(robot.groups) == {"right_gripper"}
    flange, hand = robot.frame("right_tcp"), whole.link("R_hand_flange")
    assert (flange.role, flange.link) == ("tcp", hand.parent)
    assert (flange.pos, flange.quat) == (hand.pos, hand.quat)
