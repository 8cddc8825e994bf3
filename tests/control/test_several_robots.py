"""Several robots in one scene, also of one kind, each under its own controller."""

import mujoco
import numpy as np
import pytest

import wbc_suite
from wbc_suite.control import (
    RobotState,
    build_composite_controller,
    load_composite_controller_config,
)
from wbc_suite.envs import Simulation
from wbc_suite.scene import attach_robot, empty_arena, place_robot, robot_prefix

PLACES = (((-0.8, 0.0), 0.0), ((0.8, 0.0), np.pi), ((0.0, 3.0), 0.5))
CHANGES = ([0.05, 0.1, -0.1], [-0.1, -0.05, 0.05], [0.3, 0.1, 0.35])


def robots(names):
    loaded = (wbc_suite.load_robot(name) for name in names)
    return [place_robot(r, *p) for r, p in zip(loaded, PLACES, strict=False)]


def simulate(robots, seconds=3.0):
    """Put robots at `ready`, move each hand, and return states and reports."""
    spec = empty_arena()
    for i, robot in enumerate(robots):
        attach_robot(spec, robot, robot_prefix(i))
    model = spec.compile()
    data = mujoco.MjData(model)
    states = [
        RobotState(model, data, robot, prefix=robot_prefix(i))
        for i, robot in enumerate(robots)
    ]
    for state in states:
        posture = state.robot.keyframe("ready")
        data.qpos[state.joint_addresses(tuple(posture))[0]] = list(posture.values())
    mujoco.mj_forward(model, data)
    pairs = [
        (state, build_composite_controller(config, state))
        for state in states
        for config in [load_composite_controller_config("WHOLE_BODY_IK", state.robot)]
    ]
    for (_, controller), change in zip(pairs, CHANGES, strict=False):
        action = controller.hold_action
        start = controller.layout["right_hand"].start
        action[start : start + 3] += change
        controller.set_goal(action)
    simulation = Simulation(model, data, pairs)
    simulation.tick(round(seconds / simulation.timestep))
    reports = [c.info(s)["ik"]["frames"]["right_hand"] for s, c in pairs]
    return states, reports


def joints(state):
    q, _ = state.joint_addresses(state.robot.joint_names)
    return state.data.qpos[q]


@pytest.mark.slow
def test_two_pandas_and_a_third_on_wheels_reach_their_own_targets():
    states, reports = simulate(robots(["Panda", "Panda", "PandaOmron"]))
    assert [state.prefix for state in states] == ["robot0_", "robot1_", "robot2_"]
    for report in reports:
        assert report["reached"], report
        assert report["position_error"] < 1e-3
    lift = states[2].data.joint("robot2_joint_torso_height").qpos[0]
    assert lift > 0.25  # from 0.17: the target is 0.35 m up


@pytest.mark.slow
def test_a_robot_moves_as_if_it_were_alone():
    first, second = robots(["Panda", "Panda"])
    together, _ = simulate([first, second], seconds=1.0)
    alone, _ = simulate([first], seconds=1.0)
    np.testing.assert_allclose(joints(together[0]), joints(alone[0]), atol=1e-9)
    assert np.abs(joints(together[0]) - joints(together[1])).max() > 0.05


def test_names_of_two_of_a_kind_differ_by_their_prefix_only():
    spec = empty_arena()
    for i, robot in enumerate(robots(["Panda", "Panda"])):
        attach_robot(spec, robot, robot_prefix(i))
    model = spec.compile()
    names = [model.joint(i).name for i in range(model.njnt)]
    half = len(names) // 2
    assert [n.replace("robot0_", "robot1_") for n in names[:half]] == names[half:]
    assert model.body("robot1_panda_link0").mass == pytest.approx(0.629769)
