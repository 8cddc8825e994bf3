"""Kinova's three-finger hand: alone, and as the end of the Jaco arm."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import wbc_suite

SHEET = 0.727  # kg
LINK_7 = 0.99  # kg, of kinova-ros: the wrist's share and the palm
LINK_7_CENTRE = 0.06  # m, out of the flange
FINGERS = ("thumb", "index", "pinky")


@pytest.fixture(scope="module")
def hand():
    return wbc_suite.load_robot("gripper/jaco_three_finger_dexterous_gripper")


def simulated(hand, command, seconds=2.0):
    model = hand.to_mjspec().compile()
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.opt.gravity[:] = 0.0
    data = mujoco.MjData(model)
    for joint, value in hand.keyframe("ready").items():
        data.joint(joint).qpos = value
    for finger in FINGERS:
        data.actuator(f"joint_{finger}").ctrl = command.get(finger, 1.0)
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)
    assert not data.warning.number.any()
    return model, data


def test_mass_is_the_data_sheets(hand):
    assert hand.mass == pytest.approx(SHEET, rel=0.02)


def test_arm_and_hand_share_the_sources_last_link():
    """Mass and first moment of kinova-ros' link_7, fingers left out."""
    robot = wbc_suite.load_robot("Jaco")
    palm, wrist = robot.link("palm"), robot.link("j2s7s300_link_7")
    mass = palm.mass + wrist.mass
    assert mass == pytest.approx(LINK_7, abs=1e-9)
    out = -(palm.mass * palm.com[2] + wrist.mass * wrist.com[2]) / mass
    assert out == pytest.approx(LINK_7_CENTRE, abs=1e-3)
    model = robot.to_pinocchio()
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    frames = [
        data.oMf[model.getFrameId(name, pin.FrameType.BODY)].homogeneous
        for name in ("palm", "j2s7s300_link_7")
    ]
    np.testing.assert_allclose(frames[0], frames[1], atol=1e-9)


@pytest.mark.parametrize("finger", FINGERS)
def test_each_command_moves_its_own_finger(hand, finger):
    _, data = simulated(hand, {finger: 0.6})
    for other in FINGERS:
        wanted = 0.6 if other == finger else 1.0
        assert float(data.joint(f"joint_{other}").qpos[0]) == pytest.approx(
            wanted, abs=5e-3
        )
        assert abs(float(data.joint(f"joint_{other}_distal").qpos[0])) < 2e-3


def test_tips_meet_when_closed(hand):
    model, data = simulated(hand, dict.fromkeys(FINGERS, 0.3))
    touching = {
        model.body(model.geom_bodyid[g]).name for g in data.contact.geom.ravel()
    }
    assert "thumb_distal" in touching
    assert touching & {"index_distal", "pinky_distal"}
    assert data.contact.dist.min() > -5e-4


def test_fingers_mirror_each_other(hand):
    """The pinky is the index finger's reflection, but for 0.15 mm of height."""
    index, pinky = hand.link("index_proximal"), hand.link("pinky_proximal")
    np.testing.assert_allclose(index.pos, np.multiply(pinky.pos, (-1, 1, 1)), atol=2e-4)
    w, x, y, z = pinky.quat
    np.testing.assert_allclose(index.quat, (w, x, -y, -z), atol=1e-9)
