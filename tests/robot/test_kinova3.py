"""Kinova Gen3: mass, torques, endless joints, and what its own camera sees."""

import numpy as np
import pinocchio as pin
import pytest

import wbc_suite

DATA_SHEET_MASS = 8.2  # kg
NOMINAL_TORQUES = [32.0] * 4 + [13.0] * 3  # N m, large and small actuators


@pytest.fixture(scope="module")
def robot():
    return wbc_suite.load_robot("Kinova3", gripper="none", base="none")


def test_mass_is_the_data_sheets(robot):
    model = robot.to_mjspec().compile()
    assert sum(model.body_mass) == pytest.approx(DATA_SHEET_MASS, rel=0.005)


def test_every_other_joint_turns_without_end(robot):
    model = robot.to_mjspec().compile()
    assert model.jnt_limited.tolist() == [0, 1, 0, 1, 0, 1, 0]
    assert robot.to_pinocchio().nq == 7


def test_stretched_arm_stays_within_the_nominal_torques(robot):
    model = robot.to_pinocchio()
    data = model.createData()
    q = pin.neutral(model)
    q[model.joints[model.getJointId("joint_2")].idx_q] = np.pi / 2
    torque = np.abs(pin.computeGeneralizedGravity(model, data, q))
    assert (torque < NOMINAL_TORQUES).all()
    assert torque[1] > 0.5 * NOMINAL_TORQUES[1]
    assert (model.upperEffortLimit[:4] > NOMINAL_TORQUES[:4]).all()


def test_ready_posture_is_free_and_the_flange_points_down_in_front(robot, at_ready):
    _, data = at_ready(robot)
    assert data.ncon == 0
    flange = data.site("right_eef")
    assert flange.xmat.reshape(3, 3)[2, 2] < -0.99
    assert flange.xpos[0] > 0.4


def test_camera_sees_the_fingers_open_to_its_left_and_right(at_ready):
    model, data = at_ready(wbc_suite.load_robot("Kinova3"))
    assert (data.contact.dist < 0.0).sum() == 0
    camera = data.camera("right_wrist_camera")
    R = camera.xmat.reshape(3, 3)
    grasp = data.site("right_tcp")
    seen = R.T @ (grasp.xpos - camera.xpos)
    half = np.deg2rad(model.camera("right_wrist_camera").fovy[0]) / 2
    assert -seen[2] > 0.05
    assert np.abs(seen[:2]).max() < -seen[2] * np.tan(half)
    assert abs(R[:, 0] @ grasp.xmat.reshape(3, 3)[:, 1]) > 0.999
