"""Arms of hands: their joints, their length, and what few joints leave free."""

import numpy as np
import pinocchio as pin
import pytest

from wbc_suite.control.reasons import free_axes
from wbc_suite.robot import load_robot
from wbc_suite.robot.arms import arm_length, arm_of, has_few_joints

BODY = (
    '<inertial><mass value="0.2"/><inertia ixx="1e-3" ixy="0" ixz="0" iyy="1e-3" '
    'iyz="0" izz="1e-3"/></inertial>'
)
AXES = ("0 0 1", "0 1 0", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "0 0 1")


def arm_file(folder, count, *, sides=("",), torso=0):
    """Write arms of so many joints, 0.1 m apart, on so many joints of a torso."""
    links, joints = [], []

    def add(name, parent, axis, xyz):
        links.append(f'<link name="{name}">{BODY}</link>')
        joints.append(
            f'<joint name="{name}_joint" type="revolute"><parent link="{parent}"/>'
            f'<child link="{name}"/><origin xyz="{xyz}"/><axis xyz="{axis}"/>'
            '<limit lower="-2" upper="2" effort="20" velocity="6"/></joint>'
        )

    above = "base"
    for k in range(torso):
        add(f"torso{k}", above, "0 0 1", "0 0 0.3")
        above = f"torso{k}"
    for side in sides:
        parent = above
        for k in range(count):
            y = {"left_": 0.2, "right_": -0.2}.get(side, 0.0) * (k == 0)
            add(f"{side}arm{k}", parent, AXES[k], f"0.1 {y} 0")
            parent = f"{side}arm{k}"
        joints.append(
            f'<joint name="{side}tool" type="fixed"><parent link="{parent}"/>'
            f'<child link="{side}tool0"/><origin xyz="0.1 0 0"/></joint>'
        )
        links.append(f'<link name="{side}tool0"/>')
    path = folder / "arm.urdf"
    text = "".join(links + joints)
    path.write_text(f'<robot name="arm"><link name="base"/>{text}</robot>')
    return path


@pytest.mark.parametrize("count", [3, 5, 6, 7])
def test_an_arm_of_less_than_six_joints_has_few(tmp_path, count):
    robot = load_robot(arm_file(tmp_path, count))
    (hand,) = robot.hands.values()
    assert len([x for x in arm_of(robot, hand) if x.joint]) == count
    assert has_few_joints(robot, hand) == (count < 6)
    assert arm_length(robot, hand) == pytest.approx(0.1 * count)


def test_joints_that_carry_both_hands_are_no_part_of_an_arm(tmp_path):
    path = arm_file(tmp_path, 5, sides=("left_", "right_"), torso=2)
    robot = load_robot(path)
    for hand in robot.hands.values():
        assert [x.joint.name for x in arm_of(robot, hand) if x.joint] == [
            f"{hand.split('_')[0]}_arm{k}_joint" for k in range(4, -1, -1)
        ]
        assert has_few_joints(robot, hand)
        assert not has_few_joints(robot, robot.link_of(hand))  # no hand


def test_free_axes_are_those_that_no_motion_of_the_joints_turns(tmp_path):
    """Against random motions that keep the hand's position to first order."""
    rng = np.random.default_rng(0)
    for count, free in ((4, 2), (5, 1), (6, 0)):
        robot = load_robot(arm_file(tmp_path, count))
        model = robot.to_pinocchio()
        (hand,) = robot.hands.values()
        q = rng.uniform(-1.0, 1.0, model.nq)
        data = model.createData()
        J = pin.computeFrameJacobian(model, data, q, model.getFrameId(hand))
        kept = np.eye(model.nv) - np.linalg.pinv(J[:3]) @ J[:3]
        turns = J[3:] @ kept @ rng.normal(size=(model.nv, 200))
        found = free_axes(J).axes
        assert len(found) <= free
        power = np.linalg.svd(turns)
        lost = power[0][:, 3 - free :] if free else np.zeros((3, 0))
        shares = (lost**2).sum(axis=1)
        assert found == tuple(
            name for name, x in zip(("rx", "ry", "rz"), shares, strict=True) if x > 0.5
        )
