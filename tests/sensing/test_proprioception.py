import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

import wbc_suite


def test_panda_feels_its_joints_hand_and_fingers():
    env = wbc_suite.make("Lift", robots="Panda")
    seen, _ = env.reset(seed=1)
    data = env.simulation.data
    joints = [f"robot0_panda_joint{i}" for i in range(1, 8)]
    q = np.concatenate([data.joint(name).qpos for name in joints])
    assert_array_equal(seen["robot0_joint_pos"], q)
    assert_allclose(seen["robot0_joint_pos_cos"], np.cos(q), atol=1e-15)
    hand = data.site("robot0_right_tcp")
    assert_array_equal(seen["robot0_eef_pos"], hand.xpos)
    turn = Rotation.from_quat(seen["robot0_eef_quat"]).as_matrix()
    assert_allclose(turn.ravel(), hand.xmat, atol=1e-14)
    way = data.body("cube").xpos - hand.xpos
    assert_array_equal(seen["gripper_to_cube_pos"], way)
    finger = data.joint("robot0_panda_finger_joint1")
    assert_array_equal(seen["robot0_gripper_qpos"], finger.qpos)
    assert_array_equal(seen["robot0_gripper_qvel"], finger.qvel)
    assert not any("base" in key for key in seen)


def test_two_hands_have_a_key_each():
    seen, _ = wbc_suite.make("Lift", robots="Baxter").reset(seed=0)
    for side in ("right", "left"):
        assert seen[f"robot0_{side}_eef_pos"].shape == (3,)
        assert f"{side}_gripper_to_cube_pos" in seen
        assert f"robot0_{side}_gripper_qpos" in seen


@pytest.mark.slow
@pytest.mark.parametrize(("robot", "size"), [("Tiago", 3), ("SpotWithArm", 6)])
def test_moving_bases_feel_their_pose_and_speed(robot, size):
    env = wbc_suite.make("Lift", robots=robot)
    env.reset(seed=0)
    seen = env.step(env.hold_action)[0]
    data, (state,) = env.simulation.data, env.simulation.robots
    first = data.body("robot0_" + env.robots[0].links[0].name)
    assert_array_equal(seen["robot0_base_pos"], first.xpos)
    assert_array_equal(seen["robot0_base_quat"], first.xquat[[1, 2, 3, 0]])
    assert_array_equal(seen["robot0_base_vel"], state.v[:size])
