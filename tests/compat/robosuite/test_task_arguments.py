"""Arguments of robosuite's tasks: tables, objects, and the `task_config` of Wipe."""

import importlib

import numpy as np
import pytest

from wbc_suite.errors import ConfigError

pytestmark = pytest.mark.slow
QUIET = {"use_camera_obs": False, "has_offscreen_renderer": False}


def made(suite, name, **arguments):
    robots = ["Panda"] * 2 if name.startswith("TwoArm") else "Panda"
    env = suite.make(name, robots=robots, seed=0, **QUIET, **arguments)
    env.reset()
    env.step(np.zeros(env.action_dim))
    return env


def table_of(env, name="table"):
    """Return edges, place and friction of a table in the compiled scene."""
    model = env.sim.model
    k = model.geom_name2id(name)
    top = env.sim.data.geom_xpos[k] + [0.0, 0.0, model.geom_size[k, 2]]
    return 2.0 * model.geom_size[k], top, model.geom_friction[k]


@pytest.mark.parametrize("name", ["Lift", "Stack", "NutAssembly", "TwoArmLift"])
def test_tables_have_the_size_and_friction_that_are_given(suite, name):
    size, friction = (0.7, 0.9, 0.04), (0.5, 0.01, 0.0002)
    env = made(suite, name, table_full_size=size, table_friction=friction)
    found = table_of(env)
    np.testing.assert_allclose(found[0], size)
    np.testing.assert_allclose(found[2], friction)
    np.testing.assert_allclose(env.table_full_size, size)


def test_half_tables_of_two_arms_come_from_the_whole(suite):
    env = made(suite, "TwoArmHandover", table_full_size=(0.8, 1.6, 0.05))
    size, top, _ = table_of(env)
    np.testing.assert_allclose(size, [0.8, 0.4, 0.05])
    np.testing.assert_allclose(top, [0.0, -0.6, 0.8])
    with pytest.raises(ConfigError, match="prehensile = False"):
        made(suite, "TwoArmHandover", prehensile=False)


@pytest.mark.parametrize(
    ("name", "arguments", "keys"),
    [
        ("PickPlace", {"single_object_mode": 2, "object_type": "can"}, {"Can_pos"}),
        ("PickPlace", {"single_object_mode": 1}, {"obj_pos"}),
        (
            "NutAssembly",
            {"single_object_mode": 2, "nut_type": "round"},
            {"RoundNut_pos"},
        ),
        ("NutAssembly", {}, {"RoundNut_pos", "SquareNut_pos"}),
    ],
)
def test_objects_are_those_that_are_given(suite, name, arguments, keys):
    env = made(suite, name, **arguments)
    seen = env._get_observations()
    assert {k for k in seen if k.endswith("_pos") and k[:3] != "rob"} >= keys
    assert sum(k.endswith("_to_robot0_eef_pos") for k in seen) == len(keys)


def test_bins_doors_and_pegs_are_as_they_are_given(suite):
    place, yaw = np.array([0.1, -0.3, 0.85]), (0.2, 0.3)
    env = made(suite, "PickPlace", bin1_pos=place, z_rotation=yaw)
    milk = env.sim.data.get_body_xpos("Milk_main")
    assert np.all(np.abs(milk - place) < [0.15, 0.2, 0.15])
    latched, free = (made(suite, "Door", use_latch=on) for on in (True, False))
    assert "handle_qpos" in latched.active_observables
    assert "handle_qpos" not in free.active_observables
    env = made(suite, "TwoArmPegInHole", peg_radius=(0.021, 0.022), peg_length=0.1)
    sizes = env.sim.model.geom_size[:, :2]
    long = sizes[np.isclose(sizes[:, 1], 0.1)]
    assert np.any((long[:, 0] > 0.0209) & (long[:, 0] < 0.0221))


def test_an_argument_of_another_task_is_an_error(suite):
    with pytest.raises(ConfigError, match="Lift does not have all of: use_latch"):
        made(suite, "Lift", use_latch=False)


def test_wipe_takes_robosuites_config(suite):
    module = importlib.import_module("robosuite.environments.manipulation.wipe")
    default = module.DEFAULT_WIPE_CONFIG
    config = default | {"num_markers": 40, "line_width": 0.05, "table_height": -0.03}
    env = made(suite, "Wipe", task_config=config)
    model = env.sim.model
    marks = [k for k in model.geom_names if k.startswith("mark")]
    assert len(marks) == 40
    assert model.geom_size[model.geom_name2id("mark0"), 0] == pytest.approx(0.025)
    assert table_of(env)[1][2] == pytest.approx(0.87)
    assert env.sim.data.get_geom_xpos("mark0")[2] == pytest.approx(0.87)
    with pytest.raises(ConfigError, match="two_clusters = True"):
        made(suite, "Wipe", task_config=default | {"two_clusters": True})


def test_heights_of_wipes_table_are_drawn_around_the_same_one(suite):
    module = importlib.import_module("robosuite.environments.manipulation.wipe")
    config = module.DEFAULT_WIPE_CONFIG | {"table_height_std": 0.02}
    env = made(suite, "Wipe", task_config=config)
    heights = []
    for _ in range(12):
        env.reset()
        heights.append(env.table_offset[2])
        assert table_of(env)[1][2] == pytest.approx(heights[-1])
    assert max(heights) == 0.9  # it is lowered only
    assert 0.85 < min(heights) < 0.9
    assert len({round(h, 6) for h in heights}) > 3


def test_the_gl_backend_is_that_of_the_environment_variable(suite):
    backend = importlib.import_module("robosuite.utils.gl_backend")
    gpu, no_gpu = suite.macros, type("Macros", (), {"MUJOCO_GPU_RENDERING": False})
    environ = {"MUJOCO_GL": "glfw"}
    assert backend.configure_mujoco_gl_backend(gpu, environ, "Linux") == "glfw"
    assert backend.resolve_mujoco_gl_backend(gpu, {}, "Linux") == "egl"
    assert backend.resolve_mujoco_gl_backend(no_gpu, {}, "Linux") == ""
    assert backend.configure_mujoco_gl_backend(gpu, empty := {}, "Darwin") == "cgl"
    assert empty == {"MUJOCO_GL": "cgl"}
