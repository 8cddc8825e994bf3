"""What robosuite's own tests check, restated: environments, robots, renderers, ..."""

import importlib

import numpy as np
import pytest

SINGLE = ("Lift", "Stack", "NutAssembly", "PickPlace", "Door", "Wipe", "ToolHang")
DOUBLE = ("TwoArmLift", "TwoArmPegInHole", "TwoArmHandover", "TwoArmTransport")
ARMS = ("Panda", "Sawyer", "IIWA", "Jaco", "Kinova3", "UR5e", "XArm7")
MOBILE = ("PandaOmron", "Tiago", "GR1", "GR1FixedLowerBody", "GR1ArmsOnly")
PARTS = ("OSC_POSE", "OSC_POSITION", "JOINT_POSITION", "JOINT_VELOCITY")
PARTS += ("JOINT_TORQUE", "IK_POSE")
GRIPPERS = ("PandaGripper", "RethinkGripper", "Robotiq85Gripper", "Robotiq140Gripper")
GRIPPERS += ("RobotiqThreeFingerGripper", "JacoThreeFingerGripper", "XArm7Gripper")
QUIET = {"use_camera_obs": False, "has_offscreen_renderer": False}


def drive(env, steps=3):
    """Reset and take random actions within the limits; return the last observation."""
    seen = env.reset()
    low, high = env.action_spec
    assert low.shape == high.shape == (env.action_dim,)
    rng = np.random.default_rng(0)
    for _ in range(steps):
        action = rng.uniform(np.maximum(low, -1.0), np.minimum(high, 1.0))
        seen, reward, done, info = env.step(action)
        assert np.isfinite(reward)
        assert isinstance(done, bool)
        assert isinstance(info, dict)
    assert all(np.isfinite(values).all() for values in seen.values())
    return seen


@pytest.mark.slow
@pytest.mark.parametrize("name", SINGLE)
def test_single_arm_environments(suite, name):
    env = suite.make(name, robots="Panda", reward_shaping=True, seed=0, **QUIET)
    seen = drive(env)
    assert "object-state" in seen
    assert "robot0_proprio-state" in seen
    env.close()


@pytest.mark.slow
@pytest.mark.parametrize("name", DOUBLE)
@pytest.mark.parametrize("robots", [["Panda", "Sawyer"], "Baxter"])
def test_two_arm_environments(suite, name, robots):
    how = "bimanual" if robots == "Baxter" else "opposed"
    env = suite.make(name, robots=robots, env_configuration=how, seed=0, **QUIET)
    drive(env)
    assert env._eef0_xpos.shape == env._eef1_xquat[:3].shape == (3,)
    env.close()


@pytest.mark.slow
@pytest.mark.parametrize("robot", [*ARMS, *MOBILE])
def test_robots(suite, robot):
    env = suite.make("Lift", robots=robot, seed=0, **QUIET)
    drive(env, 2)
    assert type(env.robots[0]) is suite.robots.ROBOT_CLASS_MAPPING[robot]
    assert env.robots[0].is_mobile == (robot in ("PandaOmron", "Tiago"))
    env.close()


@pytest.mark.slow
@pytest.mark.parametrize("gripper", GRIPPERS)
def test_grippers_on_an_arm(suite, gripper):
    env = suite.make("Lift", robots="Panda", gripper_types=gripper, seed=0, **QUIET)
    drive(env, 2)
    found = env.robots[0].gripper["right"]
    assert found.name == gripper
    assert found.dof == env.action_dim - 6
    assert all(env.sim.model.joint_name2id(joint) >= 0 for joint in found.joints)
    assert all(env.sim.model.geom_name2id(geom) >= 0 for geom in found.contact_geoms)
    env.close()


@pytest.mark.slow
@pytest.mark.parametrize("part", PARTS)
def test_part_controllers(suite, part):
    config = suite.load_composite_controller_config(controller="BASIC")
    arm = suite.load_part_controller_config(default_controller=part)
    config["body_parts"]["right"] = {**arm, "gripper": {"type": "GRIP"}}
    env = suite.make("Lift", robots="Panda", controller_configs=config, **QUIET)
    drive(env)
    controller = env.robots[0].part_controllers["right"]
    assert controller.name == part
    assert controller.control_dim == env.action_dim - 1
    env.close()


