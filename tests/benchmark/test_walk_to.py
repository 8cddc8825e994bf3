import math

import gymnasium
import numpy as np
import pytest
from feet import count, hold, lie_at, make, stand_at

import wbc_suite
from wbc_suite.errors import ConfigError

HOLD = 20


@pytest.fixture(scope="module")
def env():
    return make("WalkTo", "Spot", reward_shaping=True)


def goal_at(env, x, y, yaw=0.0):
    quat = (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
    env.benchmark.states["goal"].move((x, y, 0.002), quat)
    env.simulation.forward()


def test_resting_at_the_mark_for_twenty_actions_is_a_success(env):
    env.reset(seed=0)
    goal_at(env, 1.0, 0.5, 0.3)
    stand_at(env, 1.0, 0.5, 0.3)
    env.benchmark.standing.observe(False)
    for k in range(HOLD):
        assert not env.benchmark.success(), k
        _, reward, terminated, _, info = env.step(env.hold_action)
    assert info["success"]
    assert reward == 1.0
    assert not terminated
    assert "failure" not in info


@pytest.mark.parametrize(
    "pose",
    [
        (1.11, 0.0, 0.0),
        (1.0, -0.11, 0.0),
        (1.0, 0.0, 0.16),
        (1.0, 0.0, -0.16),
        (1.0, 0.0, math.pi),
    ],
)
def test_near_misses_are_no_success(env, pose):
    env.reset(seed=0)
    goal_at(env, 1.0, 0.0)
    stand_at(env, *pose)
    assert env.benchmark.standing.rests
    task = count(env, 2 * HOLD)
    assert not task.success()
    assert task.reward(shaped=False) == 0.0
    assert 0.0 < task.reward(shaped=True) < 1.0


def test_passing_through_the_mark_without_a_stop_is_no_success(env):
    env.reset(seed=0)
    goal_at(env, 1.0, 0.0)
    nearest = math.inf
    for _ in range(80):
        observation, *_, info = hold(env, 1, walk=[0.5, 0.0, 0.0])
        nearest = min(nearest, math.hypot(*observation["robot_to_goal"][:2]))
        assert not info["success"]
    assert nearest < 0.05
    assert observation["robot_to_goal"][0] < -0.5


def test_trotting_on_the_spot_of_the_mark_is_no_success(env):
    env.reset(seed=0)
    goal_at(env, 0.0, 0.0)
    stand_at(env, 0.0, 0.0)
    for _ in range(3 * HOLD):
        *_, info = hold(env, 1, walk=[0.0, 0.0, 0.002])
        assert not info["success"]


def test_a_robot_in_the_air_above_the_mark_is_no_success(env):
    env.reset(seed=0)
    goal_at(env, 0.0, 0.0)
    stand_at(env, 0.0, 0.0)
    env.simulation.data.joint("robot0_root").qpos[2] += 0.05
    env.simulation.forward()
    task = env.benchmark
    assert task.standing.speed < 0.01
    assert not count(env, 2 * HOLD).success()


def test_a_fallen_robot_ends_the_episode_and_never_succeeds(env):
    env.reset(seed=0)
    goal_at(env, 0.0, 0.0)
    lie_at(env, 0.0, 0.0)
    for _ in range(2 * HOLD):
        _, reward, terminated, _, info = env.step(env.hold_action)
        assert terminated
        assert not info["success"]
        assert reward < 1.0
    assert "Spot fell: its trunk was tilted by" in info["failure"]


def test_a_fall_in_one_of_several_environments_ends_that_episode_alone():
    envs = gymnasium.make_vec(
        "wbc_suite/WalkTo-v0",
        num_envs=2,
        vectorization_mode="vector_entry_point",
        robots="Spot",
        controller_configs="WHOLE_BODY_ID",
    )
    envs.reset(seed=0)
    lie_at(envs.envs[0], 0.0, 0.0)
    actions = np.stack([env.hold_action for env in envs.envs])
    _, _, terminated, _, infos = envs.step(actions)
    assert terminated.tolist() == [True, False]
    assert infos["_failure"].tolist() == [True, False]
    assert "Spot fell" in infos["failure"][0]
    *_, terminated, _, infos = envs.step(actions)  # the next episode begins
    assert terminated.tolist() == [False, False]
    assert "failure" not in infos
    envs.close()


def test_a_state_is_continued_with_its_count(env):
    env.reset(seed=0)
    for _ in range(30):
        env.step(env.hold_action)
    saved, memory = env.get_state(), env.simulation.data.userdata.copy()
    env.reset(seed=1)
    env.set_state(saved)
    np.testing.assert_array_equal(env.simulation.data.userdata, memory)


def test_a_stop_that_is_interrupted_counts_anew(env):
    env.reset(seed=0)
    goal_at(env, 0.0, 0.0)
    stand_at(env, 0.0, 0.0)
    env.benchmark.standing.observe(False)
    count(env, HOLD - 1)
    env.benchmark.standing.observe(False)
    assert not count(env, HOLD - 1).success()
    assert count(env, 1).success()


def test_the_way_left_is_in_the_heading_of_the_robot(env):
    env.reset(seed=0)
    goal_at(env, 2.0, 1.0, 2.0)
    stand_at(env, 1.0, 1.0, math.pi / 2)
    way = env.step(env.hold_action)[0]["robot_to_goal"]
    np.testing.assert_allclose(way, [0.0, -1.0, 2.0 - math.pi / 2], atol=5e-3)


def test_the_reward_grows_towards_the_mark(env):
    env.reset(seed=0)
    goal_at(env, 1.0, 0.0)
    rewards = []
    for x in (-1.0, 0.0, 0.5, 1.0):
        stand_at(env, x, 0.0)
        env.benchmark.standing.observe(False)
        rewards.append(env.benchmark.reward(shaped=True))
    assert rewards == sorted(rewards)
    assert rewards[-1] == pytest.approx(0.95, abs=0.02)


def test_marks_are_drawn_in_all_directions_and_within_reach(env):
    ways = np.array([env.reset(seed=seed)[0]["robot_to_goal"] for seed in range(60)])
    distance = np.linalg.norm(ways[:, :2], axis=1)
    assert distance.min() >= 1.0 - 1e-6
    assert distance.max() <= 3.0 + 1e-6
    quadrants = set(zip(ways[:, 0] > 0, ways[:, 1] > 0, strict=True))
    assert len(quadrants) == 4
    assert np.abs(ways[:, 2]).max() > 2.5


@pytest.mark.parametrize("robot", ["Panda", "GR1", "SpotWithArmFloating", "Tiago"])
def test_robots_without_feet_or_a_free_root_are_refused(robot):
    with pytest.raises(ConfigError, match=f"WalkTo is for robots on .*{robot}"):
        wbc_suite.make("WalkTo", robots=robot)
