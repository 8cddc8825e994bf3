"""BASIC on every robot of the catalogue."""

import numpy as np
import pytest

import wbc_suite
from wbc_suite.catalogue import Catalogue
from wbc_suite.control import load_composite_controller_config
from wbc_suite.control.robot_parts import hands_of, motors, parts_of
from wbc_suite.errors import ConfigError

ROBOTS = Catalogue().names("robots")


def hand_places(one):
    data, state = one.state.data, one.state
    return {
        side: data.site(state.prefix + frame).xpos.copy()
        for side, frame in one.robot.hands.items()
    }


def steps(one, count, **values):
    """Give the same action a number of times; 20 a second."""
    controller = one.controller
    for _ in range(count):
        action = controller.layout.pack(values, base=controller.hold_action)
        controller.set_goal(action)
        one.simulation.tick(25)


@pytest.mark.parametrize("name", ROBOTS)
def test_parts_and_grippers_share_out_all_motors(name):
    robot = wbc_suite.load_robot(name)
    joints = [joint for part in parts_of(robot).values() for joint in part]
    assert len(set(joints)) == len(joints)
    assert set(joints) == set(motors(robot))
    assert list(hands_of(robot)) == [x for x in ("right", "left") if x in robot.hands]


def test_parts_are_in_the_order_of_this_field():
    assert list(parts_of(wbc_suite.load_robot("Tiago"))) == [
        *("right", "left", "torso", "head", "base")
    ]
    assert list(parts_of(wbc_suite.load_robot("GR1"))) == [
        *("right", "left", "torso", "head", "legs")
    ]
    assert list(parts_of(wbc_suite.load_robot("SpotWithArm"))) == ["right", "legs"]


@pytest.mark.parametrize("name", ROBOTS)
def test_zero_steps_hold_every_robot_for_two_seconds(name, alone):
    one = alone(name, "BASIC")
    before, height = hand_places(one), one.state.root_pose.translation.copy()
    free = one.robot.root.kind == "free"
    steps(one, 10 if free else 40)  # a free one stands 4 s below
    for side, place in hand_places(one).items():
        # m; a free robot sinks into the soft contacts under its feet
        assert np.abs(place - before[side]).max() < (3e-4 if free else 1e-6)
    np.testing.assert_allclose(one.state.root_pose.translation, height, atol=3e-4)


@pytest.mark.slow
def test_spot_stands_on_four_feet_and_moves_its_arm(alone):
    """robosuite's goes from 0.48 m to 0.11 m in these 4 s."""
    one = alone("SpotWithArm", "BASIC")
    root, hand = one.state.root_pose.translation.copy(), hand_places(one)["right"]
    steps(one, 80)
    np.testing.assert_allclose(one.state.root_pose.translation, root, atol=1e-4)
    for _ in range(2):
        steps(one, 1, right=[1.0, 0, 0, 0, 0, 0])
        steps(one, 20)
    moved = hand_places(one)["right"] - hand
    np.testing.assert_allclose(moved, [0.1, 0.0, 0.0], atol=5e-4)
    np.testing.assert_allclose(one.state.root_pose.translation, root, atol=1e-3)


@pytest.mark.slow
def test_a_biped_keeps_its_balance_while_its_arms_reach(alone):
    one = alone("GR1FreeBody", "BASIC")
    steps(one, 10, right=[1.0, 0, 0, 0, 0, 0], left=[1.0, 0, 0, 0, 0, 0])
    steps(one, 50)
    assert one.state.root_pose.rotation[2, 2] > np.cos(np.radians(2.0))
    steps(one, 10, torso=[1.0, 0, 0])
    steps(one, 40)
    assert one.state.root_pose.rotation[2, 2] > np.cos(np.radians(3.0))


def test_a_robot_that_would_fall_is_refused_in_words(alone):
    legs = {"format": 1, "type": "BASIC"}
    legs["body_parts"] = {"legs": {"type": "JOINT_POSITION"}}
    with pytest.raises(ConfigError, match=r"SpotWithArm has a free root.*'STANCE'"):
        alone("SpotWithArm", legs)
    one = alone("SpotWithArm", legs | {"may_fall": True})
    steps(one, 40)
    assert one.state.root_pose.translation[2] < 0.3