@pytest.mark.slow
def test_composite_controllers(suite):
    for robot, name in (("Panda", "BASIC"), ("PandaOmron", "HYBRID_MOBILE_BASE")):
        config = suite.load_composite_controller_config(controller=name)
        env = suite.make("Lift", robots=robot, controller_configs=config, **QUIET)
        env.reset()
        controller = env.robots[0].composite_controller
        action = np.linspace(-0.5, 0.5, env.action_dim)
        parts = controller.create_action_dict_from_action_vector(action)
        back = controller.create_action_vector(parts)
        np.testing.assert_array_equal(back, action)
        env.close()


@pytest.mark.slow
def test_equal_seeds_give_equal_episodes_and_others_do_not(suite):
    def episode(seed):
        env = suite.make("Lift", robots="Panda", seed=seed, **QUIET)
        seen = [env.reset()["object-state"]]
        rng = np.random.default_rng(1)
        for _ in range(5):
            env.step(rng.uniform(-1, 1, env.action_dim))
        return np.concatenate([seen[0], env.sim.get_state().flatten()])

    np.testing.assert_array_equal(episode(4), episode(4))
    assert np.abs(episode(4) - episode(5)).max() > 1e-3


@pytest.mark.slow
def test_actions_play_back(suite):
    env = suite.make("Stack", robots="Panda", seed=2, **QUIET)
    env.reset()
    start, text = env.sim.get_state().flatten(), env.sim.model.get_xml()
    rng = np.random.default_rng(3)
    actions = rng.uniform(-1, 1, (10, env.action_dim))
    states = []
    for action in actions:
        env.step(action)
        states.append(env.sim.get_state().flatten())
    env.reset()
    env.reset_from_xml_string(text)
    env.sim.set_state_from_flattened(start)
    env.sim.forward()
    for action, state in zip(actions, states, strict=True):
        env.step(action)
        np.testing.assert_allclose(env.sim.get_state().flatten(), state, atol=1e-6)


@pytest.mark.slow
def test_camera_transforms_find_the_cube_in_its_picture(suite):
    camera_utils = importlib.import_module("robosuite.utils.camera_utils")
    size = 96
    env = suite.make(
        "Lift",
        robots="Panda",
        camera_names="agentview",
        camera_heights=size,
        camera_widths=size,
        camera_depths=True,
        seed=0,
    )
    seen = env.reset()
    view = env.sim, "agentview", size, size
    to_pixels = camera_utils.get_camera_transform_matrix(*view)
    depth = camera_utils.get_real_depth_map(env.sim, seen["agentview_depth"][::-1])
    cube = seen["cube_pos"]
    pixel = camera_utils.project_points_from_world_to_camera(
        cube, to_pixels, size, size
    )
    found = camera_utils.transform_from_pixels_to_world(
        pixel, depth, np.linalg.inv(to_pixels)
    )
    assert np.linalg.norm(found - cube) < 0.045  # the surface, 0.02 m before the middle
    red, green, blue = seen["agentview_image"][::-1][tuple(pixel)].astype(int)
    assert red > green
    assert red > blue
    env.close()


def test_linear_interpolator_reaches_its_goal_in_time(suite):
    module = importlib.import_module("robosuite.utils.traj_utils")
    T = importlib.import_module("robosuite.utils.transform_utils")
    moves = module.LinearInterpolator(3, controller_freq=500, policy_freq=20)
    moves.set_goal([1.0, 0.0, -1.0])
    steps = [moves.get_interpolated_goal() for _ in range(6)]
    np.testing.assert_allclose(np.diff(steps, axis=0)[:4, 0], 0.2)
    np.testing.assert_array_equal(steps[-1], [1.0, 0.0, -1.0])
    turns = module.LinearInterpolator(4, 500, 20, ori_interpolate="quat")
    goal = T.axisangle2quat([0.0, 0.0, 1.0])
    turns.set_goal(goal)
    angles = [T.quat2axisangle(turns.get_interpolated_goal())[2] for _ in range(5)]
    np.testing.assert_allclose(angles, [0.2, 0.4, 0.6, 0.8, 1.0], atol=1e-9)
    with pytest.raises(ValueError, match="4 values"):
        turns.set_goal([0.0, 1.0])


