"""Scripts of robosuite's users, robomimic's calls and datasets' env_args run here."""

import json
import re

import h5py
import numpy as np
import pytest

from wbc_suite.compat import robosuite
from wbc_suite.compat.robosuite.environments.scene_text import WRITTEN
from wbc_suite.errors import ConfigError, DatasetError, UnknownNameError

KWARGS = {
    "robots": ["Panda"],
    "has_renderer": False,
    "has_offscreen_renderer": True,
    "ignore_done": True,
    "use_object_obs": True,
    "use_camera_obs": True,
    "camera_names": ["agentview", "robot0_eye_in_hand"],
    "camera_heights": 32,
    "camera_widths": 40,
    "camera_depths": True,
    "control_freq": 20,
    "reward_shaping": False,
    "render_gpu_device_id": 0,
    "hard_reset": False,
}


@pytest.fixture(scope="module")
def env():
    env = robosuite.make("Lift", **KWARGS)
    yield env
    env.close()


def test_a_script_runs_with_four_tuples():
    env = robosuite.make(
        env_name="Lift", robots="Panda", use_camera_obs=False, horizon=3
    )
    observation = env.reset()
    low, high = env.action_spec
    assert low.shape == high.shape == (env.action_dim,) == (7,)
    for k in range(3):
        observation, reward, done, info = env.step(np.zeros(7))
        assert done == (k == 2)
    assert reward == env.reward() == 0.0
    assert info["success"] is env._check_success() is False
    assert {"robot0_eef_pos", "cube_pos", "object-state"} <= set(observation)
    with pytest.raises(ValueError, match="terminated episode"):
        env.step(np.zeros(7))


@pytest.mark.slow
def test_pictures_are_as_robomimic_expects_them(env):
    observation = env.reset()
    cameras, view = env.env.cameras, {"width": 40, "height": 32}
    np.testing.assert_array_equal(
        observation["agentview_image"][::-1], cameras.image("agentview", **view)
    )
    d = observation["agentview_depth"]
    assert d.shape == (32, 40, 1)
    assert 0.0 <= d.min() < d.max() <= 1.0
    extent, planes = env.sim.model.stat.extent, env.sim.model.vis.map
    near, far = planes.znear * extent, planes.zfar * extent
    metres = near / (1.0 - d * (1.0 - near / far))  # what their camera_utils do
    truth = cameras.depth("agentview", **view)
    close = truth < 3.0
    np.testing.assert_allclose(metres[::-1][close], truth[close], rtol=5e-3)
    shown = env.sim.render(camera_name="agentview", width=40, height=32)
    np.testing.assert_array_equal(shown, observation["agentview_image"])


@pytest.mark.slow
def test_states_go_out_and_in_as_in_datasets(env):
    env.reset()
    env.step(np.zeros(env.action_dim))
    state, xml = env.sim.get_state().flatten(), env.sim.model.get_xml()
    seen = env._get_observations(force_update=True)
    env.reset()
    env.reset_from_xml_string(env.edit_model_xml(xml))
    env.sim.reset()
    env.sim.set_state_from_flattened(state)
    env.sim.forward()
    np.testing.assert_array_equal(env.sim.get_state().flatten(), state)
    again = env._get_observations(force_update=True)
    np.testing.assert_allclose(again["cube_pos"], seen["cube_pos"], atol=1e-12)
    np.testing.assert_allclose(again["robot0_joint_pos"], seen["robot0_joint_pos"])
    with pytest.raises(DatasetError, match="Actions do"):
        env.reset_from_xml_string("<mujoco/>")


def test_datasets_of_time_qpos_and_qvel_play_back():
    """robosuite's and robomimic's scripts compare such states, of one shape."""
    quiet = {"has_offscreen_renderer": False, "use_camera_obs": False}
    env = robosuite.make("Lift", robots="Panda", **quiet)
    env.reset()
    text, size = env.sim.model.get_xml(), 1 + env.sim.model.nq + env.sim.model.nv
    actions = np.random.default_rng(0).uniform(-0.3, 0.3, (4, env.action_dim))
    whole = [env.sim.get_state().flatten()]
    for action in actions:
        env.step(action)
        whole.append(env.sim.get_state().flatten())
    states = np.array(whole)[:, :size]
    env.reset()
    env.reset_from_xml_string(text)
    env.sim.reset()
    env.sim.set_state_from_flattened(states[0])
    env.sim.forward()
    for action, state in zip(actions, states[1:], strict=True):
        env.step(action)
        found = env.sim.get_state().flatten()
        assert found.shape == state.shape
        np.testing.assert_allclose(found, state, atol=1e-6)
    env.reset()
    assert env.sim.get_state().flatten().shape == whole[0].shape
    env.close()


@pytest.mark.parametrize(("robot", "size"), [("Panda", 7), ("Tiago", 20)])
def test_basic_without_a_robot_fits_any(robot, size):
    config = robosuite.load_composite_controller_config(controller="BASIC")
    config["body_parts"]["right"]["kp"] = 100.0
    assert config["body_parts"]["left"]["kp"] != 100.0
    env = robosuite.make(
        "Lift", robots=robot, controller_configs=config, use_camera_obs=False
    )
    assert env.action_dim == size
    env.close()


