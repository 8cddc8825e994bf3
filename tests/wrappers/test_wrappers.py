"""Wrappers: flat vectors, starts from demonstrations, marks; Gymnasium's own beside."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import FrameStackObservation

import wbc_suite
from wbc_suite.envs.states import motion_size
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.wrappers import DemoStart, Flat, Indicators


@pytest.fixture(scope="module")
def env():
    env = gymnasium.make(
        "wbc_suite/Lift-v1",
        robots="Panda",
        render_mode="rgb_array",
        render_size=(96, 96),
        disable_env_checker=True,
    )
    yield env
    env.close()


def test_flat_observations_are_robots_then_objects(env):
    flat = Flat(env)
    vector, _ = flat.reset(seed=0)
    seen = env.unwrapped.observation()
    expected = [*seen["robot0_proprio-state"], *seen["object-state"]]
    np.testing.assert_allclose(vector, np.float32(expected))
    assert flat.observation_space.contains(vector)
    assert Flat(env, ["cube_pos"]).observation_space.shape == (3,)
    with pytest.raises(UnknownNameError, match="Did you mean 'cube_pos'"):
        Flat(env, ["cube_ps"])


@pytest.mark.parametrize("robot", ["Panda", "GR1"])
def test_flat_actions_mean_the_same_between_minus_one_and_one(robot):
    inner = wbc_suite.make("Lift", robots=robot)
    flat = Flat(inner)
    states = []
    for step, action in ((inner.step, lambda a: a), (flat.step, flat.scaled)):
        inner.reset(seed=0)
        hold = inner.hold_action
        *_, info = step(action(hold))
        assert info["clipped"] == 0
        size = motion_size(inner.simulation.model)
        states.append(inner.physics_state[:size])
    np.testing.assert_allclose(*states, atol=1e-3)  # float32 actions
    assert abs(flat.action_space.low).max() == flat.action_space.high.max() == 1.0
    assert flat.action_space.dtype == flat.observation_space.dtype == np.float32


def test_checkers_and_frame_stacks_take_flat_environments(recwarn):
    flat = Flat(wbc_suite.make("Lift", robots="Panda"))
    stacked = FrameStackObservation(flat, 3)
    first, _ = stacked.reset(seed=0)
    assert first.shape == (3, *flat.observation_space.shape)
    check_env(flat, skip_render_check=True)
    told = [
        str(w.message) for w in recwarn if "unwrapped version" not in str(w.message)
    ]
    assert told == []


def test_episodes_begin_in_demonstrations_by_the_seed(env):
    inner = env.unwrapped
    env.reset(seed=3)
    states = []
    for _ in range(6):
        env.step(inner.hold_action)
        states.append(inner.physics_state)
    demo = DemoStart(env, [np.array(states)], share=1.0, window=2, growth=1)
    for k in range(4):
        _, info = demo.reset(seed=5)
        at = info["demo_start"][1]
        assert at >= 4 - k
        np.testing.assert_array_equal(inner.physics_state, states[at])
    usual = DemoStart(env, [np.array(states)], share=0.0)
    assert "demo_start" not in usual.reset(seed=5)[1]
    with pytest.raises(ConfigError, match="needs \\(n, "):
        DemoStart(env, [np.zeros((3, 4))])


@pytest.mark.slow
def test_marks_are_in_pictures_only(env):
    env.reset(seed=0)
    marked = Indicators(env)
    marked.places["goal"] = (env.unwrapped.observation()["cube_pos"], (0, 0, 255))
    plain, picture = env.render().astype(int), marked.render().astype(int)
    different = np.abs(picture - plain).sum(axis=-1) > 0
    assert 10 < different.sum() < 400
    assert (picture[different][:, 2] - plain[different][:, 2]).max() > 60
    np.testing.assert_array_equal(env.render(), plain)
