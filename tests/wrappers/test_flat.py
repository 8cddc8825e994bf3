"""Flat observations and actions of a small environment without physics."""

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box, Dict

from wbc_suite.errors import ConfigError, DatasetError, UnknownNameError
from wbc_suite.wrappers import DemoStart, Flat, Indicators, Playback


class Small(gymnasium.Env):
    """Returns the action that it was given, and a counter."""

    observation_space = Dict(
        {
            "robot0_proprio-state": Box(-2.0, 2.0, (2,), np.float64),
            "object-state": Box(-1.0, 3.0, (1,), np.float64),
            "robot0_joint_pos": Box(-2.0, 2.0, (2,), np.float64),
            "agentview_image": Box(0, 255, (4, 4, 3), np.uint8),
        }
    )
    action_space = Box(np.array([-0.1, 1.0]), np.array([0.3, 5.0]), dtype=np.float64)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return self.seen(np.zeros(2)), {"reset": True}

    def step(self, action):
        return self.seen(action), 0.5, False, True, {"action": action}

    def seen(self, action):
        return {
            "robot0_proprio-state": np.asarray(action, float),
            "object-state": np.array([3.0]),
            "robot0_joint_pos": np.asarray(action, float),
            "agentview_image": np.zeros((4, 4, 3), np.uint8),
        }


@pytest.fixture
def env():
    return Flat(Small())


def test_robots_come_before_objects(env):
    assert env.keys == ("robot0_proprio-state", "object-state")
    np.testing.assert_array_equal(env.observation_space.low, [-2.0, -2.0, -1.0])
    np.testing.assert_array_equal(env.observation_space.high, [2.0, 2.0, 3.0])
    observation, info = env.reset(seed=0)
    np.testing.assert_array_equal(observation, np.float32([0.0, 0.0, 3.0]))
    assert observation.dtype == np.float32
    assert info == {"reset": True}


@pytest.mark.parametrize(
    ("given", "expected"),
    [([-1, -1], [-0.1, 1.0]), ([1, 1], [0.3, 5.0]), ([0, 0], [0.1, 3.0])],
)
def test_actions_are_scaled_to_the_bounds(env, given, expected):
    env.reset()
    *_, info = env.step(np.float32(given))
    np.testing.assert_allclose(info["action"], expected)
    np.testing.assert_allclose(env.scaled(info["action"]), given, atol=1e-6)


def test_other_keys_can_be_chosen_in_any_order():
    env = Flat(Small(), keys=["object-state", "robot0_joint_pos"])
    observation, *_ = env.reset()
    np.testing.assert_array_equal(observation, np.float32([3.0, 0.0, 0.0]))


def test_an_unknown_key_is_named():
    with pytest.raises(UnknownNameError, match="Did you mean 'robot0_joint_pos'"):
        Flat(Small(), keys=["robot0_joint_poss"])


def test_the_end_of_an_episode_is_passed_on(env):
    env.reset()
    _, reward, terminated, truncated, _ = env.step(np.zeros(2))
    assert (reward, terminated, truncated) == (0.5, False, True)


def test_an_axis_without_a_range_is_scaled_to_zero():
    small = Small()
    low, high = np.array([1.0, 2.0]), np.array([1.0, 4.0])
    small.action_space = Box(low, high, dtype=np.float64)
    env = Flat(small)
    np.testing.assert_allclose(env.scaled([1.0, 4.0]), [0.0, 1.0])


@pytest.mark.parametrize(
    "wrap",
    [
        lambda env: DemoStart(env, [np.zeros((3, 5))]),
        lambda env: Indicators(env),
        lambda env: Playback(env, []),
    ],
)
def test_other_wrappers_need_an_environment_with_a_robot(wrap):
    with pytest.raises((ConfigError, DatasetError), match="RobotEnv"):
        wrap(Small())