def test_stance_is_for_robots_that_can_fall():
    config = {"format": 1, "type": "BASIC", "body_parts": {"legs": {"type": "STANCE"}}}
    with pytest.raises(ConfigError, match=r"body_parts\.legs.*cannot fall"):
        load_composite_controller_config(config, "GR1")
    config["body_parts"]["legs"]["held"] = [{"frame": "front_left_fot"}]
    with pytest.raises(ConfigError, match="Did you mean 'front_left_foot'"):
        load_composite_controller_config(config, "Spot")


def test_osc_needs_a_hand():
    config = {
        "format": 1,
        "type": "BASIC",
        "body_parts": {"head": {"type": "OSC_POSE"}},
    }
    with pytest.raises(ConfigError, match="Parts that do: right, left"):
        load_composite_controller_config(config, "GR1")


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("Tiago", {"left": "OSC_POSE"}),
        ("GR1", {"head": "JOINT_POSITION", "right": "JOINT_POSITION"}),
        ("Jaco", {}),
        ("SpotWithArm", {"legs": "STANCE"}),
    ],
)
def test_joints_of_no_part_are_held(name, parts, alone):
    """Fingers too: they are servos, and a torque law would send them to 0 rad."""
    config = {
        "format": 1,
        "type": "BASIC",
        "body_parts": {part: {"type": kind} for part, kind in parts.items()},
    }
    one = alone(name, config)
    assert {s.name for s in one.controller.layout.slices} >= {*parts} - {"legs"}
    before = one.state.q
    steps(one, 20)
    np.testing.assert_allclose(one.state.q, before, atol=6e-3)  # fingers sag a little


def test_the_action_has_the_order_of_the_config():
    parts = {"left": {"type": "OSC_POSE"}, "right": {"type": "JOINT_POSITION"}}
    config = {"format": 1, "type": "BASIC", "body_parts": parts}
    env = wbc_suite.make("Lift", robots="Baxter", controller_configs=config)
    names = [s.name for s in env.unwrapped.action_layout.slices]
    assert names == ["left", "right", "left_gripper", "right_gripper"]


@pytest.mark.parametrize("path", Catalogue().files("controllers"), ids=lambda p: p.stem)
def test_shipped_files_are_of_a_known_robot_and_kind(path):
    robot, kind = path.stem.split("_", 1)
    config = load_composite_controller_config(kind.upper(), robot)
    assert config["type"] == kind.upper()
    assert config == load_composite_controller_config(path, robot)


URDF = """
<robot name="crane">
  <link name="ground"/>{links}
  <joint name="column" type="prismatic"><parent link="ground"/><child link="a"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="1" velocity="1" effort="500"/></joint>
  <joint name="boom" type="revolute"><parent link="a"/><child link="b"/>
    <axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="3" effort="80"/></joint>
  <joint name="jib" type="revolute"><parent link="b"/><child link="c"/>
    <origin xyz="0.4 0 0"/>
    <axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="3" effort="80"/></joint>
</robot>"""
LINK = """
  <link name="{0}"><inertial><mass value="2"/><origin xyz="0.1 0 0"/>
    <inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/>
  </inertial></link>"""


def test_any_robot_with_any_groups(tmp_path, alone):
    file = tmp_path / "crane.urdf"
    file.write_text(URDF.format(links="".join(LINK.format(x) for x in "abc")))
    robot = wbc_suite.load_robot(file)
    odd = robot.model_copy(
        update={"groups": {"hoist": ("column",), "swing": ("boom", "jib")}}
    )
    one = alone(odd, "BASIC")
    assert [*parts_of(odd)] == ["hoist", "swing"]
    assert [*hands_of(odd)] == ["swing"]
    before = hand_places(one)
    steps(one, 20)
    for side, place in hand_places(one).items():
        np.testing.assert_allclose(place, before[side], atol=1e-6)
