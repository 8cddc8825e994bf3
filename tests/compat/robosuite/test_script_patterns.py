"""What public scripts do with robosuite: wrappers, samplers, pictures, configs."""

import importlib

import numpy as np
import pytest

QUIET = {"use_camera_obs": False, "has_offscreen_renderer": False}


@pytest.mark.slow
def test_a_gym_wrapper_hands_on_what_it_does_not_have(suite):
    env = suite.make("Lift", robots="Panda", seed=0, **QUIET)
    wrapped = suite.wrappers.GymWrapper(env)
    observation, _ = wrapped.reset()
    assert wrapped.sim is env.sim
    assert wrapped.robots is env.robots
    assert wrapped._check_success() is False
    assert wrapped.name == "Panda_Lift"
    assert wrapped.obs_dim == observation.size
    shapes = wrapped.modality_dims
    assert shapes == {"object-state": (10,), "robot0_proprio-state": (50,)}
    with pytest.raises(AttributeError, match="nothing"):
        wrapped.nothing  # noqa: B018 - the access is what is tested
    env.close()


@pytest.mark.slow
def test_a_sampler_of_robosuite_places_the_objects_of_our_tasks(suite):
    module = importlib.import_module("robosuite.utils.placement_samplers")

    def at(name, x, y):
        return module.UniformRandomSampler(
            name=name,
            x_range=[x, x],
            y_range=[y, y],
            rotation=0.5,
            ensure_object_boundary_in_range=False,
            reference_pos=(0, 0, 0.8),
            z_offset=0.01,
        )

    env = suite.make(
        "Lift", robots="Panda", placement_initializer=at("one", 0.1, -0.1), **QUIET
    )
    seen = env.reset()
    np.testing.assert_allclose(seen["cube_pos"][:2], [0.1, -0.1], atol=1e-9)
    lowest = seen["cube_pos"][2] + env.cube.bottom_offset[2]
    assert lowest == pytest.approx(0.81, abs=1e-6)
    angle = 2.0 * np.arcsin(abs(seen["cube_quat"][2]))
    assert angle == pytest.approx(0.5, abs=1e-9)
    env.close()
    several = module.SequentialCompositeSampler("all")
    several.append_sampler(at("SquareNutSampler", -0.1, 0.15))
    several.append_sampler(at("RoundNutSampler", -0.1, -0.15))
    env = suite.make(
        "NutAssembly", robots="Panda", placement_initializer=several, **QUIET
    )
    seen = env.reset()
    np.testing.assert_allclose(seen["SquareNut_pos"][:2], [-0.1, 0.15], atol=1e-9)
    np.testing.assert_allclose(seen["RoundNut_pos"][:2], [-0.1, -0.15], atol=1e-9)
    assert set(env.obj_body_id) == {"SquareNut", "RoundNut"}
    assert env.SquareNut_body_id == env.sim.model.body_name2id("SquareNut_main")
    env.close()


@pytest.mark.slow
def test_pictures_follow_the_image_convention(suite, monkeypatch):
    env = suite.make(
        "Lift",
        robots="Panda",
        camera_names=["agentview", "robot0_eye_in_hand"],
        camera_heights=[16, 24],
        camera_widths=16,
        seed=0,
    )
    assert env.camera_names == ["agentview", "robot0_eye_in_hand"]
    assert (env.camera_heights, env.camera_widths) == ([16, 24], [16, 16])
    upside_down = env.reset()["agentview_image"]
    monkeypatch.setattr(suite.macros, "IMAGE_CONVENTION", "opencv")
    upright = env._get_observations(force_update=True)["agentview_image"]
    np.testing.assert_array_equal(upright, upside_down[::-1])
    assert np.abs(upright.astype(int) - upside_down).max() > 20
    env.close()


