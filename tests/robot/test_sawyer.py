"""Sawyer: mass, ready posture, the locked head with its screen, the hand's mount."""

import mujoco
import numpy as np
import pytest

import wbc_suite

HEAD = 1.5796  # kg, with the screen's placeholder


@pytest.fixture(scope="module")
def robot():
    return wbc_suite.load_robot("Sawyer")


def test_arm_without_head_weighs_the_data_sheets_nineteen_kilograms():
    robot = wbc_suite.load_robot("Sawyer", base="none", gripper="none")
    mass = sum(robot.to_mjspec().compile().body_mass)
    assert mass - HEAD == pytest.approx(19.0, rel=0.02)


def test_seven_joints_move_and_the_head_is_locked(robot, model):
    assert len(robot.groups["right_arm"]) == 7
    assert "head" not in robot.groups
    moving = {model.joint(i).name for i in range(model.njnt)}
    assert "head_pan" not in moving
    assert model.nv == 7 + 2  # two fingers


def test_ready_posture_is_free_and_the_fingers_open_sideways_above_the_work(data):
    assert (data.contact.dist < 0.0).sum() == 0
    tcp = data.site("right_tcp")
    R = tcp.xmat.reshape(3, 3)
    assert R[2, 2] < -0.999
    assert abs(R[1, 1]) > 0.999
    np.testing.assert_allclose(tcp.xpos, [0.46, 0.16, 0.985], atol=0.02)


def test_ready_torques_are_within_the_motors(robot, model, data):
    for name in robot.groups["right_arm"]:
        joint = next(i.joint for i in robot.links if i.joint and i.joint.name == name)
        torque = data.qfrc_bias[model.joint(name).dofadr[0]]
        assert abs(torque) < 0.6 * joint.effort


def test_camera_over_the_screen_sees_the_work(data, model):
    camera = data.camera("head_camera")
    forward = -camera.xmat.reshape(3, 3)[:, 2]
    assert forward[0] > 0.85
    assert forward[2] < -0.3
    up = camera.xmat.reshape(3, 3)[:, 1]
    assert up[2] > 0.85
    hand = data.camera("right_eye_in_hand")
    np.testing.assert_allclose(
        -hand.xmat.reshape(3, 3)[:, 2], [0.0, 0.0, -1.0], atol=0.03
    )


def test_arm_fits_another_gripper_at_the_flange():
    robot = wbc_suite.load_robot("Sawyer", gripper="panda_gripper", base="none")
    data = mujoco.MjData(model := robot.to_mjspec().compile())
    mujoco.mj_forward(model, data)
    hand, flange = data.body("panda_hand"), data.site("right_eef")
    np.testing.assert_allclose(hand.xpos, flange.xpos, atol=1e-9)
    np.testing.assert_allclose(hand.xmat, flange.xmat, atol=1e-9)
