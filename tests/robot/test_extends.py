"""A component that extends another: the tables that it gives replace the other's."""

import pytest

from wbc_suite.errors import ConfigError, UnknownNameError
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
    with pytest.raises(UnknownNameError, match="Did you mean 'jaw'"):
        read_robot_file(path)


def test_extensions_do_not_chain(folder):
    path = folder / "third.toml"
    path.write_text(CHANGED.replace('extends = "jaw"', 'extends = "half_jaw"'))
    with pytest.raises(ConfigError, match="extend 'jaw'"):
        read_robot_file(path)


def test_a_file_cannot_extend_itself_or_leave_its_folder(folder):
    path = folder / "half_jaw.toml"
    for name in ("half_jaw", "../jaw"):
        path.write_text(CHANGED.replace('extends = "jaw"', f'extends = "{name}"'))
        with pytest.raises(UnknownNameError, match="component to extend"):
            read_robot_file(path)
