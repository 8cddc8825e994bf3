"""Limits of robots without a controller file: links kept apart, weak motors."""

import mujoco
import numpy as np
import pytest

from wbc_suite.control import load_composite_controller_config
from wbc_suite.control.ik.config import read_whole_body
from wbc_suite.control.ik.qp_of_config import distance_limits
from wbc_suite.envs.hold_check import alone
from wbc_suite.errors import ConfigError
from wbc_suite.robot import load_robot

CUBE = """<mujoco><worldbody><body name="base"><geom type="box" size=".1 .1 .1"/>
  <body name="arm"><joint name="turn" axis="1 0 0" range="-.1 .1" limited="true"/>
  <inertial pos="0 0 0" mass="1" diaginertia=".01 .01 .01"/>
  <body name="ball"><joint name="slide" type="slide" axis="1 0 0" range="{low} {high}"
  limited="true"/><geom size=".02" mass="1"/></body></body></body></worldbody>
  <keyframe><key name="ready" qpos="0 .28"/></keyframe></mujoco>"""
PENDULUM = """<robot name="p"><link name="base"/><link name="rod"><inertial>
  <origin xyz="0 0 -1"/><mass value="2"/>
  <inertia ixx=".01" ixy="0" ixz="0" iyy=".01" iyz="0" izz=".01"/></inertial></link>
  <joint name="hinge" type="revolute"><parent link="base"/><child link="rod"/>
  <origin xyz="0 0 1.5"/><axis xyz="0 1 0"/>
  <limit lower="-1.7" upper="0.5" effort="{effort}" velocity="2"/></joint></robot>"""
WEIGHT = 2.0 * 9.81  # N m, of the rod that lies level


def config_of(robot):
    config = load_composite_controller_config("WHOLE_BODY_IK", robot)
    return read_whole_body(config, robot, robot.name)


@pytest.mark.parametrize(("low", "high", "kept"), [(0.125, 0.3, 0), (0.08, 0.34, 1)])
def test_controllers_and_the_simulator_leave_out_the_same_capsules(
    tmp_path, low, high, kept
):
    # The cube's capsule has a radius of 0.141 m, 0.041 m more than its side. On its way
    # from 0.125 m on the ball hardly comes nearer than 1 cm to the cube, and is in its
    # capsule for a fifth of the way; from 0.08 m on it is nearly as often in both.
    path = tmp_path / "cube.xml"
    path.write_text(CUBE.format(low=low, high=high))
    robot = load_robot(path)
    limits = distance_limits(robot, config_of(robot))
    assert sum(limit.pair_count for limit in limits) == kept
    m = robot.to_mjspec().compile()
    data = mujoco.MjData(m)
    data.joint("slide").qpos[0] = 0.11  # in the cube
    mujoco.mj_forward(m, data)
    assert data.ncon == kept


def test_weak_motors_are_asked_for_postures_that_they_can_hold(tmp_path):
    path = tmp_path / "pendulum.urdf"
    path.write_text(PENDULUM.format(effort=0.5 * WEIGHT))
    robot = load_robot(path)
    config = load_composite_controller_config("WHOLE_BODY_IK", robot)
    assert config["limits"]["weight_shares"] == {"hinge": 0.9}
    env = alone(robot, controller_configs=config)
    env.reset(seed=0)
    name = config["frame"][0]["name"]
    goal = np.array([0.0, 0.0, 1.5, 0.0, -np.pi / 2, 0.0])  # level
    action = env.action_layout.pack({name: goal}, base=env.hold_action)
    most = 0.0
    for _ in range(60):
        env.step(action)
        most = max(most, abs(float(env.simulation.data.qfrc_actuator[0])))
    assert most < 0.95 * 0.5 * WEIGHT  # it brakes with what its weight leaves
    q = float(env.simulation.data.joint("robot0_hinge").qpos[0])
    assert np.sin(-q) == pytest.approx(0.45, rel=0.02)  # of the torque when level


def test_strong_motors_have_no_limit_of_weight(tmp_path):
    path = tmp_path / "pendulum.urdf"
    path.write_text(PENDULUM.format(effort=1.1 * WEIGHT))
    assert config_of(load_robot(path)).limits.weight_shares == {}


@pytest.mark.parametrize(
    ("kind", "robot", "changes", "key"),
    [
        (
            "WHOLE_BODY_IK",
            "Panda",
            {"limits": {"positions": {"panda_joint1": (2.0, -2.0)}}},
            r"limits\.positions\.panda_joint1",
        ),
        ("WHOLE_BODY_ID", "GR1FreeBody", {"height": (0.02, -0.15)}, "height"),
    ],
)
def test_a_range_that_ends_before_it_begins_is_refused(kind, robot, changes, key):
    config = load_composite_controller_config(kind, robot) | changes
    with pytest.raises(ConfigError, match=f"key '{key}' = .*lower end must come first"):
        load_composite_controller_config(config, robot)
