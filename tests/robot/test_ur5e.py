"""UR5e: mass, payload, the ready posture, and how its gripper sits."""

import numpy as np
import pinocchio as pin
import pytest

import wbc_suite

DATA_SHEET_MASS = 20.6  # kg, with cable
PAYLOAD = 5.0  # kg, data sheet


@pytest.fixture(scope="module")
def robot():
    return wbc_suite.load_robot("UR5e", gripper="none", base="none")


def test_mass_is_near_the_data_sheets(robot):
    model = robot.to_mjspec().compile()
    # The vendor's figures count 4 kg for the foot, which the sheet seems to lack.
    assert sum(model.body_mass) == pytest.approx(21.7, abs=1e-3)
    assert sum(model.body_mass) == pytest.approx(DATA_SHEET_MASS, rel=0.06)


def test_motors_hold_the_payload_stretched_out(robot):
    model = robot.to_pinocchio()
    data = model.createData()
    q = pin.neutral(model)  # stretched out level, the flange pointing sideways
    torque = pin.computeGeneralizedGravity(model, data, q)
    J = pin.computeFrameJacobian(
        model, data, q, model.getFrameId("right_eef"), pin.LOCAL_WORLD_ALIGNED
    )
    loaded = np.abs(torque + J[2] * PAYLOAD * 9.81)
    assert (loaded < model.upperEffortLimit).all()
    assert loaded[1] > 0.5 * model.upperEffortLimit[1]


def test_joints_turn_a_full_turn_but_for_the_elbow(robot):
    model = robot.to_pinocchio()
    span = model.upperPositionLimit - model.lowerPositionLimit
    expected = [2 * np.pi if n == "elbow_joint" else 4 * np.pi for n in model.names[1:]]
    np.testing.assert_allclose(span, expected, atol=1e-6)


def test_ready_posture_is_free_and_the_flange_points_down_in_front(robot, at_ready):
    _, data = at_ready(robot)
    assert data.ncon == 0
    flange = data.site("right_eef")
    assert flange.xmat.reshape(3, 3)[2, 2] < -0.99
    assert flange.xpos[0] > 0.3
    assert abs(flange.xpos[1]) < 0.05


def test_on_its_mount_the_gripper_opens_sideways(at_ready):
    _, data = at_ready(wbc_suite.load_robot("UR5e"))
    assert (data.contact.dist < 0.0).sum() == 0
    assert data.body("base_link").xpos[2] == pytest.approx(0.912)
    R = data.site("right_tcp").xmat.reshape(3, 3)
    assert R[2, 2] < -0.99
    assert abs(R[1, 1]) > 0.99
