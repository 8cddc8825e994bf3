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
