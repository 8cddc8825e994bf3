"""Robots stand where the files of benchmarks say."""

import numpy as np
import pytest

import wbc_suite
from wbc_suite.benchmark.arrangement import arrange_one, arrange_two_arms
from wbc_suite.benchmark.two_arm_handover import TwoArmHandoverConfig
from wbc_suite.benchmark.two_arm_lift import TwoArmLiftConfig
from wbc_suite.benchmark.two_arm_peg_in_hole import TwoArmPegInHoleConfig
from wbc_suite.benchmark.two_arm_transport import TwoArmTransportConfig
from wbc_suite.catalogue import Catalogue
from wbc_suite.config_files import parse_model, read_toml
from wbc_suite.errors import ConfigError

PLACES = {"default": (-0.5, 0.1), "UR5e": (-0.7, 0.0)}


CONFIGS = {
    TwoArmHandoverConfig: "two_arm_handover",
    TwoArmLiftConfig: "two_arm_lift",
    TwoArmPegInHoleConfig: "two_arm_peg_in_hole",
    TwoArmTransportConfig: "two_arm_transport",
}


def given(model):
    """Return what the shipped file of a config holds."""
    return read_toml(Catalogue().find("tasks", CONFIGS[model], kind="benchmark file"))


class Config:
    name = "Mine"
    places = PLACES
    opposed = {"default": 0.6, "UR5e": 0.8}
    apart = 0.25


def place_of(robot):
    """Return x y and yaw of a robot's root."""
    w, x, y, z = robot.root.quat
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return (*np.round(robot.root.pos[:2], 9), round(float(yaw), 9))


@pytest.fixture(scope="module")
def robots():
    bare = {"base": "none"}
    return {
        name: wbc_suite.load_robot(name, **(bare if name in ("Panda", "UR5e") else {}))
        for name in ("Panda", "UR5e", "Baxter")
    }


def test_one_robot_stands_at_its_own_place_or_the_default(robots):
    for name, place in (("Panda", (-0.5, 0.1, 0.0)), ("UR5e", (-0.7, 0.0, 0.0))):
        (robot,) = arrange_one("Mine", [robots[name]], "default", PLACES)
        assert place_of(robot) == place


@pytest.mark.parametrize(
    ("count", "configuration", "message"),
    [(2, "default", "takes one robot"), (1, "opposed", "'opposed' is not for one")],
)
def test_one_place_is_for_one_robot(robots, count, configuration, message):
    with pytest.raises(ConfigError, match=message):
        arrange_one("Mine", [robots["Panda"]] * count, configuration, PLACES)


def test_opposed_robots_face_one_another(robots):
    pair = [robots["Panda"], robots["UR5e"]]
    for configuration in ("default", "opposed"):
        first, second = arrange_two_arms(Config, pair, configuration)
        assert place_of(first) == (0.0, -0.6, round(np.pi / 2, 9))
        assert place_of(second) == (0.0, 0.8, round(-np.pi / 2, 9))


def test_parallel_robots_stand_apart_and_face_the_same_way(robots):
    pair = [robots["Panda"], robots["UR5e"]]
    first, second = arrange_two_arms(Config, pair, "parallel")
    assert place_of(first) == (-0.5, round(0.1 - 0.25, 9), 0.0)
    assert place_of(second) == (-0.7, 0.25, 0.0)


def test_one_robot_with_two_arms_stands_at_its_place(robots):
    for configuration in ("default", "single-robot"):
        (robot,) = arrange_two_arms(Config, [robots["Baxter"]], configuration)
        assert place_of(robot)[2] == 0.0


@pytest.mark.parametrize(
    ("names", "configuration", "message"),
    [
        (["Panda"], "default", "needs two arms"),
        (["Panda", "Baxter"], "default", "needs two arms"),
        (["Panda"] * 3, "default", "needs two arms"),
        (["Panda", "Panda"], "single-robot", "'single-robot' is not for 2"),
        (["Baxter"], "opposed", "'opposed' is not for 1"),
    ],
)
def test_what_has_not_two_arms_is_refused(robots, names, configuration, message):
    with pytest.raises(ConfigError, match=message):
        arrange_two_arms(Config, [robots[n] for n in names], configuration)


@pytest.mark.parametrize("key", ["opposed", "places"])
@pytest.mark.parametrize("model", CONFIGS)
def test_files_need_a_default_place(model, key):
    data = given(model)
    data[key] = {"UR5e": data[key]["default"]}
    with pytest.raises(ConfigError, match="an entry named 'default' is needed"):
        parse_model(model, data, source="mine.toml")


@pytest.mark.parametrize("key", ["opposed", "apart", "places"])
@pytest.mark.parametrize("model", CONFIGS)
def test_two_arm_files_say_where_robots_stand(model, key):
    data = given(model)
    del data[key]
    with pytest.raises(ConfigError, match=f"mine.toml: missing key '{key}'"):
        parse_model(model, data, source="mine.toml")
