"""A component that extends another: the tables that it gives replace the other's."""

import pytest

from wbc_suite.catalogue import Catalogue
from wbc_suite.errors import ConfigError
from wbc_suite.robot import load_robot
from wbc_suite.robot.robot_file import read_robot_file

BASE = """
format = 1
[component]
name = "jaw"
kind = "gripper"
source = "a data sheet"
[[link]]
name = "palm"
[[link]]
name = "finger"
parent = "palm"
mass = 0.1
inertia = [1e-4, 1e-4, 1e-4, 0, 0, 0]
joint = { name = "slide", type = "slide", range = [0, 1], effort = 1 }
[groups]
gripper = ["slide"]
[[synergy]]
name = "grasp"
open = { slide = 1 }
closed = { slide = 0 }
"""

CHANGED = """
format = 1
[component]
name = "half_jaw"
kind = "gripper"
extends = "jaw"
[[synergy]]
name = "half"
open = { slide = 0.5 }
closed = { slide = 0 }
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "jaw.toml").write_text(BASE)
    (tmp_path / "half_jaw.toml").write_text(CHANGED)
    return tmp_path


def test_tables_given_replace_and_the_others_stay(folder):
    base = read_robot_file(folder / "jaw.toml")
    changed = read_robot_file(folder / "half_jaw.toml")
    assert changed.links == base.links
    assert changed.groups == base.groups
    assert [s.name for s in changed.synergies] == ["half"]
    assert changed.component.name == "half_jaw"
    assert changed.component.source == "a data sheet"


def test_the_error_of_an_unknown_component_names_the_nearest(folder):
    path = folder / "half_jaw.toml"
    path.write_text(CHANGED.replace('extends = "jaw"', 'extends = "yaw"'))
    with pytest.raises(ConfigError, match=r"extends' \(line 6\) = 'yaw'.* mean 'jaw'"):
        read_robot_file(path)


def test_an_extension_can_be_extended(folder):
    path = folder / "third.toml"
    changed = CHANGED.replace('"half"', '"quarter"').replace('"half_jaw"', '"third"')
    path.write_text(changed.replace('extends = "jaw"', 'extends = "half_jaw"'))
    third = read_robot_file(path)
    assert third.links == read_robot_file(folder / "jaw.toml").links
    assert [s.name for s in third.synergies] == ["quarter"]
    assert third.component.extends == "jaw", "the skins of links are listed under it"


def test_a_file_cannot_extend_itself_or_leave_its_folder(folder):
    path = folder / "half_jaw.toml"
    for name, fault in (("half_jaw", "loop"), ("../jaw", "No component to extend")):
        path.write_text(CHANGED.replace('extends = "jaw"', f'extends = "{name}"'))
        with pytest.raises(ConfigError, match=fault):
            read_robot_file(path)


def test_a_component_extends_one_of_the_catalogue(tmp_path):
    (tmp_path / "gripper").mkdir()
    path = tmp_path / "gripper" / "mine.toml"
    path.write_text(
        'format = 1\n[component]\nname = "Mine"\nextends = "PandaGripper"\n'
        "[materials]\nmine = [1, 0, 0, 1]\n"
    )
    mine = read_robot_file(path)
    ours = read_robot_file(Catalogue().root / "robots/gripper/panda_gripper.toml")
    assert mine.links == ours.links
    assert mine.materials == ours.materials | {"mine": (1, 0, 0, 1)}


def test_an_assembly_extends_one_of_the_catalogue_and_keeps_its_tables(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        'format = 1\n[assembly]\nname = "Mine"\nextends = "gr1"\n'
        "[keyframe.ready]\nright_elbow_pitch_joint = -1.0\n"
    )
    mine, ours = load_robot(path), load_robot("GR1")
    assert mine.links == ours.links
    assert (mine.name, mine.title) == ("Mine", ours.title)
    changed = {"right_elbow_pitch_joint": -1.0}
    assert mine.keyframe("ready") == ours.keyframe("ready") | changed


def test_a_file_beside_it_comes_before_one_of_the_catalogue(tmp_path):
    (tmp_path / "panda.toml").write_text(
        'format = 1\n[assembly]\nname = "Base"\nextends = "panda"\ntitle = "first"\n'
    )
    path = tmp_path / "mine.toml"
    path.write_text('format = 1\n[assembly]\nname = "Mine"\nextends = "panda"\n')
    assert load_robot(path).title == "first"
    assert load_robot(path).links == load_robot("Panda").links