def test_a_datasets_env_args_make_its_environment(tmp_path):
    config = robosuite.load_composite_controller_config(
        controller="BASIC", robot="Panda"
    )
    told = {
        "env_name": "Lift",
        "env_version": "1.5.1",
        "type": 1,
        "env_kwargs": {**KWARGS, "use_camera_obs": False, "controller_configs": config},
    }
    path = tmp_path / "demo.hdf5"
    with h5py.File(path, "w") as file:
        file.create_group("data").attrs["env_args"] = json.dumps(told)
    env = robosuite.make_from_dataset(path)
    assert env.name == "Lift"
    assert env.control_freq == 20
    env.reset()
    assert env.step(np.zeros(env.action_dim))[2] is False
    with pytest.raises(DatasetError, match="no file"):
        robosuite.make_from_dataset(tmp_path / "none.hdf5")
    with h5py.File(path, "w") as file:
        file.create_group("data")
    with pytest.raises(DatasetError, match="no env_args"):
        robosuite.make_from_dataset(path)


def test_gym_wrapper_is_one_vector_and_five_tuples():
    env = robosuite.make("Lift", robots="Panda", use_camera_obs=False, horizon=2)
    gym = robosuite.GymWrapper(env)
    first, _ = gym.reset(seed=3)
    assert gym.observation_space.contains(first)
    again, _ = gym.reset(seed=3)
    np.testing.assert_array_equal(first, again)
    assert gym.keys == ["object-state", "robot0_proprio-state"]
    gym.step(gym.action_space.sample())
    *_, terminated, truncated, _ = gym.step(gym.action_space.sample())
    assert (terminated, truncated) == (False, True)
    keyed = robosuite.GymWrapper(env, ["cube_pos"], flatten_obs=False)
    assert set(keyed.reset()[0]) == {"cube_pos"}


def test_observations_are_corrupted_as_there(env):
    env.modify_observable("cube_pos", "corrupter", lambda values: values + 1.0)
    env.modify_observable("cube_pos", "sampling_rate", 20)
    seen = env.reset()
    assert seen["cube_pos"][2] > 1.7
    env.modify_observable("cube_pos", "corrupter", None)
    assert env.reset()["cube_pos"][2] < 1.0


def test_names_are_listed_and_unknown_ones_told():
    assert {"Lift", "Stack"} <= set(robosuite.ALL_ENVIRONMENTS)
    assert {"Panda", "GR1", "Tiago"} <= set(robosuite.ALL_ROBOTS)
    assert {"OSC_POSE", "JOINT_VELOCITY"} <= set(robosuite.ALL_PART_CONTROLLERS)
    assert {"BASIC", "WHOLE_BODY_IK"} <= set(robosuite.ALL_COMPOSITE_CONTROLLERS)
    with pytest.raises(UnknownNameError, match="Did you mean 'Lift'"):
        robosuite.make("Lif", robots="Panda")
    with pytest.raises(ConfigError, match="Did you mean 'control_freq'"):
        robosuite.make("Lift", robots="Panda", control_frequ=20)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Door", "Lift", "TwoArmPegInHole"])
@pytest.mark.parametrize("ways", ["text", "state", "edited text"])
def test_texts_and_states_restore_what_a_scene_drew(name, ways):
    robots = ["Panda", "Panda"] if name.startswith("TwoArm") else "Panda"
    quiet = {"has_offscreen_renderer": False, "use_camera_obs": False}
    env, fresh = (robosuite.make(name, robots=robots, **quiet) for _ in range(2))
    env.reset()
    rng = np.random.default_rng(0)
    actions = rng.uniform(-0.3, 0.3, (8, env.action_dim))
    for action in actions[:4]:
        env.step(action)
    text, state = env.sim.model.get_xml(), env.sim.get_state().flatten()
    model = env.sim.model._model
    drawn = {field: getattr(model, field).copy() for field in WRITTEN}
    fresh.reset()
    tolerance = 0.0
    if ways == "edited text":  # without what the scene was drawn with
        tolerance, other = 1e-4, text.replace("wbc_suite_drawn_with", "another_text")
        with pytest.raises(DatasetError, match="not this environment's"):
            fresh.reset_from_xml_string(other)
        text = re.sub(r"<text [^>]*/>", "", text)
    if ways != "state":
        fresh.reset_from_xml_string(text)
        fresh.sim.reset()
    if ways != "edited text":
        fresh.sim.set_state_from_flattened(state)
        fresh.sim.forward()
    there = fresh.sim.model._model
    for field, values in drawn.items():
        np.testing.assert_allclose(getattr(there, field), values, atol=tolerance)
    if ways != "edited text":
        np.testing.assert_array_equal(fresh.sim.get_state().flatten(), state)
        for action in actions[4:]:
            for one in (env, fresh):
                one.step(action)
        found = [one.sim.get_state().flatten() for one in (env, fresh)]
        np.testing.assert_array_equal(*found)
    for one in (env, fresh):
        one.close()
