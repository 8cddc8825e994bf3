import numpy as np
import pytest

from wbc_suite.errors import ConfigError
from wbc_suite.robot import load_robot


def gripper(alone, name, **settings):
    robot = load_robot("Panda", gripper=name)
    part = {"type": "JOINT_POSITION", "gripper": settings}
    rig = alone(robot, "BASIC", body_parts={"right": part})
    rig.simulation.start()
    return rig


def command(rig, value, seconds):
    action = rig.controller.layout.pack(
        {"right_gripper": [value]}, base=rig.controller.hold_action
    )
    rig.controller.set_goal(action)
    rig.simulation.tick(round(seconds / rig.simulation.timestep))


# Strokes by the makers' data sheets.
@pytest.mark.parametrize(
    ("name", "stroke"),
    [("PandaGripper", 0.080), ("Robotiq85Gripper", 0.085), ("XArm7Gripper", 0.084)],
)
def test_widths_end_at_the_stroke_of_the_data_sheet(alone, name, stroke):
    part = gripper(alone, name, input="width").controller.layout["right_gripper"]
    assert (part.labels, tuple(map(str, part.units))) == (("width",), ("m",))
    assert part.high[0] - part.low[0] == pytest.approx(stroke, abs=4e-3)
    assert 0.0 <= part.low[0] < 2e-3


def test_fingers_of_a_panda_go_to_the_width_asked_for(alone):
    rig = gripper(alone, "PandaGripper", input="width")
    fingers = [rig.state.data.joint(f"robot0_panda_finger_joint{i}") for i in (1, 2)]
    for width in (0.05, 0.02):
        command(rig, width, 1.0)
        opened = sum(float(finger.qpos[0]) for finger in fingers)
        assert opened == pytest.approx(width, abs=1e-3)  # pads meet 0.4 mm apart
    np.testing.assert_allclose(rig.controller.hold_action[-1], 0.02)


def test_a_linkage_goes_to_the_width_asked_for(alone):
    rig = gripper(alone, "Robotiq85Gripper", input="width")
    pads = [rig.state.data.body(f"robot0_{side}_pad") for side in ("left", "right")]

    def apart():
        return float(np.linalg.norm(pads[0].xpos - pads[1].xpos))

    command(rig, 0.06, 1.0)
    wide = apart()
    command(rig, 0.02, 1.0)
    assert wide - apart() == pytest.approx(0.04, abs=2e-3)


def test_a_gripper_moves_at_its_speed(alone):
    rig = gripper(alone, "PandaGripper", speed=1.0)  # 2 s from open to closed
    finger = rig.state.data.joint("robot0_panda_finger_joint1")
    command(rig, -1.0, 3.0)
    start = float(finger.qpos[0])
    command(rig, 1.0, 1.0)
    assert finger.qpos[0] == pytest.approx(0.5 * start, abs=3e-3)  # the servo lags
    assert finger.qvel[0] == pytest.approx(-0.5 * start, rel=0.05)
    rig.simulation.tick(600)
    assert finger.qpos[0] == pytest.approx(0.0, abs=1e-3)


def test_without_a_speed_it_closes_at_once(alone):
    rig = gripper(alone, "PandaGripper")
    command(rig, -1.0, 1.0)
    command(rig, 1.0, 0.5)
    joint = rig.state.data.joint("robot0_panda_finger_joint1")
    assert joint.qpos[0] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("name", ["JacoThreeFingerGripper", "InspireRightHand"])
def test_a_hand_has_no_width(alone, name):
    with pytest.raises(ConfigError, match="synergy"):
        gripper(alone, name, input="width")


def test_each_synergy_of_a_hand_has_a_value_and_moves_its_own_joints(alone):
    rig = alone("PandaDexRH", "BASIC", body_parts={"right": {"type": "JOINT_POSITION"}})
    synergies = rig.robot.synergies["right_gripper"]
    part = rig.controller.layout["right_gripper"]
    assert part.labels == tuple(s.name for s in synergies)
    rig.simulation.start()
    action = rig.controller.hold_action
    action[part.start : part.stop] = -1.0
    rig.controller.set_goal(action)
    rig.simulation.tick(500)
    before = rig.state.data.qpos.copy()
    action[part.start] = 0.0
    rig.controller.set_goal(action)
    rig.simulation.tick(500)
    moved = np.abs(rig.state.data.qpos - before)
    first, rest = synergies[0], synergies[1:]
    for joint in first.open:
        way = abs(first.closed[joint] - first.open[joint])
        place = rig.state.joint_addresses((joint,))[0]
        assert moved[place] == pytest.approx(0.5 * way, rel=0.1)
    for joint in {j for s in rest for j in s.open} - set(first.open):
        assert moved[rig.state.joint_addresses((joint,))[0]] < 0.02
