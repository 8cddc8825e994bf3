"""Wiping tool: a pad that lies flat, presses and drags, and never grips."""

import mujoco
import numpy as np
import pytest

import wbc_suite


@pytest.fixture(scope="module")
def tool():
    return wbc_suite.load_robot("gripper/wiping_gripper", root="free")


def test_tool_cannot_grip_but_fits_an_arm(tool):
    assert not tool.synergies
    robot = wbc_suite.load_robot("Panda", gripper="WipingGripper")
    assert robot.dof == 7
    assert robot.frame("right_tcp").role == "tcp"


def test_pressed_pad_lies_on_its_four_corners_and_drags_with_its_friction(tool):
    """Turned face down on a table, pressed with 10 N: 5 N do not move it, 15 N do."""
    spec = tool.to_mjspec()
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 0.1], friction=[1, 0.05, 0.001]
    )
    model = spec.compile()
    model.opt.cone, model.opt.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 10.0
    data = mujoco.MjData(model)
    data.qpos[:] = (0, 0, 0.031, 0, 1, 0, 0)
    way = []
    for push, steps in ((0.0, 100), (5.0, 100), (15.0, 50)):
        start = data.qpos[1]
        for _ in range(steps):
            data.xfrc_applied[1, :3] = (0, push, -10.0)
            mujoco.mj_step(model, data)
        if push == 0.0:
            heights = [data.site(f"pad_corner_{k}").xpos[2] for k in range(1, 5)]
            np.testing.assert_allclose(heights, 0.0, atol=0.002)
        way.append(data.qpos[1] - start)
    assert abs(way[0]) < 1e-6
    assert abs(way[1]) < 0.002
    assert way[2] > 0.02
