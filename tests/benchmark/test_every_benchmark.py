"""What every benchmark holds, by walking the list of them."""

import gymnasium
import numpy as np
import pytest
from conftest import penetration, speeds

import wbc_suite
from wbc_suite.benchmark import BENCHMARKS
from wbc_suite.registration import WITH_ID, environment_id

NAMES = sorted(BENCHMARKS)


@pytest.fixture(scope="module", params=NAMES)
def env(request):
    env = wbc_suite.make(request.param, reward_shaping=True)
    yield env
    env.close()


def test_every_benchmark_has_an_id():
    assert set(NAMES) == set(WITH_ID)
    for name in NAMES:
        assert environment_id(name) in gymnasium.registry


@pytest.mark.sample(8)
@pytest.mark.slow
def test_random_actions_leave_everything_in_bounds(env):
    env.reset(seed=0)
    env.action_space.seed(0)
    for _ in range(500):
        observation, reward, terminated, _, info = env.step(env.action_space.sample())
        assert "physics_error" not in info
        assert 0.0 <= reward <= 1.0
        assert (reward == 1.0) == info["success"]
        assert env.benchmark.reward(shaped=False) == float(info["success"])
        assert env.observation_space.contains(observation)
        assert terminated == ("failure" in info)
        if terminated:
            assert not info["success"]
            env.reset()


def test_no_reset_recompiles_and_seeds_repeat(env):
    simulation = env.simulation
    first, _ = env.reset(seed=3)
    env.step(env.action_space.sample())
    other, _ = env.reset(seed=4)
    again, _ = env.reset(seed=3)
    assert env.simulation is simulation
    assert any((first[k] != other[k]).any() for k in first)
    for key, value in first.items():
        np.testing.assert_array_equal(value, again[key])


@pytest.mark.slow
def test_things_start_apart_and_at_rest(env):
    for seed in range(50):
        _, info = env.reset(seed=seed)
        assert not info["success"]
        assert penetration(env) < 5e-4
        assert env.benchmark.reward(shaped=True) < 1.0
        for _ in range(10):
            env.step(env.hold_action)
        assert all(speed < 0.01 for speed in speeds(env).values()), (seed, speeds(env))
