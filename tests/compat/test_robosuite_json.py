"""Configs in the layout of this field's JSON files. All written here."""

import json
import logging

import numpy as np
import pytest

import wbc_suite
from wbc_suite.control import load_composite_controller_config
from wbc_suite.errors import ConfigError, WbcError

OSC = {
    "type": "OSC_POSE",
    "input_max": 1,
    "input_min": -1,
    "output_max": [0.04, 0.04, 0.04, 0.3, 0.3, 0.3],
    "output_min": [-0.04, -0.04, -0.04, -0.3, -0.3, -0.3],
    "kp": 120,
    "damping_ratio": 1,
    "kp_limits": [0, 300],
    "damping_ratio_limits": [0, 10],
    "position_limits": None,
    "orientation_limits": None,
    "uncouple_pos_ori": True,
    "input_type": "delta",
    "input_ref_frame": "base",
    "interpolation": "null",
    "ramp_ratio": 0.2,
}
JOINTS = {"type": "JOINT_POSITION", "output_max": 0.5, "output_min": -0.5, "kd": 60}
ARM = OSC | {"gripper": {"type": "GRIP", "use_action_scaling": True}}


def basic(**parts):
    arms = {side: parts.pop(side) for side in ("right", "left") if side in parts}
    return {
        "type": "BASIC",
        "composite_controller_specific_configs": {},
        "body_parts": {"arms": arms, **parts},
    }


WHOLE = {
    "type": "WHOLE_BODY_IK",
    "composite_controller_specific_configs": {
        "ref_name": ["gripper0_right_grip_site", "gripper0_left_grip_site"],
        "actuation_part_names": ["torso", "right", "left"],
        "nullspace_joint_weights": {"robot0_torso_waist_yaw": 100.0},
        "ik_pseudo_inverse_damping": 5e-2,
        "ik_input_type": "absolute",
        "ik_input_ref_frame": "base",
        "ik_input_rotation_repr": "axis_angle",
        "ik_solve_freq": 50,
    },
    "body_parts": {"arms": {"right": JOINTS}},
}


def test_a_json_file_makes_an_environment_and_says_what_it_leaves_out(tmp_path, caplog):
    file = tmp_path / "mine.json"
    parts = basic(right=ARM, left=ARM, torso=JOINTS, base={"type": "JOINT_VELOCITY"})
    file.write_text(json.dumps(parts))
    with caplog.at_level(logging.WARNING):
        env = wbc_suite.make("Lift", robots="Panda", controller_configs=str(file))
    [said] = [r.getMessage() for r in caplog.records if "ignored" in r.msg]
    for word in ("mine.json", "use_action_scaling", "torso"):
        assert word in said
    assert "kp," not in said
    layout = env.unwrapped.action_layout
    assert [(s.name, s.stop) for s in layout.slices] == [
        ("right", 6),
        ("right_gripper", 7),
    ]
    env.reset(seed=0)
    site = env.unwrapped.simulation.data.site("robot0_right_tcp")
    before = site.xpos.copy()
    env.step(layout.pack({"right": [1, 0, 0, 0, 0, 0]}, base=np.zeros(7)))
    for _ in range(30):
        env.step(np.zeros(7))
    np.testing.assert_allclose(site.xpos - before, [0.04, 0.0, 0.0], atol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "size"), [("GR1", 24), ("GR1FixedLowerBody", 24), ("Tiago", 17)]
)
def test_whole_body_files_give_the_action_that_this_field_knows(robot, size):
    config = load_composite_controller_config(WHOLE, robot)
    assert config["input_ref_frame"] == "base"
    assert config["solve_hz"] == 50
    assert "torso" not in config["locked"]
    assert "head" in config["locked"]
    env = wbc_suite.make("Lift", robots=robot, controller_configs=WHOLE)
    layout = env.unwrapped.action_layout
    assert layout.size == size
    assert [s.name for s in layout.slices[:2]] == ["right_hand", "left_hand"]


