"""TIAGo: mass, degrees of freedom, the ready posture, the two bases, the grippers."""

import mujoco
import numpy as np
import pytest

import wbc_suite

SIDES = ("left", "right")
PALM = 0.6  # estimate, see the component's deviations
FINGERS = 2 * 0.107001
SOURCE_MASS = 96.1815168  # without hands


@pytest.fixture(scope="module")
def robot():
    return wbc_suite.load_robot("Tiago")


def penetrations(model, data):
    mujoco.mj_forward(model, data)
    pairs = data.contact.geom[data.contact.dist < 0.0]
    return [{model.body(model.geom_bodyid[g]).name for g in pair} for pair in pairs]


def test_masses_add_up_to_the_source_and_the_hands(model):
    assert sum(model.body_mass) == pytest.approx(
        SOURCE_MASS + 2 * (PALM + FINGERS), abs=1e-6
    )


def test_both_bases_have_one_lift_two_head_and_fourteen_arm_joints(robot):
    other = wbc_suite.load_robot("TiagoDifferential")
    assert robot.root.drive == "holonomic"
    assert other.root.drive == "differential"
    for tiago in (robot, other):
        assert tiago.root.kind == "planar"
        sizes = {name: len(joints) for name, joints in tiago.groups.items()}
        assert sizes["torso"] == 1
        assert sizes["head"] == 2
        assert sizes["left_arm"] == sizes["right_arm"] == 7
        assert sizes["left_gripper"] == sizes["right_gripper"] == 1


def test_ready_posture_is_free_and_away_from_the_limits(robot, model, data):
    assert penetrations(model, data) == []
    ready = robot.keyframe("ready")
    for group in ("torso", "head", "left_arm", "right_arm"):
        for joint in robot.joints:
            if joint.name in robot.groups[group]:
                low, high = joint.range
                margin = min(ready[joint.name] - low, high - ready[joint.name])
                assert margin > 0.1 * (high - low), joint.name


def test_ready_torques_of_gravity_leave_half_of_the_effort(robot, model, data):
    efforts = {j.name: j.effort for j in robot.joints if j.effort is not None}
    for side in SIDES:
        for name in robot.groups[f"{side}_arm"]:
            torque = data.qfrc_bias[model.joint(name).dofadr[0]]
            assert abs(torque) < 0.5 * efforts[name], name


def test_zero_posture_is_free(model):
    data = mujoco.MjData(model)
    assert penetrations(model, data) == []


def test_hands_are_in_front_and_mirrored_to_the_sources_three_millimetres(data):
    left = data.site("left_tcp").xpos
    right = data.site("right_tcp").xpos
    assert left[0] > 0.5
    assert left[1] > 0.15
    # The source sets the third link of both arms 1.5 mm to the same side.
    assert np.abs(left * [1, -1, 1] - right).max() < 0.0035


def test_fingers_open_and_close_in_half_a_second(robot, model, data):
    held = [j.name for j in robot.joints if "finger" not in j.name]
    held += list(robot.root_joint_names)
    columns = [model.joint(name).dofadr[0] for name in held]
    for side in SIDES:
        (synergy,) = robot.synergies[f"{side}_gripper"]
        for target, width in ((synergy.closed, 0.0), (synergy.open, 0.045)):
            for name, value in target.items():
                data.ctrl[model.actuator(name).id] = value
            for _ in range(int(0.5 / model.opt.timestep)):
                data.qvel[columns] = 0.0
                data.qfrc_applied[columns] = data.qfrc_bias[columns]
                mujoco.mj_step(model, data)
            for finger in ("left", "right"):
                joint = f"{side}_gripper_{finger}_finger_joint"
                assert data.joint(joint).qpos[0] == pytest.approx(width, abs=0.004)


def test_no_pair_of_links_collides_in_every_posture(robot, model):
    rng = np.random.default_rng(3)
    data = mujoco.MjData(model)
    always = None
    for _ in range(100):
        for joint in robot.joints:
            data.joint(joint.name).qpos[0] = rng.uniform(*joint.range)
        found = {frozenset(pair) for pair in penetrations(model, data)}
        always = found if always is None else always & found
    assert always == set()
