"""How devices find what an action moves: by what controllers say, not by labels."""

import numpy as np
import pinocchio as pin
import pytest

import wbc_suite
from wbc_suite.devices.action_ports import (
    LimbKind,
    joint_ports,
    limb_ports,
    speed_ports,
)


@pytest.fixture
def make():
    envs = []

    def build(robot, controller):
        env = wbc_suite.make("Lift", robots=robot, controller_configs=controller)
        env.reset(seed=0)
        envs.append(env)
        return env

    yield build
    for env in envs:
        env.close()


def basic(**parts):
    return {"format": 1, "type": "BASIC", "body_parts": parts}


@pytest.mark.parametrize(
    ("kind", "limb"),
    [("OSC_POSE", LimbKind.POSE), ("OSC_POSITION", LimbKind.POSITION)],
)
@pytest.mark.parametrize("settings", [{}, {"output_max": 0.08, "output_min": -0.02}])
def test_an_encoded_target_is_the_goal_after_the_action(make, kind, limb, settings):
    """Also where steps are scaled by an offset, so that zero is no step of zero."""
    part = {"type": kind, "goal_update_mode": "desired"} | settings
    env = make("Panda", basic(right=part))
    port = limb_ports(env)["right"]
    assert port.kind is limb
    target = port.measure()
    target.translation += np.array([0.01, 0.02, -0.01])
    values = port.encode(target)
    decoded = port.decode(values).translation
    np.testing.assert_allclose(decoded, target.translation, atol=1e-9)
    env.step(env.action_layout.pack({"right": values}, base=env.hold_action))
    arm = env.controllers[0].parts["right"]
    goal = env.simulation.robots[0].root_pose * arm.goal
    np.testing.assert_allclose(goal.translation, target.translation, atol=1e-9)


@pytest.mark.parametrize(
    ("robot", "controller"),
    [
        ("Panda", "BASIC"),
        ("Panda", basic(right={"type": "OSC_POSE", "input_type": "absolute"})),
        ("Panda", "WHOLE_BODY_IK"),
        ("GR1FreeBody", "WHOLE_BODY_ID"),
    ],
)
def test_decoded_values_are_the_target_that_was_encoded(make, robot, controller):
    env = make(robot, controller)
    for port in limb_ports(env).values():
        if port.kind is not LimbKind.POSE:
            continue
        target = port.measure() * pin.exp6(np.array([0.01, 0, -0.02, 0.1, -0.2, 0.1]))
        found = port.decode(port.encode(target))
        np.testing.assert_allclose(found.homogeneous, target.homogeneous, atol=1e-9)


def test_ik_parts_and_joints_have_no_limb(make):
    env = make("Panda", basic(right={"type": "JOINT_POSITION"}))
    assert limb_ports(env) == {}


@pytest.mark.parametrize("settings", [{}, {"input_type": "absolute"}])
def test_joint_ports_follow_steps_and_positions(make, settings):
    env = make("Panda", basic(right={"type": "JOINT_POSITION"} | settings))
    port = joint_ports(env)["right"]
    target = port.measure() + 0.02
    for _ in range(20):
        values = port.encode(target)
        env.step(env.action_layout.pack({"right": values}, base=env.hold_action))
    np.testing.assert_allclose(port.measure(), target, atol=2e-3)


@pytest.mark.parametrize(
    ("robot", "axes"), [("PandaOmron", (0, 1, 2)), ("Tiago", (0, 1, 2))]
)
def test_speed_ports_scale_velocities_of_the_base(make, robot, axes):
    env = make(robot, "BASIC")
    ports = speed_ports(env)
    assert [*ports] == ["base"]
    assert ports["base"].axes == axes
    root = env.simulation.robots[0].robot.root
    values = ports["base"].encode(np.array([0.1, 0.0, 0.2]))
    linear, angular = root.velocity
    np.testing.assert_allclose(values, [0.1 / linear, 0.0, 0.2 / angular])


def test_a_mode_or_a_planar_frame_is_no_speed_port(make):
    env = make("PandaOmron", "HYBRID_MOBILE_BASE")
    assert "base_mode" in env.action_layout
    assert [*speed_ports(env)] == ["base"]


def test_a_pose_stays_a_rotation_through_a_port(make):
    env = make("Panda", "OSC_POSE")
    R = limb_ports(env)["right"].measure().rotation
    np.testing.assert_allclose(pin.log3(R.T @ R), 0.0, atol=1e-9)
