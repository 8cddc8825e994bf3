"""Baxter: mass, two arms out of one file, ready posture, stand on the pedestal."""

import mujoco
import numpy as np
import pytest

import wbc_suite

MIRROR = np.diag([1.0, -1.0, 1.0])


@pytest.fixture(scope="module")
def robot():
    return wbc_suite.load_robot("Baxter")


def test_it_weighs_the_data_sheets_75_kilograms_without_pedestal():
    robot = wbc_suite.load_robot("Baxter", base="none", gripper="none")
    mass = sum(robot.to_mjspec().compile().body_mass)
    assert mass == pytest.approx(74.8, rel=0.02)


def test_both_arms_have_the_vendors_names_and_the_head_is_locked(robot, model):
    for side in ("right", "left"):
        assert robot.groups[f"{side}_arm"] == tuple(
            f"{side}_{joint}" for joint in ("s0", "s1", "e0", "e1", "w0", "w1", "w2")
        )
    moving = {model.joint(i).name for i in range(model.njnt)}
    assert "head_pan" not in moving
    assert model.nv == 14 + 4  # two fingers a hand


def test_ready_posture_is_free_and_the_hands_mirror_each_other(data):
    assert (data.contact.dist < 0.0).sum() == 0
    right, left = data.site("right_tcp"), data.site("left_tcp")
    np.testing.assert_allclose(MIRROR @ right.xpos, left.xpos, atol=1e-9)
    approach = [site.xmat.reshape(3, 3)[:, 2] for site in (right, left)]
    np.testing.assert_allclose(MIRROR @ approach[0], approach[1], atol=1e-9)
    assert approach[0][2] < -0.6  # down
    assert 0.5 < right.xpos[0] < 0.8
    assert right.xpos[1] < 0.0


def test_gravity_leaves_the_motors_room_in_the_ready_posture(robot, model, data):
    joints = {link.joint.name: link.joint for link in robot.links if link.joint}
    for side in ("right", "left"):
        for name in robot.groups[f"{side}_arm"]:
            torque = data.qfrc_bias[model.joint(name).dofadr[0]]
            assert abs(torque) < 0.6 * joints[name].effort, name


def test_torso_stands_on_the_pedestals_flange(data):
    # The vendor's torso frame is 0.924 m above the floor on the pedestal.
    assert data.body("baxter_torso").xpos[2] == pytest.approx(0.924)


@pytest.mark.parametrize("base", ["rethink_mount", "omron_mobile_base", "none"])
def test_other_bases_carry_it(base):
    robot = wbc_suite.load_robot("Baxter", base=base)
    data = mujoco.MjData(model := robot.to_mjspec().compile())
    mujoco.mj_resetDataKeyframe(model, data, model.key("ready").id)
    mujoco.mj_forward(model, data)
    assert (data.contact.dist < 0.0).sum() == 0


def test_each_hand_closes_on_its_own(robot, model, data):
    (right,) = robot.synergies["right_gripper"]
    (left,) = robot.synergies["left_gripper"]
    for name, target in {**right.closed, **left.open}.items():
        data.ctrl[model.actuator(name).id] = target
    hold = [
        model.joint(joint).dofadr[0]
        for side in ("right", "left")
        for joint in robot.groups[f"{side}_arm"]
    ]
    for _ in range(int(0.5 / model.opt.timestep)):
        data.qvel[hold] = 0.0
        data.qfrc_applied[hold] = data.qfrc_bias[hold]
        mujoco.mj_step(model, data)
    values = {
        side: data.joint(f"{side}_gripper_l_finger_joint").qpos[0]
        for side in ("right", "left")
    }
    assert values["right"] == pytest.approx(0.0, abs=2e-3)
    assert values["left"] == pytest.approx(0.0208, abs=2e-3)
