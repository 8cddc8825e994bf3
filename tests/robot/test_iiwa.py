"""LBR iiwa 7 and 14: mass, reach, rated torques, the ready posture."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import wbc_suite

# Name, prefix of its joints, then from KUKA's data sheets: mass kg, reach from the
# second axis to the sixth m, payload kg.
ROBOTS = [("IIWA", "iiwa7", 23.9, 0.8, 7.0), ("IIWA14", "iiwa14", 29.9, 0.82, 14.0)]


@pytest.fixture(scope="module", params=ROBOTS, ids=lambda row: row[0])
def sheet(request):
    return request.param


@pytest.fixture(scope="module")
def robot(sheet):
    return wbc_suite.load_robot(sheet[0], gripper="none", base="none")


def test_mass_is_the_data_sheets(model, sheet):
    assert sum(model.body_mass) == pytest.approx(sheet[2], abs=1e-4)


def test_stretched_arm_reaches_as_far_as_the_data_sheet_says(model, sheet):
    data = mujoco.MjData(model)
    data.joint(f"{sheet[1]}_A2").qpos[0] = np.pi / 2
    mujoco.mj_forward(model, data)
    shoulder, wrist = (data.joint(f"{sheet[1]}_{a}").xanchor for a in ("A2", "A6"))
    # Measured along the arm: the frames of A2 and A6 lie beside its middle line.
    assert wrist[0] - shoulder[0] == pytest.approx(sheet[3], abs=1e-6)


def test_rated_torques_hold_the_rated_payload_stretched_out(robot, sheet):
    model = robot.to_pinocchio()
    data = model.createData()
    q = pin.neutral(model)
    q[model.joints[model.getJointId(f"{sheet[1]}_A2")].idx_q] = np.pi / 2
    torque = pin.computeGeneralizedGravity(model, data, q)
    J = pin.computeFrameJacobian(
        model, data, q, model.getFrameId("right_eef"), pin.LOCAL_WORLD_ALIGNED
    )
    loaded = np.abs(torque + J[2] * sheet[4] * 9.81)
    assert (loaded < model.upperEffortLimit).all()
    # And not by an order of magnitude: the second axis carries more than a third.
    assert loaded[1] > 0.35 * model.upperEffortLimit[1]


def test_ready_posture_is_free_and_the_flange_points_down_in_front(model, data):
    assert data.ncon == 0
    flange = data.site("right_eef")
    assert flange.xmat.reshape(3, 3)[2, 2] < -0.99
    assert flange.xpos[0] > 0.4
    assert abs(flange.xpos[1]) < 1e-6
    middle = model.jnt_range.mean(axis=1)
    share = np.abs(data.qpos - middle) / (model.jnt_range[:, 1] - middle)
    assert share.max() < 0.95


def test_gripper_opens_sideways_under_the_flange():
    robot = wbc_suite.load_robot("IIWA", gripper="PandaGripper")
    model = robot.to_mjspec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("ready").id)
    mujoco.mj_forward(model, data)
    assert data.body("iiwa7_link_0").xpos[2] == pytest.approx(0.912)
    R = data.site("right_tcp").xmat.reshape(3, 3)
    assert abs(R[1, 1]) > 0.999
    assert (data.contact.dist < 0.0).sum() == 0
