"""Jaco: masses split between arm and hand, peak torques, ready posture, shells."""

import mujoco
import numpy as np
import pytest

import wbc_suite

SOURCE_MASS = 5.49724  # arm and palm, without the six finger links
PALM = 0.66
PEAKS = [30.5] * 4 + [6.8] * 3  # N m, data sheet of the actuators


@pytest.fixture(scope="module")
def arm():
    return wbc_suite.load_robot("arm/jaco")


def test_arm_and_palm_weigh_what_the_data_sheet_says(arm):
    assert arm.mass + PALM == pytest.approx(SOURCE_MASS, abs=1e-9)
    assert arm.mass + PALM == pytest.approx(5.5, rel=0.01)
    link = arm.link("j2s7s300_link_7")
    moment = link.mass * link.com[2] - PALM * 0.087  # the hand hangs along -z
    assert moment == pytest.approx(0.99 * -0.06, abs=1e-9)


def test_motors_give_the_peaks_of_the_data_sheet(arm):
    assert [joint.effort for joint in arm.joints] == PEAKS
    endless = [joint.name[-1] for joint in arm.joints if joint.range is None]
    assert endless == ["1", "3", "5", "7"]


def test_ready_posture_is_free_points_down_and_leaves_the_motors_half_their_torque():
    robot = wbc_suite.load_robot("Jaco")
    model = robot.to_mjspec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("ready").id)
    mujoco.mj_forward(model, data)
    assert data.ncon == 0
    R = data.site("right_eef").xmat.reshape(3, 3)
    assert R[2, 2] < -0.95
    assert np.all(np.abs(data.qfrc_bias[:7]) < 0.5 * np.array(PEAKS))


def test_fully_stretched_arm_reaches_as_far_as_the_data_sheet_says(arm):
    """984 mm from the shoulder to the middle of the hand."""
    model = arm.to_mjspec().compile()
    data = mujoco.MjData(model)
    for name in ("2", "4", "6"):
        data.joint(f"j2s7s300_joint_{name}").qpos[:] = np.pi
    mujoco.mj_forward(model, data)
    shoulder = data.body("j2s7s300_link_2").xpos
    reach = np.linalg.norm(data.site("eef").xpos - shoulder)
    assert reach == pytest.approx(0.985, abs=0.02)
