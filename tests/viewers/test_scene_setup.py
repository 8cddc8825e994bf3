from wbc_suite.viewers.scene_setup import css, limb_colours

NAMES = ["right_hand", "left_hand", "right_foot", "left_foot", "head", "torso", "base"]


def test_no_two_limbs_share_a_colour():
    colours = limb_colours([*NAMES, "tail", "right_wing", "hand", "com"])
    assert len(set(colours.values())) == len(colours)


def test_a_limb_keeps_its_colour_whoever_stands_before_it():
    assert limb_colours(NAMES)["left_hand"] == limb_colours(["left_hand"])["left_hand"]


def test_colours_are_written_as_css():
    assert css((1, 160, 255)) == "#01a0ff"
