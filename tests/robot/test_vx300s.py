"""VX300S: mass, payload, the ready posture, and how its gripper sits."""

import numpy as np
import pinocchio as pin
import pytest

import wbc_suite

PAYLOAD = 0.75  # kg, data sheet


@pytest.fixture(scope="module")
def robot():
    return wbc_suite.load_robot("VX300S", gripper="none", base="none")


def test_mass_is_the_vendors(robot):
    model = robot.to_mjspec().compile()
    assert sum(model.body_mass) == pytest.approx(3.510352, abs=1e-6)


def test_motors_hold_the_payload_stretched_out(robot):
    model = robot.to_pinocchio()
    data = model.createData()
    q = pin.neutral(model)
    q[model.joints[model.getJointId("shoulder")].idx_q] = 1.2
    torque = pin.computeGeneralizedGravity(model, data, q)
    J = pin.computeFrameJacobian(
        model, data, q, model.getFrameId("right_eef"), pin.LOCAL_WORLD_ALIGNED
    )
    loaded = np.abs(torque + J[2] * PAYLOAD * 9.81)
    assert (loaded < model.upperEffortLimit).all()
    assert loaded[1] > 0.4 * model.upperEffortLimit[1]


def test_ready_posture_is_free_and_the_gripper_points_down_in_front(at_ready):
    _, data = at_ready(wbc_suite.load_robot("VX300S"))
    assert (data.contact.dist < 0.0).sum() == 0
    tool = data.site("right_tcp")
    assert tool.xmat.reshape(3, 3)[2, 2] < -0.99
    assert abs(tool.xmat.reshape(3, 3)[1, 1]) > 0.99  # opens sideways
    assert tool.xpos[0] > 0.25
    assert abs(tool.xpos[1]) < 0.01
