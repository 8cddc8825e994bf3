import numpy as np
import pytest
from feet import count, hold, lie_at, make, stand_at

import wbc_suite
from wbc_suite.errors import ConfigError
from wbc_suite.evaluation import make_policy

ACTIONS, HOLD = 380, 20


@pytest.fixture(scope="module")
def env():
    return make("Stand", "Spot", reward_shaping=True)


def test_only_all_actions_and_a_rest_are_a_success(env):
    env.reset(seed=0)
    stand_at(env, 0.0, 0.0)
    task = count(env, ACTIONS - 6)  # five actions are taken
    assert not task.success()
    assert task.reward(shaped=True) == pytest.approx(0.95, abs=0.01)
    assert count(env, 1).success()
    assert task.reward(shaped=True) == 1.0


def test_a_robot_that_rests_elsewhere_has_no_success_and_less_reward(env):
    env.reset(seed=0)
    stand_at(env, 0.0, 0.0)
    there = env.benchmark.reward(shaped=True)
    for x, yaw in ((0.12, 0.0), (-0.12, 0.0), (0.0, 0.2), (0.0, -0.2)):
        stand_at(env, x, 0.0, yaw)
        task = count(env, 2 * ACTIONS)
        assert task.standing.rests
        assert not task.success()
        assert task.reward(shaped=True) == pytest.approx(
            there - 0.2 * np.tanh(abs(x)), abs=0.01
        )
    stand_at(env, 0.05, 0.0, 0.1)
    assert count(env, 2 * HOLD).success()


def test_the_way_back_is_observed_and_begins_at_zero(env):
    for seed in (3, 4):
        seen, _ = env.reset(seed=seed)
        assert np.abs(seen["robot_to_start"]).max() < 1e-3
        stand_at(env, 1.0, 0.5, np.pi / 2)
        seen, *_ = env.step(env.hold_action)
        assert seen["robot_to_start"] == pytest.approx(
            [-0.5, 1.0, -np.pi / 2], abs=0.02
        )


@pytest.mark.slow
def test_holding_does_not_solve_it_and_returning_does(env):
    solved = {"hold": 0, "expert": 0}
    for name in solved:
        for seed in (1, 2):
            seen, _ = env.reset(seed=seed)
            policy = make_policy(name, env, seed)
            for _ in range(env.horizon):
                seen, *_, info = env.step(policy(seen))
                if info["success"]:
                    solved[name] += 1
                    break
    assert solved == {"hold": 0, "expert": 2}


def test_pushes_act_on_the_trunk_for_a_tenth_of_a_second(env):
    env.reset(seed=3)
    data, trunk = env.simulation.data, env.benchmark.standing.trunk
    first = env.benchmark.pushes[0]
    assert 150.0 <= np.linalg.norm(first.force) <= 300.0
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
    assert moving == pytest.approx(still - 0.25 * np.tanh(1.0), abs=0.01)


def test_robots_on_bases_are_refused():
    with pytest.raises(ConfigError, match="Stand is for robots on feet"):
        wbc_suite.make("Stand", robots="PandaOmron")
