"""Grippers and bases that the caller chooses: sides, roots, heights."""

import pytest

import wbc_suite
from wbc_suite.errors import DescriptionError, UnknownNameError


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


def test_robot_on_its_own_legs_takes_only_a_root():
    own = wbc_suite.load_robot("GR1")
    planar = wbc_suite.load_robot("GR1", base="FloatingLeggedBase")
    assert planar.root.kind == "planar"
    assert planar.root.pos == own.root.pos
    assert planar.links == own.links
    with pytest.raises(DescriptionError, match=r"GR1 stands on its own .* null_mount"):
        wbc_suite.load_robot("GR1", base="RethinkMount")


def test_left_hand_does_not_fit_a_right_arm():
    with pytest.raises(DescriptionError, match="there fit: .*fourier_right_hand"):
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


def test_unknown_gripper_or_base_is_told_with_the_nearest():
    with pytest.raises(UnknownNameError, match="Did you mean 'panda_gripper'"):
        wbc_suite.load_robot("Panda", gripper="PandaGriper")
    with pytest.raises(UnknownNameError, match="Did you mean 'null_mount'"):
        wbc_suite.load_robot("Panda", base="NulMount")
