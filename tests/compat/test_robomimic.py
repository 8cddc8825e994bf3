# pyright: reportIndexIssue=false
# h5py's types cannot say what is in a file.
"""What robomimic's environment of robosuite asks for, in its order, and scripts too."""

import json
from copy import deepcopy

import h5py
import numpy as np
import pytest

import wbc_suite
from wbc_suite.compat import robosuite
from wbc_suite.errors import ActionError, ConfigError, UnknownNameError
from wbc_suite.recording.converting import convert
from wbc_suite.wrappers import DataCollection

OLD_CONTROLLER = {  # as in the datasets of robomimic 0.1
    "type": "OSC_POSE",
    "input_max": 1,
    "input_min": -1,
    "output_max": [0.05, 0.05, 0.05, 0.5, 0.5, 0.5],
    "output_min": [-0.05, -0.05, -0.05, -0.5, -0.5, -0.5],
    "kp": 150,
    "damping": 1,
    "impedance_mode": "fixed",
    "kp_limits": [0, 300],
    "damping_limits": [0, 10],
    "position_limits": None,
    "orientation_limits": None,
    "uncouple_pos_ori": True,
    "control_delta": True,
    "interpolation": None,
    "ramp_ratio": 0.2,
}
KWARGS = {  # of a dataset, and what the trainer puts over it
    "control_freq": 20,
    "controller_configs": OLD_CONTROLLER,
    "robots": ["Panda"],
    "camera_heights": 24,
    "camera_widths": 24,
    "camera_names": ["agentview", "robot0_eye_in_hand"],
    "render_gpu_device_id": 0,
    "reward_shaping": False,
    "has_renderer": False,
    "has_offscreen_renderer": True,
    "ignore_done": True,
    "use_object_obs": True,
    "use_camera_obs": True,
    "camera_depths": False,
    "seed": 0,
}


# what robomimic's configs of low dimension observe, for Lift with Panda
LEARNED = ["object", *(f"robot0_{k}" for k in ("eef_pos", "eef_quat", "gripper_qpos"))]


class Driver:
    """Calls an environment as robomimic's `EnvRobosuite` does; written here."""

    def __init__(self, name, **kwargs):
        major, minor = robosuite.__version__.split(".")[:2]
        assert (major, int(minor) >= 2) == ("1", True)
        self.kwargs = deepcopy(kwargs)
        self.env = robosuite.make(name, **kwargs)
        for key in self.env.observation_names:
            if "joint_pos" in key or "eef_vel" in key:
                self.env.modify_observable(
                    observable_name=key, attribute="active", modifier=True
                )

    def reset(self):
        return self.seen(self.env.reset())

    def step(self, action):
        observation, reward, done, info = self.env.step(action)
        success = self.env._check_success()
        info["is_success"] = success if isinstance(success, dict) else {"task": success}
        assert not done
        return self.seen(observation), reward, info

    def state(self):
        return {
            "model": self.env.sim.model.get_xml(),
            "states": np.array(self.env.sim.get_state().flatten()),
        }

    def reset_to(self, state):
        self.env.reset_from_xml_string(self.env.edit_model_xml(state["model"]))
        self.env.sim.reset()
        self.env.sim.set_state_from_flattened(state["states"])
        self.env.sim.forward()
        return self.seen(self.env._get_observations(force_update=True))

    def picture(self, height, width, camera):
        assert self.env.sim.model.camera_name2id(camera) >= 0
        return self.env.sim.render(height=height, width=width, camera_name=camera)[::-1]

    def seen(self, observation):
        found = {k: v[::-1] for k, v in observation.items() if k.endswith("_image")}
        found["object"] = np.array(observation["object-state"])
        for robot in self.env.robots:
            prefix = robot.robot_model.naming_prefix
            for key, value in observation.items():
                own = key.startswith(prefix) and not key.endswith("proprio-state")
                if own and key not in found:
                    found[key] = np.array(value)
        return found


@pytest.fixture(scope="module")
def driver():
    driver = Driver("Lift", **KWARGS)
    yield driver
    driver.env.close()


@pytest.mark.slow
def test_a_trainer_steps_records_and_goes_back(driver):
    first = driver.reset()
    assert {"object", "agentview_image", "robot0_eye_in_hand_image"} <= set(first)
    assert {"robot0_joint_pos", "robot0_eef_pos", "robot0_gripper_qpos"} <= set(first)
    assert "robot0_proprio-state" not in first
    action = np.zeros(driver.env.action_spec[0].shape[0])
    action[0] = 1.0
    state = driver.state()
    states, seen = [], []
    for _ in range(3):
        observation, reward, info = driver.step(action)
        assert (reward, info["is_success"]) == (0.0, {"task": False})
        states.append(driver.state()["states"])
        seen.append(observation)
    assert seen[-1]["robot0_eef_pos"][0] > first["robot0_eef_pos"][0] + 0.02
    assert driver.env.reward() == 0.0

    again = driver.reset_to({**state, "states": states[1]})
    for key in ("object", "robot0_joint_pos", "robot0_eef_pos"):
        np.testing.assert_allclose(again[key], seen[1][key], atol=1e-9)
    np.testing.assert_array_equal(again["agentview_image"], seen[1]["agentview_image"])
    np.testing.assert_array_equal(
        driver.picture(24, 24, "agentview"), again["agentview_image"]
    )
    json.dumps(driver.kwargs, sort_keys=True)  # as datasets keep them


def test_old_controllers_mean_what_they_did(driver):
    right = driver.env.env.controllers[0].config.body_parts["right"]
    assert (right.input_ref_frame, right.input_type) == ("world", "delta")
    assert np.all(np.asarray(right.kp) == 150)


