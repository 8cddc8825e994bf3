"""A robot written as one component file is the same robot when read again."""

from pathlib import Path

import pytest

import wbc_suite
from wbc_suite.catalogue import Catalogue
from wbc_suite.config_files import read_toml
from wbc_suite.errors import ConfigError
from wbc_suite.robot.description import RobotDescription


def again(robot: RobotDescription, folder: Path) -> RobotDescription:
    path = folder / "copy.toml"
    path.write_text(robot.to_toml(), encoding="utf-8")
    return wbc_suite.load_robot(path)


@pytest.mark.parametrize("name", Catalogue().names("robots"))
def test_every_robot_comes_back_bit_by_bit(name, tmp_path):
    robot = wbc_suite.load_robot(name)
    assert again(robot, tmp_path) == robot


def test_strings_of_any_kind_survive(tmp_path):
    robot = wbc_suite.load_robot("panda")
    title = 'a "quoted" \\ back\tslash, ünïcode, \x01\x7f and\nlines'
    robot = robot.model_copy(update={"title": title, "deviations": (title, "")})
    assert again(robot, tmp_path) == robot


def test_what_equals_a_default_is_left_out(tmp_path):
    robot = wbc_suite.load_robot("panda", root="fixed")
    again(robot, tmp_path)
    data = read_toml(tmp_path / "copy.toml")
    link = next(x for x in data["link"] if x["name"] == "panda_link1")
    assert "frictionloss" not in link["joint"]
    assert "quat" not in link
    turned = next(x for x in data["link"] if x["name"] == "panda_link2")
    assert len(turned["quat"]) == 4
    assert list(link)[:2] == ["name", "parent"]


def test_an_edited_copy_is_checked_like_any_file(tmp_path):
    text = wbc_suite.load_robot("panda").to_toml()
    path = tmp_path / "copy.toml"
    path.write_text(text.replace("effort = 87", "efort = 87"))
    with pytest.raises(ConfigError, match=r"joint\.efort'.*Did you mean 'effort'"):
        wbc_suite.load_robot(path)
