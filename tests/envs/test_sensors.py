"""Sensors of robots, and changed observations, in environments."""

import copy
import pickle

import mujoco
import numpy as np
import pytest

import wbc_suite
from wbc_suite.sensing.noise import GaussianNoise

NOISY = {
    "cube_pos": {"noise": GaussianNoise(0.01), "delay": 0.03},
    "robot0_joint_pos": {"sampling_rate": 10.0},
}


def test_standing_feet_carry_the_robot_and_motors_its_joints():
    env = wbc_suite.make("Lift", robots="Spot", use_sensor_obs=True)
    env.reset(seed=0)
    for _ in range(10):
        observation, *_ = env.step(env.hold_action)
    model = env.simulation.model
    feet = [k for k in observation if k.endswith("_contact_force")]
    assert len(feet) == 4
    assert all(observation[k.removesuffix("_force")] == 1.0 for k in feet)
    up = sum(observation[k][2] for k in feet)
    weight = 9.81 * model.body_subtreemass[model.body("robot0_body").id]
    assert up == pytest.approx(weight, rel=0.02)
    assert observation["robot0_imu_accelerometer"][2] == pytest.approx(9.81, rel=0.05)
    torque = observation["robot0_joint_torque"]
    assert torque.shape == observation["robot0_joint_pos"].shape
    assert 1.0 < abs(torque).max() < 1e3
    assert env.observation_space.contains(observation)
    assert observation["robot0_sensor-state"].shape == (
        env.observation_space["robot0_sensor-state"].shape
    )


def test_the_wrist_feels_what_hangs_on_it():
    env = wbc_suite.make("Lift", robots="Panda", use_sensor_obs=True)
    env.reset(seed=0)
    data, hand = env.simulation.data, env.simulation.model.body("robot0_panda_hand").id
    for _ in range(15):
        observation, *_ = env.step(env.hold_action)
    before = np.linalg.norm(observation["robot0_right_wrist_force"])
    data.xfrc_applied[hand, 2] = -10.0
    for _ in range(15):
        observation, *_ = env.step(env.hold_action)
    after = np.linalg.norm(observation["robot0_right_wrist_force"])
    assert after - before == pytest.approx(10.0, abs=0.3)


def test_fingers_feel_what_they_squeeze():
    env = wbc_suite.make("Lift", robots="Panda", use_sensor_obs=True)
    env.reset(seed=0)
    data, hand = env.simulation.data, env.simulation.data.site("robot0_right_tcp")
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, hand.xmat)
    cube = data.joint("cube_joint")
    assert not env.observation()["robot0_right_touch"].any()
    action = env.hold_action
    action[-1] = 1.0
    for _ in range(12):  # the cube is held up until the fingers have it
        cube.qpos[:3], cube.qpos[3:], cube.qvel[:] = hand.xpos, quat, 0.0
        observation, *_ = env.step(action)
    hand, *fingers = observation["robot0_right_touch"]
    assert hand == 0.0
    np.testing.assert_allclose(fingers, fingers[0], rtol=0.1)
    assert 10.0 < fingers[0] < 150.0


def test_changed_observations_follow_the_seed_and_leave_physics_alone():
    plain = wbc_suite.make("Lift", robots="Panda")
    noisy = wbc_suite.make("Lift", robots="Panda", observables=NOISY)
    runs = []
    for env in (noisy, noisy, plain):
        observation, _ = env.reset(seed=3)
        seen = [observation]
        action = env.hold_action
        action[0] += 0.2
        seen += [env.step(action)[0] for _ in range(6)]
        runs.append((seen, env.simulation.data.qpos[:7].copy()))
    for first, again in zip(runs[0][0], runs[1][0], strict=True):
        for key in first:
            np.testing.assert_array_equal(first[key], again[key])
    np.testing.assert_allclose(runs[0][1], runs[2][1], atol=1e-12)
    error = runs[0][0][4]["cube_pos"] - runs[2][0][4]["cube_pos"]
    assert 0.0 < np.linalg.norm(error) < 0.06
    lag = runs[2][0][5]["robot0_joint_pos"] - runs[0][0][5]["robot0_joint_pos"]
    np.testing.assert_array_equal(
        runs[0][0][5]["robot0_joint_pos"], runs[0][0][4]["robot0_joint_pos"]
    )
    assert abs(lag).max() > 1e-4


@pytest.mark.parametrize(
    "copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))]
)
def test_copies_go_on_with_the_same_noise(copied):
    env = wbc_suite.make("Lift", robots="Panda", observables=NOISY)
    env.reset(seed=1)
    env.step(env.hold_action)
    env.observables.modify("cube_quat", noise=GaussianNoise(0.1))
    env.step(env.hold_action)
    twin = copied(env)
    for _ in range(4):
        ours, theirs = env.step(env.hold_action)[0], twin.step(twin.hold_action)[0]
        for key in ours:
            np.testing.assert_array_equal(ours[key], theirs[key])


def test_what_is_added_is_in_space_and_in_copies():
    env = wbc_suite.make("Lift", robots="Panda")
    env.reset(seed=0)
    env.observables.add("cube_height", _height, group="object-state")
    observation, *_ = env.step(env.hold_action)
    assert env.observation_space.contains(observation)
    assert observation["cube_height"] == observation["cube_pos"][2]
    assert "cube_height" in copy.deepcopy(env).observation()


def _height(model: mujoco.MjModel, data: mujoco.MjData):
    from wbc_suite.sensing.reading import computed

    body = model.body("cube").id
    return computed(1, lambda: data.xpos[body, 2:])
