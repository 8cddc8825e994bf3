"""Sides in names: a letter is one only where the same name has the other letter."""

import pytest

from wbc_suite.robot import load_robot
from wbc_suite.robot.adopt.name_words import side_of, words_in, words_of


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("LHipYaw", ["l", "hip", "yaw"]),
        ("leftarm_1", ["left", "arm"]),
        ("LARM", ["l", "arm"]),
        ("r2_left_arm", ["r", "left", "arm"]),
        ("l6", ["l"]),
    ],
)
def test_a_name_has_words(name, words):
    assert words_of(name) == words


@pytest.mark.parametrize(
    ("names", "sides"),
    [
        ("l1 l2 l3", "- - -"),
        ("l_wrist r_wrist", "left right"),
        ("LHip RHip", "left right"),
        ("LARM rarm", "left right"),
        ("arm_1_l arm_1_r arm_2_l", "left right -"),
        ("left_arm l_hand", "left -"),
        ("r1 r2 left_1", "- - left"),
        ("fl_hip", "-"),  # a leg's, see `pairs`
    ],
)
def test_a_letter_is_a_side_beside_its_opposite(names, sides):
    found = [
        side_of(words, pairs=False) or "-" for words in words_in(names.split()).values()
    ]
    assert found == sides.split()


def chain(names, side=""):
    """Return links and joints of a chain of these names below the base."""
    text, above = "", "base"
    for name in names:
        text += (
            f'<link name="{side}{name}"><inertial><mass value="1"/><inertia ixx="0.1" '
            'iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
            f'<joint name="{side}j{name}" type="revolute"><parent link="{above}"/>'
            f'<child link="{side}{name}"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/>'
            '<limit lower="-1" upper="1" effort="50" velocity="1"/></joint>'
        )
        above = f"{side}{name}"
    return text


NUMBERS = [str(k) for k in range(1, 7)]


@pytest.mark.parametrize(
    ("text", "groups"),
    [
        (chain(NUMBERS, "l"), {"right_arm"}),
        (chain(NUMBERS, "r"), {"right_arm"}),
        (chain(NUMBERS, "l") + chain(NUMBERS, "r"), {"left_arm", "right_arm"}),
        (chain(NUMBERS, "l") + chain(NUMBERS, "m"), {"arm_1", "arm_2"}),
    ],
)
def test_an_arm_of_numbered_links_has_a_side_beside_another(text, groups, tmp_path):
    path = tmp_path / "x.urdf"
    path.write_text(f'<robot name="x"><link name="base"/>{text}</robot>')
    assert set(load_robot(path).groups) == groups
