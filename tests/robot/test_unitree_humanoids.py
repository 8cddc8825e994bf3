"""Unitree's humanoids: data sheets, variants, soles, standing and reaching."""

import numpy as np
import pinocchio as pin
import pytest

import wbc_suite

MASSES = {"G1": 34.4}  # kg, the vendor's URDF with hands; its data sheet says 35
JOINTS = {  # of the body, of legs, of waist and head
    "G1": (29, 12, 3),
}
FEET = ("left_foot", "right_foot")


@pytest.fixture(scope="module", params=MASSES)
def name(request):
    return request.param


def joints_of_hands(robot):
    return sum(len(robot.groups[gripper]) for gripper in robot.synergies)


def test_mass_and_joints_are_the_vendors(name):
    robot = wbc_suite.load_robot(name)
    assert robot.mass == pytest.approx(MASSES[name], abs=0.05)
    body, legs, waist = JOINTS[name]
    hands = joints_of_hands(robot)
    assert robot.dof == body + hands
    counts = {
        "FreeBody": body,
        "FixedLowerBody": body - legs,
        "FloatingBody": body - legs,
        "ArmsOnly": body - legs - waist,
    }
    for variant, count in counts.items():
        assert wbc_suite.load_robot(name + variant).dof == count + hands, variant


def test_every_moving_joint_has_limits_and_a_rotor(name):
    for joint in wbc_suite.load_robot(name).joints:
        assert joint.range, joint.name
        assert joint.velocity, joint.name
        assert joint.mimic or joint.effort, joint.name
        assert joint.armature > 0, joint.name


def test_soles_lie_flat_on_the_ground_under_the_centre_of_mass(name):
    robot = wbc_suite.load_robot(name + "FreeBody")
    model = robot.to_pinocchio()
    data, q = model.createData(), model.referenceConfigurations["ready"]
    q[:3] = robot.root.pos
    pin.framesForwardKinematics(model, data, q)
    feet = [data.oMf[model.getFrameId(foot)] for foot in FEET]
    for foot in feet:
        assert foot.translation[2] == pytest.approx(0.0, abs=1e-4)
        np.testing.assert_allclose(foot.rotation, np.eye(3), atol=1e-9)
    ahead = pin.centerOfMass(model, data, q) - feet[0].translation
    assert 0.0 < ahead[0] < 0.06  # between the ankle and the ball of the foot


@pytest.fixture(scope="module")
def standing(name):
    env = wbc_suite.make(
        "Lift",
        robots=f"{name}FreeBody",
        controller_configs="WHOLE_BODY_IK",
        initialization_noise=None,
    )
    yield env.unwrapped
    env.close()


def run(env, shifts, seconds=2.5):
    """Shift goals of slices from a fresh start; return the report on frames."""
    env.reset(seed=0)
    action = env.hold_action.copy()
    for part, shift in shifts.items():
        start = env.action_layout[part].start
        action[start : start + 3] += shift
    for _ in range(round(20 * seconds)):
        info = env.step(action)[-1]
    pelvis = env.simulation.data.body("robot0_pelvis")
    assert pelvis.xmat[8] > 0.99
    return info["ik"]["frames"], pelvis.xpos.copy()


@pytest.mark.slow
def test_it_stands_where_it_stood(standing):
    standing.reset(seed=0)
    start = standing.simulation.data.body("robot0_pelvis").xpos.copy()
    _, end = run(standing, {}, 5.0)
    np.testing.assert_allclose(end, start, atol=2e-3)


@pytest.mark.slow
def test_hands_reach_and_the_pelvis_squats_while_it_stands(standing):
    hands = {"right_hand": (0.06, 0.0, 0.05), "left_hand": (0.06, 0.0, 0.05)}
    frames, start = run(standing, hands)
    for hand in hands:
        assert frames[hand]["position_error"] < 2e-3
    frames, end = run(standing, {"pelvis": (0.0, 0.0, -0.05)})
    assert start[2] - end[2] == pytest.approx(0.05, abs=5e-3)
    for hand in hands:
        assert frames[hand]["position_error"] < 3e-3