@pytest.mark.slow
def test_wrappers(suite, tmp_path):
    wrappers = suite.wrappers
    env = suite.make("Lift", robots="Panda", seed=0, horizon=4, **QUIET)
    recorded = wrappers.DataCollectionWrapper(env, str(tmp_path))
    drive(recorded, 3)
    recorded.reset()
    [folder] = tmp_path.iterdir()
    [file] = folder.glob("state_*.npz")
    data = np.load(file, allow_pickle=True)
    size = 1 + env.sim.model.nq + env.sim.model.nv
    # robosuite's from_flattened takes time, qpos and qvel, and ignores what follows
    assert data["states"].shape == (3, len(env.sim.get_state().flatten()))
    np.testing.assert_array_equal(
        np.diff(data["states"][:, :size], axis=0)[:, 0] > 0.0, True
    )
    assert data["action_infos"][0]["actions"].shape == (7,)
    assert (folder / "model.xml").read_text().startswith("<mujoco")
    varied = wrappers.DomainRandomizationWrapper(env, seed=0, randomize_color=False)
    masses = env.sim.model.body_mass.copy()
    drive(varied, 1)
    assert np.abs(env.sim.model.body_mass - masses).max() > 0.0
    varied.restore_default_domain()
    np.testing.assert_allclose(env.sim.model.body_mass[5:], masses[5:], rtol=1e-9)
    marks = ["goal", {"type": "sphere"}]
    marked = wrappers.VisualizationWrapper(env, indicator_configs=marks)
    assert marked.get_indicator_names() == ["goal", "indicator1"]
    marked.set_indicator_pos("goal", [0.0, 0.1, 1.0])
    np.testing.assert_array_equal(marked.indicator_places["goal"], [0.0, 0.1, 1.0])
    with pytest.raises(LookupError, match="'end'"):
        marked.set_indicator_pos("end", [0, 0, 0])
    shown = wrappers.VisualizationWrapper(env)
    assert shown.get_visualization_settings() == {"env", "robots", "grippers"}
    assert shown.unwrapped is env


@pytest.mark.slow
def test_observables_are_delayed_corrupted_and_switched(suite):
    module = importlib.import_module("robosuite.utils.observables")
    env = suite.make("Lift", robots="Panda", seed=0, **QUIET)
    env.reset()
    low, high = env.action_spec
    env.modify_observable(
        "robot0_joint_pos", "delayer", module.create_deterministic_delayer(0.03)
    )
    seen, *_ = env.step(high)
    late = seen["robot0_joint_pos"]
    now = env.robots[0]._joint_positions
    assert np.abs(late - now).max() > 1e-5
    env.modify_observable("robot0_joint_pos", "delayer", None)
    corrupt = module.create_deterministic_corrupter(0.5)
    env.modify_observable("cube_pos", "corrupter", corrupt)
    seen, *_ = env.step(0.0 * low)
    truth = env.sim.data.get_body_xpos("cube_main")
    np.testing.assert_allclose(seen["cube_pos"], truth + 0.5, atol=1e-9)
    env.modify_observable("cube_pos", "active", False)
    assert "cube_pos" not in env.step(0.0 * low)[0]
    assert "cube_pos" not in env.active_observables
    env.modify_observable("cube_quat", "enabled", False)
    assert "cube_quat" not in env.step(0.0 * low)[0]  # as in robosuite 1.5
    env.modify_observable("cube_quat", "enabled", True)
    np.testing.assert_array_equal(
        env.step(0.0 * low)[0]["cube_quat"],
        np.roll(env.sim.data.get_body_xquat("cube_main"), -1),
    )


def test_unknown_renderers_are_refused(suite):
    for name in ("mjviewer", "mujoco"):
        assert suite.renderers.load_renderer_config(name) == {}
    with pytest.raises(ValueError, match="no renderer"):
        suite.renderers.load_renderer_config("igibson")
