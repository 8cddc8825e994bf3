"""Panda: mass, the ready posture, the hand's mounting, the fingers' force."""

import mujoco
import numpy as np
import pytest

import wbc_suite

ARM_AND_HAND = 16.69194 + 0.76  # identified arm without its fixed foot, and hand


@pytest.fixture(scope="module")
def robot():
    return wbc_suite.load_robot("Panda", base="none")


def test_masses_are_near_the_data_sheets_eighteen_kilograms(model):
    assert sum(model.body_mass) == pytest.approx(ARM_AND_HAND, abs=1e-3)
    assert sum(model.body_mass) == pytest.approx(18.0, rel=0.04)


def test_ready_posture_is_free_and_the_hand_points_down_along_the_arm(model, data):
    assert (data.contact.dist < 0.0).sum() == 0
    R = data.site("right_tcp").xmat.reshape(3, 3)
    # The mount's -45 degrees and the seventh joint's +45 cancel: fingers move sideways.
    assert abs(R[:, 1] @ [0.0, 1.0, 0.0]) > 0.999
    assert R[2, 2] < -0.8


def test_mount_carries_the_arm_at_its_height_and_stands_on_the_floor():
    robot = wbc_suite.load_robot("Panda")
    model = robot.to_mjspec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.body("panda_link0").xpos[2] == pytest.approx(0.912)
    lowest = np.inf
    for geom in range(model.ngeom):
        half = np.abs(data.geom_xmat[geom].reshape(3, 3)) @ model.geom_aabb[geom, 3:]
        centre = (
            data.geom_xpos[geom]
            + data.geom_xmat[geom].reshape(3, 3) @ model.geom_aabb[geom, :3]
        )
        lowest = min(lowest, centre[2] - half[2])
    assert lowest == pytest.approx(0.0, abs=0.002)


def test_fingers_close_within_half_a_second_and_then_squeeze(robot, model, data):
    (synergy,) = robot.synergies["right_gripper"]
    arm = [model.joint(name).dofadr[0] for name in robot.groups["right_arm"]]
    motor = model.actuator("panda_finger_joint1").id

    def run(posture):
        for name, value in posture.items():
            data.ctrl[model.actuator(name).id] = value
        for _ in range(int(0.5 / model.opt.timestep)):
            data.qvel[arm] = 0.0
            data.qfrc_applied[arm] = data.qfrc_bias[arm]
            mujoco.mj_step(model, data)

    run(synergy.closed)
    for joint in ("panda_finger_joint1", "panda_finger_joint2"):
        assert data.joint(joint).qpos[0] == pytest.approx(0.0, abs=0.003)
    run(synergy.open)
    for joint in ("panda_finger_joint1", "panda_finger_joint2"):
        assert data.joint(joint).qpos[0] == pytest.approx(0.04, abs=0.003)
    assert model.actuator_forcerange[motor].tolist() == [-70.0, 70.0]