@pytest.mark.slow
def test_robots_answer_scripts(driver):
    (robot,) = driver.env.robots
    assert (robot.name, robot.robot_model.naming_prefix) == ("Panda", "robot0_")
    assert (robot.arms, robot.gripper["right"].dof) == (("right",), 1)
    assert (robot.is_mobile, robot.action_dim) == (False, 7)
    assert robot._action_split_indexes["right_gripper"] == (6, 7)
    action = robot.create_action_vector({"right_gripper": [1.0]})
    np.testing.assert_array_equal(action, [0, 0, 0, 0, 0, 0, 1])
    with pytest.raises(ActionError):
        robot.create_action_vector({"right": [1.0]})
    assert robot.groups["right_gripper"]  # what else a description knows
    qpos = driver.env.sim.data.qpos[robot._ref_joint_pos_indexes]
    np.testing.assert_array_equal(
        qpos, driver.env._get_observations()["robot0_joint_pos"]
    )


@pytest.mark.slow
def test_model_and_state_answer_by_name(driver):
    sim = driver.env.sim
    raw = driver.env.env.simulation.data
    site = "gripper0_right_grip_site"
    assert site in sim.model.site_names
    assert sim.model.site_name2id("robot0_right_tcp") == sim.model.site_name2id(site)
    index = sim.model.site_name2id(site)
    assert sim.model.site_id2name(index) == site
    np.testing.assert_array_equal(sim.data.get_site_xpos(site), raw.site_xpos[index])
    assert sim.data.get_site_xmat(site).shape == (3, 3)
    assert sim.data.get_body_xquat("cube").shape == (4,)
    joint = "robot0_" + driver.env.robots[0].groups["right_arm"][0]
    sim.data.set_joint_qpos(joint, 0.25)
    assert sim.data.get_joint_qpos(joint) == [0.25]
    sim.data.time = 1.5
    assert raw.time == sim.data._data.time == 1.5
    assert driver.env.model.get_xml() == sim.model.get_xml()
    assert driver.env.model_timestep == sim.model.opt.timestep == 0.002
    with pytest.raises(UnknownNameError, match="Did you mean 'cube'"):
        sim.model.body_name2id("cubes")
    driver.env.viewer.set_camera(camera_id=0)
    driver.env.set_ep_meta({"lang": "lift it"})
    assert driver.env.get_ep_meta() == {"lang": "lift it"}
    driver.env.unset_ep_meta()
    assert driver.env.unwrapped.get_ep_meta() == {}


def test_part_controllers_come_with_their_defaults(tmp_path):
    config = robosuite.load_part_controller_config(default_controller="OSC_POSE")
    assert config["type"] == "OSC_POSE"
    assert config["output_max"][0] == 0.05
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(config))
    assert robosuite.load_part_controller_config(custom_fpath=path) == config
    with pytest.raises(UnknownNameError, match="Did you mean 'OSC_POSE'"):
        robosuite.load_part_controller_config(default_controller="OSC_POS")
    with pytest.raises(ConfigError, match="name a file or a type"):
        robosuite.load_part_controller_config()
    for name in robosuite.ALL_PART_CONTROLLERS:
        json.dumps(robosuite.load_part_controller_config(default_controller=name))


def test_all_grippers_are_listed_as_there():
    assert {"PandaGripper", "XArm7Gripper", "BDGripper", None} <= {
        *robosuite.ALL_GRIPPERS
    }
    env = robosuite.make(
        "Lift", robots="Panda", gripper_types=None, use_camera_obs=False
    )
    assert env.action_dim == 6
    assert env.robots[0].gripper["right"].dof == 0


@pytest.mark.slow
def test_what_is_converted_for_robomimic_plays_in_its_environment(tmp_path):
    """While no motor saturates: those of robosuite's Panda have other limits."""
    made = wbc_suite.make("Lift", robots="Panda", terminate_on_success=True)
    rng = np.random.default_rng(0)
    with DataCollection(made, tmp_path / "lift.hdf5") as recorded:
        recorded.reset(seed=3)
        for _ in range(10):
            recorded.step(rng.uniform(-0.05, 0.05, 7))
    out = convert(tmp_path / "lift.hdf5", tmp_path / "out.hdf5", "robomimic")
    with h5py.File(out) as file:
        meta, demo = json.loads(file["data"].attrs["env_args"]), file["data/demo_0"]
        states, actions = demo["states"][:], demo["actions"][:]
        seen, text = demo["obs/robot0_eef_pos"][:], str(demo.attrs["model_file"])
        learned = {k: demo[f"obs/{k}"][0] for k in LEARNED}
        moved = demo["next_obs/robot0_gripper_qpos"][:-1]
        np.testing.assert_array_equal(moved, demo["obs/robot0_gripper_qpos"][1:])
    assert meta["type"] == 1  # robosuite, in robomimic's EnvType
    theirs = {"has_renderer": False, "has_offscreen_renderer": False}
    theirs |= {"ignore_done": True, "use_object_obs": True, "use_camera_obs": False}
    driver = Driver(meta["env_name"], **meta["env_kwargs"], **theirs)
    driver.reset()
    first = driver.reset_to({"model": text, "states": states[0]})
    for key, value in learned.items():
        np.testing.assert_allclose(first[key], value, atol=1e-12)
    for position, action in zip(seen[1:], actions, strict=False):
        found, _, _ = driver.step(action)
        np.testing.assert_allclose(found["robot0_eef_pos"], position, atol=1e-6)
    driver.env.close()
