import numpy as np
import pytest
from feet import count, hold, lie_at, make, stand_at

import wbc_suite
from wbc_suite.errors import ConfigError

ACTIONS, HOLD = 380, 20


@pytest.fixture(scope="module")
def env():
    return make("Stand", "Spot", reward_shaping=True)


def test_only_all_actions_and_a_rest_are_a_success(env):
    env.reset(seed=0)
    stand_at(env, 0.0, 0.0)
    task = count(env, ACTIONS - 6)  # five actions are taken
    assert not task.success()
    assert task.reward(shaped=True) == pytest.approx(0.9, abs=0.01)
    assert count(env, 1).success()
    assert task.reward(shaped=True) == 1.0


@pytest.mark.slow
def test_spot_withstands_the_pushes_and_the_episode_succeeds(env):
    env.reset(seed=1)
    successes = []
    for _ in range(env.horizon):
        *_, terminated, _, info = env.step(env.hold_action)
        assert not terminated
        successes.append(info["success"])
    assert not any(successes[: ACTIONS - 1])
    assert successes[-1]


def test_pushes_act_on_the_trunk_for_a_tenth_of_a_second(env):
    env.reset(seed=3)
    data, trunk = env.simulation.data, env.benchmark.standing.trunk
    first = env.benchmark.pushes[0]
    assert 200.0 <= np.linalg.norm(first.force) <= 400.0
    before, after = int(first.start / 0.05), int(np.ceil(first.stop / 0.05))
    speed = 0.0
    for k in range(after + 1):
        assert k > before or speed < 0.02
        env.step(env.hold_action)
        speed = env.benchmark.standing.speed
    assert speed > 0.05
    assert not data.xfrc_applied[trunk].any()


def test_pushes_end_before_the_last_second_and_follow_the_seed(env):
    env.reset(seed=5)
    first = env.benchmark.pushes
    assert 6 <= len(first) <= 11
    assert first[-1].stop <= 17.0
    env.reset(seed=6)
    assert env.benchmark.pushes != first
    env.reset(seed=5)
    assert env.benchmark.pushes == first


def test_walking_at_the_end_is_no_success(env):
    env.reset(seed=0)
    stand_at(env, 0.0, 0.0)
    count(env, ACTIONS - HOLD - 5)
    for _ in range(2 * HOLD):
        *_, info = hold(env, 1, walk=[0.3, 0.0, 0.0])
        assert not info["success"]


def test_a_fall_at_the_beginning_spoils_the_episode(env):
    env.reset(seed=0)
    lie_at(env, 0.0, 0.0)
    _, reward, terminated, _, info = env.step(env.hold_action)
    assert terminated
    assert reward == 0.0
    assert "Spot fell" in info["failure"]
    stand_at(env, 0.0, 0.0)  # and stands up again
    task = count(env, 2 * ACTIONS)
    assert task.standing.rests
    assert not task.success()
    assert task.failure() is not None


def test_the_reward_falls_with_tilt_and_speed(env):
    env.reset(seed=0)
    stand_at(env, 0.0, 0.0)
    still = env.benchmark.reward(shaped=True)
    env.simulation.data.qvel[0] = 0.5
    moving = env.benchmark.reward(shaped=True)
    assert moving == pytest.approx(still - 0.3 * np.tanh(1.0), abs=0.01)


def test_robots_on_bases_are_refused():
    with pytest.raises(ConfigError, match="Stand is for robots on feet"):
        wbc_suite.make("Stand", robots="PandaOmron")
