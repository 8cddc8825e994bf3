"""Goal versions: observations, rewards and their agreement with the simulation."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import wbc_suite
from wbc_suite.errors import ConfigError
from wbc_suite.registration import GOALS
from wbc_suite.wrappers import Goals

FAST = ("Lift", "Stack", "PickPlaceCan", "PickPlace")


def wrapper(name, **arguments):
    env = gymnasium.make(f"wbc_suite/{name}-Goal-v0", **arguments)
    while not isinstance(env, Goals):
        env = env.env
    return env


@pytest.mark.parametrize("name", FAST)
def test_the_reward_of_a_step_is_that_of_its_goals(name):
    env = wrapper(name)
    seen, info = env.reset(seed=1)
    assert env.observation_space.contains(seen)
    rng, rows = np.random.default_rng(0), []
    for _ in range(3):
        seen, reward, *_, info = env.step(rng.uniform(-1, 1, env.action_space.shape))
        offset = (seen["achieved_goal"] - seen["desired_goal"]).reshape(-1, 3)
        reached = max(map(np.linalg.norm, offset)) <= env.near
        assert reward == (0.0 if reached else -1.0)
        assert info["is_success"] == reached
        rows.append(seen)
    achieved, desired = (
        np.array([row[key] for row in rows])
        for key in ("achieved_goal", "desired_goal")
    )
    np.testing.assert_array_equal(env.compute_reward(achieved, desired, {}), [-1.0] * 3)
    np.testing.assert_array_equal(env.compute_reward(achieved, achieved, {}), [0.0] * 3)


def test_a_cube_put_on_the_other_reaches_the_goal_of_stack():
    env = wrapper("Stack")
    seen, _ = env.reset(seed=2)
    states = env.unwrapped.benchmark.states
    states["cubeA"].move(seen["desired_goal"])
    for _ in range(10):
        seen, reward, *_, info = env.step(np.zeros(env.action_space.shape))
    assert reward == 0.0
    assert info["is_success"]
    assert info["success"]  # it rests there, so the benchmark agrees
    np.testing.assert_array_equal(seen["achieved_goal"], states["cubeA"].position)


def test_goals_of_lift_are_drawn_in_the_air_and_follow_from_the_seed():
    env = wrapper("Lift")
    goals = [env.reset(seed=s)[0]["desired_goal"] for s in (3, 3, 4)]
    np.testing.assert_array_equal(goals[0], goals[1])
    assert not np.array_equal(goals[0], goals[2])
    offset = goals[0] - env.unwrapped.benchmark.config.table.center
    assert (np.abs(offset[:2]) <= 0.1).all()
    assert 0.04 <= offset[2] <= 0.2


@pytest.mark.slow
@pytest.mark.parametrize("name", GOALS)
def test_every_goal_version_passes_gymnasiums_checker(name):
    check_env(wrapper(name), skip_render_check=True)


def test_benchmarks_without_goals_are_refused():
    with pytest.raises(ConfigError, match=r"Door has no goals.*Lift"):
        Goals(wbc_suite.make("Door"))