@pytest.mark.slow
def test_parts_and_grippers_tell_what_they_are(suite):
    config = suite.load_composite_controller_config(controller="BASIC", robot="Baxter")
    config["body_parts"]["left"]["output_max"] = 0.1
    env = suite.make("TwoArmLift", robots="Baxter", controller_configs=config, **QUIET)
    env.reset()
    robot = env.robots[0]
    parts = {"right", "left", "right_gripper", "left_gripper"}
    assert set(robot.part_controller_config) == parts
    assert robot.part_controller_config["left_gripper"]["type"] == "GRIP"
    np.testing.assert_allclose(robot.part_controllers["left"].output_max, 0.1)
    assert robot.part_controllers["left"].input_max.shape == (6,)
    assert [type(g).__name__ for g in robot.gripper.values()] == ["RethinkGripper"] * 2
    assert robot.robot_model.default_base == "RethinkMinimalMount"
    env.close()


@pytest.mark.slow
def test_an_environment_steps_without_a_reset_before(suite):
    """As in robosuite's page of sensors, whose filter fills a buffer."""
    buffers = importlib.import_module("robosuite.utils.buffers")
    env = suite.make("Lift", robots="Panda", control_freq=10, seed=3, **QUIET)
    buffer = buffers.RingBuffer(dim=env.robots[0].robot_model.dof, length=10)

    def keep(values):
        buffer.push(values)
        return values

    env.modify_observable("robot0_joint_pos", "filter", keep)
    env.modify_observable("robot0_joint_pos", "sampling_rate", 40)
    env.step(np.ones(env.action_dim))
    assert env.timestep == 1
    assert buffer._size == 4  # one at the start, three later in 0.1 s
    np.testing.assert_allclose(buffer.current, env.robots[0]._joint_positions, atol=0.1)
    reached = env.sim.data.qpos.copy()
    other = suite.make("Lift", robots="Panda", control_freq=10, seed=3, **QUIET)
    other.reset()
    other.step(np.ones(env.action_dim))
    np.testing.assert_array_equal(other.sim.data.qpos, reached)
    env.close()
    other.close()


@pytest.mark.slow
def test_a_scene_of_a_text_is_not_reset_by_the_first_step(suite):
    env = suite.make("Lift", robots="Panda", seed=0, **QUIET)
    env.reset_from_xml_string(env.sim.model.get_xml())
    env.sim.data.set_joint_qpos("cube_joint0", [0.2, 0.2, 0.9, 1, 0, 0, 0])
    env.sim.forward()
    seen, *_ = env.step(np.zeros(env.action_dim))
    np.testing.assert_allclose(seen["cube_pos"][:2], [0.2, 0.2], atol=1e-3)
    env.close()


@pytest.mark.slow
def test_a_disabled_observation_is_not_returned(suite):
    env = suite.make("Lift", robots="Panda", seed=0, **QUIET)
    size = env.reset()["object-state"].size
    env.modify_observable("cube_quat", "enabled", False)
    seen, *_ = env.step(np.zeros(env.action_dim))
    assert "cube_quat" not in seen
    assert seen["object-state"].size == size - 4
    assert "cube_quat" not in env.enabled_observables
    assert "cube_quat" in env.active_observables
    env.close()


@pytest.mark.slow
def test_a_class_of_a_user_moves_on_the_base_that_it_names(suite):
    robots = importlib.import_module("robosuite.robots")
    models = importlib.import_module("robosuite.models.robots")

    @robots.register_robot_class("WheeledRobot")
    class WheeledPanda(models.Panda):
        @property
        def default_base(self):
            return "OmronMobileBase"

    config = suite.load_composite_controller_config(
        controller="BASIC", robot="WheeledPanda"
    )
    env = suite.make("Lift", robots="WheeledPanda", controller_configs=config, **QUIET)
    env.reset()
    assert env.action_dim == 11  # as in robosuite: arm, torso, base, gripper
    action = np.zeros(11)
    action[7] = 1.0
    start = np.array(env.sim.data.get_body_xpos("robot0_panda_link0"))
    for _ in range(5):
        env.step(action)
    moved = env.sim.data.get_body_xpos("robot0_panda_link0") - start
    assert moved[0] > 0.02
    env.close()
