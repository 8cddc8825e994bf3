"""Hands of arms with less than six joints: position first, by every controller."""

import numpy as np
import pytest

from tests.robot.test_arms import arm_file
from wbc_suite.control import load_composite_controller_config
from wbc_suite.control.ik.config import read_whole_body
from wbc_suite.envs.hold_check import alone
from wbc_suite.robot import load_robot
from wbc_suite.robot.arms import FEW_JOINTS


def test_hands_of_few_joints_get_a_small_cost_unless_a_file_states_one(tmp_path):
    few = load_robot(arm_file(tmp_path, 5))
    many = load_robot(arm_file(tmp_path, 6))
    for robot, wanted in ((few, FEW_JOINTS), (many, 1.0)):
        config = load_composite_controller_config("WHOLE_BODY_IK", robot)
        (frame,) = read_whole_body(config, robot, "test").frames
        assert frame.orientation_cost == wanted
        config["frame"][0]["orientation_cost"] = 0.7
        (frame,) = read_whole_body(config, robot, "test").frames
        assert frame.orientation_cost == 0.7


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["WHOLE_BODY_IK", "IK_POSE", "OSC_POSE"])
def test_a_hand_of_few_joints_reaches_a_place_that_its_turn_does_not_allow(
    tmp_path, kind
):
    """A step to the side keeps the goal's orientation, which four joints cannot."""
    robot = load_robot(arm_file(tmp_path, 4))
    ((side, hand),) = robot.hands.items()
    if kind == "WHOLE_BODY_IK":
        config = load_composite_controller_config(kind, robot)
        name = config["frame"][0]["name"]
    else:
        own = {"type": kind, "input_type": "absolute", "input_ref_frame": "world"}
        config = {"format": 1, "type": "BASIC", "body_parts": {side: own}}
        name = side
    env = alone(robot, controller_configs=config, control_freq=50)
    env.reset(seed=0)
    layout = env.action_layout
    goal = layout.unpack(env.hold_action)[name].copy()
    goal[1] += 0.08
    action = layout.pack({name: goal}, base=env.hold_action)
    for _ in range(150):
        *_, info = env.step(action)
    place = env.simulation.data.site(f"robot0_{hand}").xpos
    assert np.linalg.norm(place - goal[:3]) < 0.004
    if kind == "WHOLE_BODY_IK":
        report = info["ik"]["frames"][name]
        assert report["orientation_error"] > 0.1
        assert "too few joints" in str(report["reasons"][0])
    env.close()
