"""The Rethink gripper: its place beyond the flange, mass, stroke and squeeze."""

import mujoco
import numpy as np
import pytest

import wbc_suite

PAD = (0.0068, 0.0055, 0.0178)


@pytest.fixture(scope="module")
def robot():
    return wbc_suite.load_robot("gripper/rethink_gripper")


def gap(model, data):
    """Distance between the inner faces of the pads, m."""
    left, right = (
        data.body(f"gripper_{side}_finger_tip").xpos[1] + sign * (0.0047 + PAD[1])
        for side, sign in (("l", -1.0), ("r", 1.0))
    )
    return left - right


def squeeze(robot, model, data, value):
    posture = getattr(robot.synergies["gripper"][0], value)
    for name, target in posture.items():
        data.ctrl[model.actuator(name).id] = target
    mujoco.mj_step(model, data, nstep=int(0.5 / model.opt.timestep))


def test_it_weighs_what_the_source_says_and_bodies_are_solid(model):
    assert sum(model.body_mass) == pytest.approx(0.360)
    for name in ("gripper_base", "gripper_l_finger", "gripper_r_finger_tip"):
        body = model.body(name)
        gyration = np.sqrt(body.inertia / body.mass)
        assert gyration.max() < 0.05
        assert gyration.min() > 0.003


def test_stroke_is_the_vendors_in_the_second_slot(robot, model, data):
    assert gap(model, data) == pytest.approx(0.0522, abs=1e-3)
    squeeze(robot, model, data, "closed")
    assert gap(model, data) == pytest.approx(0.0105, abs=1e-3)
    squeeze(robot, model, data, "open")
    assert gap(model, data) == pytest.approx(0.0522, abs=1e-3)


def test_fingers_stay_in_step_and_tcp_is_between_the_pads(robot, model, data):
    squeeze(robot, model, data, "closed")
    left, right = (
        data.joint(f"gripper_{side}_finger_joint").qpos[0] for side in ("l", "r")
    )
    assert left == pytest.approx(-right, abs=5e-4)
    pads = [
        model.geom(i).id
        for i in range(model.ngeom)
        if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_BOX
        and np.allclose(model.geom_size[i], PAD, atol=1e-9)
    ]
    assert len(pads) == 2
    middle = data.geom_xpos[pads].mean(axis=0)
    np.testing.assert_allclose(data.site("tcp").xpos, middle, atol=5e-4)
    assert all(model.geom_friction[pads, 0] == 1.0)


def test_mounted_it_starts_25_mm_beyond_the_flange():
    robot = wbc_suite.load_robot("Panda", gripper="rethink_gripper")
    link = next(link for link in robot.links if link.name == "gripper_base")
    assert link.pos[2] == pytest.approx(0.107 + 0.025)
