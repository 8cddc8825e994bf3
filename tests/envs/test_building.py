"""Parts of environments: action spaces, control periods, samplers, start postures."""

from types import SimpleNamespace

import numpy as np
import pytest

import wbc_suite
from wbc_suite.benchmark import load_benchmark
from wbc_suite.envs.building import (
    action_space,
    compose,
    place_robots,
    use_sampler,
)
from wbc_suite.envs.config import parse_env_config
from wbc_suite.envs.states import write_physics, write_scene
from wbc_suite.errors import ConfigError, WbcError
from wbc_suite.scene.placement import SAMPLERS, UniformSampler, register_sampler


def layout(low, high):
    return SimpleNamespace(low=np.array(low), high=np.array(high))


def test_action_spaces_lie_inside_of_the_bounds():
    rng = np.random.default_rng(0)
    low = -rng.uniform(0.0, 10.0, 1000)
    high = rng.uniform(0.0, 10.0, 1000)
    space = action_space(layout(low, high))
    assert space.dtype == np.float32
    assert (space.low.astype(np.float64) >= low).all()
    assert (space.high.astype(np.float64) <= high).all()
    np.testing.assert_allclose(space.low, low, rtol=3e-7)


@pytest.mark.parametrize(
    ("frequency", "steps"),
    [(20, 25), (500, 1), (30, 17), (15, 34), (60, 9), (100, 5), (1, 500), (0.1, 5000)],
)
def test_an_action_takes_whole_physics_steps(frequency, steps):
    config = parse_env_config({"control_freq": frequency})
    assert config.substeps == steps


def test_every_rate_has_a_time_step_near_2_ms():
    for rate in np.arange(4, 2001) / 4.0:  # 1 to 500 Hz
        config = parse_env_config({"control_freq": rate})
        assert config.substeps * config.timestep == pytest.approx(1.0 / rate, rel=1e-15)
        assert 0.001 < config.timestep <= 0.002
        if (500.0 / rate).is_integer():
            assert config.timestep == 0.002
        # robosuite's scripts step so often.
        assert int((1.0 / rate) / config.timestep) == config.substeps


class Sampler:
    def sample(self, rng, objects, taken):
        return {}


def test_a_users_sampler_replaces_the_benchmarks():
    benchmark, sampler = load_benchmark("Lift"), Sampler()
    use_sampler(benchmark, parse_env_config({"placement_initializer": sampler}))
    assert benchmark.sampler is sampler


CORNER = {"x": [0.1, 0.1], "y": [0.2, 0.2]}
TABLE = {"type": "Uniform", "names": ["cube"], "region": CORNER, "origin": [0, 0, 0.8]}


def test_a_sampler_is_made_of_its_name_or_table(forget):
    forget(SAMPLERS, "mine")
    register_sampler("mine", Sampler)
    benchmark = load_benchmark("Lift")
    use_sampler(benchmark, parse_env_config({"placement_initializer": "Mine"}))
    assert type(benchmark.sampler) is Sampler
    use_sampler(benchmark, parse_env_config({"placement_initializer": TABLE}))
    assert isinstance(benchmark.sampler, UniformSampler)
    assert benchmark.sampler.region.x == (0.1, 0.1)
    both = {"type": "sequential", "samplers": [TABLE, {"type": "mine"}]}
    use_sampler(benchmark, parse_env_config({"placement_initializer": both}))
    first, second = benchmark.sampler.samplers
    assert (type(first), type(second)) == (UniformSampler, Sampler)


@pytest.mark.parametrize(
    ("given", "fault"),
    [
        ("unifrom", "No sampler named 'unifrom'. Did you mean 'uniform'"),
        ({"names": ["cube"]}, "No sampler named 'None'"),
        ({"type": "os.path:join"}, "No sampler named 'os.path:join'"),
        (TABLE | {"regin": CORNER}, "sampler 'Uniform': .*'regin'"),
        (TABLE | {"region": {"x": [0, 1]}}, "sampler: missing key 'region.y'"),
    ],
)
def test_a_fault_of_a_sampler_is_named(given, fault):
    config = parse_env_config({"placement_initializer": given})
    with pytest.raises(WbcError, match=fault):
        use_sampler(load_benchmark("Lift"), config)