def test_the_config_of_one_part_is_given_to_all_arms():
    for given in (OSC, OSC | {"control_delta": True}):
        config = load_composite_controller_config(given, "Baxter")
        assert config["type"] == "BASIC"
        for side in ("right", "left"):
            assert config["body_parts"][side]["kp"] == 120
            assert config["body_parts"][side]["input_type"] == "delta"
    config = load_composite_controller_config("OSC_POSITION", "Tiago")
    assert config["body_parts"]["left"]["type"] == "OSC_POSITION"
    assert config["body_parts"]["head"]["type"] == "JOINT_POSITION"


def test_parts_have_the_order_of_the_file_or_the_one_it_names():
    given = basic(head=JOINTS)
    given["body_parts"]["arms"] = {"left": OSC, "right": OSC}
    config = load_composite_controller_config(given, "Tiago")
    assert [*config["body_parts"]] == ["left", "right", "head"]
    given["body_part_ordering"] = ["head", "right"]
    config = load_composite_controller_config(given, "Tiago")
    assert [*config["body_parts"]] == ["head", "right", "left"]


def test_legs_that_would_let_a_robot_fall_are_taken_with_a_warning(caplog):
    given = basic(right=ARM, legs=JOINTS)
    config = load_composite_controller_config(given, "SpotWithArm")
    assert config["may_fall"]
    assert "'STANCE'" in caplog.text
    given["body_parts"]["legs"] = {"type": "STANCE"}
    assert "may_fall" not in load_composite_controller_config(given, "SpotWithArm")


def changed(**values):
    return basic(right=OSC | values)


WRONG = [
    (changed(kpp=3), r"'body_parts\.arms\.right\.kpp'.*Did you mean 'kp'"),
    (changed(kp="stiff"), r"'body_parts\.right\.kp' = 'stiff'"),
    (changed(input_type="absolut"), "Did you mean 'absolute'"),
    (changed(type="OSC_PSE"), "Did you mean 'OSC_POSE'"),
    (changed(gripper={"type": "GRAP"}), "Did you mean 'GRIP'"),
    (changed(gripper=3), r"'body_parts\.arms\.right\.gripper' = 3"),
    (basic(right=OSC, trso=JOINTS), "'body_parts.trso'.*Known"),
    (basic(right=OSC) | {"body_partz": {}}, "Did you mean 'body_parts'"),
    (basic(right=OSC) | {"body_part_ordering": ["rigth"]}, "body_part_ordering"),
    (basic(right=OSC) | {"type": "BASIK"}, "Did you mean 'BASIC'"),
    ({"type": "BASIC", "body_parts": [OSC]}, "not a table"),
    ({"type": "BASIC", "body_parts": {"arms": {"right": 1}}}, r"arms\.right' = 1"),
]
for key, value, words in (
    ("ref_nme", "x", "Did you mean 'ref_name'"),
    ("ref_name", ["hand"], "No hand named 'hand'"),
    ("ref_name", 3, "not a list of names"),
    ("ik_input_rotation_repr", "quat_wxyz", "axis_angle"),
    ("ik_input_type", "absolut", "Did you mean 'absolute'"),
    ("ik_input_ref_frame", "wrld", "Did you mean 'world'"),
    ("actuation_part_names", ["torsos"], "Did you mean 'torso'"),
    ("ik_solve_freq", "fast", "'solve_hz' = 'fast'"),
):
    WRONG.append(
        (WHOLE | {"composite_controller_specific_configs": {key: value}}, words)
    )


@pytest.mark.parametrize(("given", "words"), WRONG)
def test_wrong_files_say_what_is_wrong(given, words, tmp_path):
    file = tmp_path / "mine.json"
    file.write_text(json.dumps(given))
    with pytest.raises(WbcError, match=words) as caught:
        load_composite_controller_config(file, "Tiago")
    if "type" not in words and "BASIC" not in words:
        assert "mine.json" in str(caught.value)


@pytest.mark.parametrize(
    "text", ["{", "[1]", '{"type": NaN}', "[" * 100_000, "\udcff", '"x"']
)
def test_what_is_no_json_is_refused_by_name(text, tmp_path):
    file = tmp_path / "mine.json"
    file.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(ConfigError, match=r"mine\.json"):
        load_composite_controller_config(file, "Panda")


def test_the_callers_config_is_left_alone():
    given = basic(right=ARM, left=ARM)
    before = json.dumps(given)
    load_composite_controller_config(given, "Baxter")
    assert json.dumps(given) == before
