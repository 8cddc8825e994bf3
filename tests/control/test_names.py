"""Names that editors complete are those of the registries and of the catalogue."""

from typing import get_args

import pytest

from wbc_suite.catalogue import Catalogue
from wbc_suite.control import (
    load_composite_controller_config,
    register_config_converter,
)
from wbc_suite.control.composite.registry import (
    COMPOSITES,
    CONVERTERS,
    CompositeControllerName,
)
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.typing import RobotName


def test_composite_names_are_those_registered_by_the_package():
    assert {*get_args(CompositeControllerName)} <= {*COMPOSITES}


def test_robot_names_are_those_of_the_catalogue():
    assert get_args(RobotName) == Catalogue().called("robots")


@pytest.mark.parametrize("name", get_args(CompositeControllerName))
def test_each_composite_has_a_config_for_a_mobile_arm(name):
    config = load_composite_controller_config(name, "PandaOmron")
    assert config["type"] == name


def test_the_name_of_a_part_controller_stands_for_all_arms():
    parts = load_composite_controller_config("joint_position", "GR1")["body_parts"]
    assert parts["right"] == parts["left"] == {"type": "JOINT_POSITION"}
    assert parts["head"]["type"] == "JOINT_POSITION"
    with pytest.raises(ConfigError, match="name the robot"):
        load_composite_controller_config("OSC_POSE")
    with pytest.raises(UnknownNameError, match="Did you mean 'OSC_POSE'"):
        load_composite_controller_config("OSC_POS", "GR1")


@pytest.fixture
def soft(tmp_path):
    path = tmp_path / "soft.toml"
    path.write_text('extends = "BASIC"\n[body_parts.right]\nkp = 99\n')
    return path


def test_a_controller_file_extends_what_the_robot_has(soft):
    for robot in ("Panda", "Tiago"):  # without a file, and with one
        plain = load_composite_controller_config("BASIC", robot)
        found = load_composite_controller_config(soft, robot)
        right = {"right": plain["body_parts"]["right"] | {"kp": 99}}
        assert found == plain | {"body_parts": plain["body_parts"] | right}


def test_a_controller_file_extends_one_beside_it_or_of_the_catalogue(soft):
    stiff = soft.with_name("stiff.toml")
    stiff.write_text('extends = "soft"\n[body_parts.right]\ndamping_ratio = 2.0\n')
    found = load_composite_controller_config(stiff, "Panda")
    assert (found["type"], found["body_parts"]["right"]["kp"]) == ("BASIC", 99)
    assert found["body_parts"]["right"]["damping_ratio"] == 2.0
    free = soft.with_name("free.toml")
    free.write_text('extends = "gr1_whole_body_ik"\n[posture]\nspeed = 0.5\n')
    ours = load_composite_controller_config("WHOLE_BODY_IK", "GR1")
    found = load_composite_controller_config(free, "GR1")
    posture = ours.get("posture", {}) | {"speed": 0.5}
    assert found == ours | {"posture": posture}


def test_a_part_of_another_type_replaces_that_of_the_base(soft):
    soft.write_text('extends = "basic"\n[body_parts.right]\ntype = "joint_velocity"\n')
    found = load_composite_controller_config(soft, "PandaOmron")
    assert found["body_parts"]["right"] == {"type": "joint_velocity"}


def test_a_base_that_does_not_exist_is_named_with_its_line(soft):
    soft.write_text('format = 1\nextends = "BASICC"\n')
    with pytest.raises(ConfigError, match=r"soft.toml: key 'extends' \(line 2\)"):
        load_composite_controller_config(soft, "Panda")


def convert(config, robot, source, named):
    """Read `{"arms": type}`, another layout."""
    if "arms" not in config:
        return None
    ours = named("BASIC")
    return ours | {"body_parts": {"right": {"type": config["arms"]}}}


def test_another_layout_is_read_by_its_converter(forget):
    config = {"type": "BASIC", "arms": "JOINT_TORQUE"}
    with pytest.raises(ConfigError, match="body_parts"):
        load_composite_controller_config(config, "Panda")
    forget(CONVERTERS, "arms")
    register_config_converter("arms", "test_names:convert")
    found = load_composite_controller_config(config, "Panda")
    plain = load_composite_controller_config("BASIC", "Panda")
    assert found["body_parts"] == {"right": {"type": "JOINT_TORQUE"}}
    assert plain["body_parts"]["right"]["type"] == "OSC_POSE"


CONTROLLERS = {
    ("kp = 400", "kpp = 400"): (r"'body_parts.torso.kpp' \(line 13\)", "'kp'"),
    ('"OSC_POSE"', '"OSC_POS"'): (r"'body_parts.right.type' \(line 6\)", "'OSC_POSE'"),
    ('"BASIC"', '"BASICC"'): (r"'type' \(line 3\)", "'BASIC'"),
    ("format = 1", "formt = 1"): (r"'formt' \(line 2\)", "'format'"),
    ("parts.torso", "parts.torsoo"): (r"'body_parts.torsoo' \(line 9\)", "'torso'"),
}


@pytest.mark.parametrize(("typing", "told"), CONTROLLERS.items())
def test_a_typing_error_in_a_controller_has_its_line_and_the_nearest_name(
    typing, told, tmp_path
):
    text = Catalogue().find("controllers", "pandaomron_basic", kind="c").read_text()
    file = tmp_path / "mine.toml"
    file.write_text(text.replace(*typing, 1))
    line, nearest = told
    with pytest.raises(ConfigError, match=f"{line}.*Did you mean {nearest}"):
        load_composite_controller_config(file, "PandaOmron")


def test_a_typing_error_in_a_frame_has_its_line(tmp_path):
    text = Catalogue().find("controllers", "gr1_whole_body_ik", kind="c").read_text()
    file = tmp_path / "mine.toml"
    file.write_text(text.replace('"right_tcp"', '"right_tpc"'))
    with pytest.raises(ConfigError, match=r"'frame\[0\].frame' \(line 7\): GR1: No "):
        load_composite_controller_config(file, "GR1")