def test_a_sampler_in_a_benchmarks_file_replaces_its_own(tmp_path):
    path = tmp_path / "corner.toml"
    path.write_text(
        'extends = "lift"\n[placement]\ntype = "uniform"\nnames = ["cube"]\n'
        "origin = [0, 0, 0.8]\nregion = { x = [0.1, 0.1], y = [0.2, 0.2] }\n"
    )
    benchmark = load_benchmark(path)
    use_sampler(benchmark, parse_env_config({}))
    assert benchmark.sampler.region.x == (0.1, 0.1)


def test_a_benchmark_without_objects_takes_no_sampler():
    config = parse_env_config({"placement_initializer": Sampler()})
    with pytest.raises(ConfigError, match="has no sampler to replace"):
        use_sampler(SimpleNamespace(name="Mine"), config)


def test_grippers_and_bases_are_those_asked_for():
    benchmark = load_benchmark("Lift")
    arguments = {"robots": "UR5e", "gripper_types": "PandaGripper"}
    (robot,) = place_robots(benchmark, parse_env_config(arguments))
    assert robot.synergies
    (bare,) = place_robots(
        benchmark, parse_env_config({"robots": "UR5e", "gripper_types": "none"})
    )
    assert not bare.synergies


def test_descriptions_are_taken_as_they_are():
    robot = wbc_suite.load_robot("UR5e", gripper="none")
    (placed,) = place_robots(
        load_benchmark("Lift"), parse_env_config({"robots": robot})
    )
    assert placed.name == "UR5e"
    assert not placed.synergies


def test_a_scene_has_sensors_only_if_they_are_observed():
    benchmark = load_benchmark("Lift")
    config = parse_env_config({"robots": "Panda"})
    robots = place_robots(benchmark, config)
    plain = compose(benchmark, robots, config)
    observed = compose(
        load_benchmark("Lift"), robots, parse_env_config({"use_sensor_obs": True})
    )
    names = {s.name for s in observed.sensors} - {s.name for s in plain.sensors}
    assert any(name.startswith("robot0_right_touch_") for name in names)


def test_a_scene_as_text_compiles_to_the_same_physics():
    import mujoco

    benchmark, config = load_benchmark("Lift"), parse_env_config({})
    robots = place_robots(benchmark, config)
    model = compose(benchmark, robots, config).compile()
    again = mujoco.MjModel.from_xml_string(
        write_scene(compose(load_benchmark("Lift"), robots, config))
    )
    assert (again.nq, again.nv, again.nu, again.ngeom) == (
        *(model.nq, model.nv),
        *(model.nu, model.ngeom),
    )
    np.testing.assert_allclose(again.body_mass, model.body_mass, rtol=1e-5)
    np.testing.assert_allclose(again.geom_size, model.geom_size, atol=1e-6)


@pytest.fixture
def pendulum():
    import mujoco

    xml = """<mujoco><worldbody><body><joint/><geom size=".1" pos="0 0 -1"/></body>
    </worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    return model, mujoco.MjData(model)


def test_physics_states_are_time_positions_velocities(pendulum):
    model, data = pendulum
    write_physics(model, data, [1.5, 0.2, -3.0])
    assert (data.time, data.qpos[0], data.qvel[0]) == (1.5, 0.2, -3.0)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ([1.5, 0.2], "has shape"),
        ([1.5, 0.2, -3.0, 0.0], "has shape"),
        ([1.5, 0.2, np.nan], "must be finite"),
        ([np.inf, 0.2, 0.0], "must be finite"),
    ],
)
def test_other_states_are_refused_and_change_nothing(pendulum, wrong, message):
    model, data = pendulum
    write_physics(model, data, [1.5, 0.2, -3.0])
    with pytest.raises(ConfigError, match=message):
        write_physics(model, data, wrong)
    assert (data.time, data.qpos[0], data.qvel[0]) == (1.5, 0.2, -3.0)
