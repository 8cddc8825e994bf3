"""XArm7: the user manual's kinematics, masses, ready posture, and its gripper."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import wbc_suite

MANUAL = (  # modified Denavit-Hartenberg: twist (quarter turns), length, offset
    (0, 0.0, 0.267),
    (-1, 0.0, 0.0),
    (1, 0.0, 0.293),
    (1, 0.0525, 0.0),
    (1, 0.0775, 0.3425),
    (1, 0.0, 0.0),
    (-1, 0.076, 0.097),
)
FINGERS = {  # links and joints of one side, the source's ratio to the drive is 1
    "left": ("drive_joint", "left_finger_joint", "left_inner_knuckle_joint"),
    "right": (
        "right_outer_knuckle_joint",
        "right_finger_joint",
        "right_inner_knuckle_joint",
    ),
}


def manual_pose(angles):
    """Return T_base_flange by the table of the user manual."""
    pose = pin.SE3.Identity()
    for (quarter, length, offset), angle in zip(MANUAL, angles, strict=True):
        twist = pin.rpy.rpyToMatrix(quarter * np.pi / 2, 0.0, 0.0)
        turn = pin.rpy.rpyToMatrix(0.0, 0.0, angle)
        pose = pose * pin.SE3(twist, np.array([length, 0.0, 0.0]))
        pose = pose * pin.SE3(turn, np.array([0.0, 0.0, offset]))
    return pose


def test_flange_is_where_the_user_manual_says():
    model = wbc_suite.load_robot("arm/xarm7").to_pinocchio()
    data = model.createData()
    frame = model.getFrameId("eef", pin.FrameType.OP_FRAME)
    rng = np.random.default_rng(7)
    for _ in range(10):
        q = rng.uniform(model.lowerPositionLimit, model.upperPositionLimit)
        pin.framesForwardKinematics(model, data, q)
        error = data.oMf[frame].homogeneous - manual_pose(q).homogeneous
        assert np.abs(error).max() < 1e-9


def test_motors_hold_the_data_sheets_payload_at_ready():
    """3.5 kg, of which the gripper is 0.75 kg; the rest hangs at the pads."""
    robot = wbc_suite.load_robot("XArm7")
    model = robot.to_mjspec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("ready").id)
    mujoco.mj_forward(model, data)
    assert data.ncon == 0
    assert data.site("right_tcp").xmat.reshape(3, 3)[2, 2] < -0.99
    jacobian = np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, jacobian, None, model.site("right_tcp").id)
    gripper = wbc_suite.load_robot("gripper/xarm7_gripper").mass
    torque = data.qfrc_bias + 9.81 * (3.5 - gripper) * jacobian[2]
    efforts = np.array([joint.effort for joint in robot.joints[:7]])
    assert np.all(np.abs(torque[:7]) < efforts)


def test_arm_has_the_figures_of_the_source():
    arm = wbc_suite.load_robot("arm/xarm7")
    assert arm.mass == pytest.approx(11.31706, abs=1e-6)
    assert [joint.effort for joint in arm.joints] == [50, 50, 30, 30, 30, 20, 20]


def settled(robot, command):
    """Close the gripper without gravity, and wait."""
    model = robot.to_mjspec().compile()
    model.opt.gravity[:] = 0.0
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("ready").id)
    data.actuator("drive_joint").ctrl = command
    mujoco.mj_step(model, data, round(0.8 / model.opt.timestep))
    assert not data.warning.number.any()
    return model, data


@pytest.mark.parametrize("command", [0.0, 0.4, 0.8])
def test_loops_of_the_gripper_are_the_parallelograms_of_the_tree(command):
    robot = wbc_suite.load_robot("gripper/xarm7_gripper")
    assert robot.dof == 1
    model, data = settled(robot, command)
    assert list(model.eq_type).count(mujoco.mjtEq.mjEQ_CONNECT) == 2
    drive = data.joint("drive_joint").qpos[0]
    assert drive == pytest.approx(command, abs=0.01)
    for joints in FINGERS.values():
        for name in joints:
            assert data.joint(name).qpos[0] == pytest.approx(drive, abs=2e-3)
    for side in FINGERS:  # fingers stay upright
        up = data.body(f"{side}_finger").xmat.reshape(3, 3)[2, 2]
        assert up == pytest.approx(1.0, abs=1e-5)


def test_stroke_is_the_data_sheets_and_the_pads_meet():
    """84 mm; the source's drawing opens 5 mm wider."""
    robot = wbc_suite.load_robot("gripper/xarm7_gripper")
    gap = {}
    for command in (0.0, 0.85):
        _, data = settled(robot, command)
        left, right = (data.body(f"{side}_finger").xpos[1] for side in FINGERS)
        gap[command] = left - right - 2 * 0.026
    assert gap[0.0] == pytest.approx(0.084, abs=0.006)
    assert abs(gap[0.85]) < 0.003
