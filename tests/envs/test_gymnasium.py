"""Environments keep to Gymnasium, and to what Stable-Baselines3 asks for beside.

The conditions of that library's checker are written here in our own words; it is not
needed.
"""

import json
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import FrameStackObservation

import wbc_suite

SEEN = {"use_camera_obs": True, "camera_heights": 40, "camera_widths": 40}


@pytest.fixture(scope="module")
def env():
    env = gymnasium.make("wbc_suite/Lift-v1", robots="Panda", **SEEN)
    yield env
    env.close()


@pytest.mark.slow
def test_checkers_say_nothing_of_the_raw_environment(env):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)
        env.reset(seed=0)  # the passive checker looks on
        env.step(env.action_space.sample())
        env.step(env.unwrapped.hold_action)  # float64 does as well


def test_spaces_are_those_that_learners_take(env):
    actions = env.action_space
    assert actions.dtype == np.float32
    assert (actions.low == -1.0).all()
    assert (actions.high == 1.0).all()
    for space in env.observation_space.spaces.values():
        assert type(space) is gymnasium.spaces.Box
        if len(space.shape) == 3:
            assert (space.dtype, space.shape[:2]) == (np.uint8, (40, 40))
            assert (space.low == 0).all()
            assert (space.high == 255).all()
        else:
            assert len(space.shape) == 1
            assert np.isfinite([space.low, space.high]).all()


@pytest.mark.slow
def test_steps_return_plain_types_and_exactly_the_spaces_keys(env):
    observation, info = env.reset(seed=1)
    assert type(info) is dict
    observation, *rest = env.step(env.action_space.sample())
    assert [type(value) for value in rest] == [float, bool, bool, dict]
    assert observation.keys() == env.observation_space.spaces.keys()
    assert {key: value.dtype for key, value in observation.items()} == {
        key: space.dtype for key, space in env.observation_space.spaces.items()
    }
    assert not hasattr(env.unwrapped, "compute_reward")  # means goals there


@pytest.mark.slow
def test_actions_inside_of_the_space_are_never_clipped():
    env = wbc_suite.make("Lift", robots="GR1", controller_configs="WHOLE_BODY_IK")
    env.reset(seed=0)
    layout, space = env.action_layout, env.action_space
    assert (space.low >= layout.low).all()
    assert (space.high <= layout.high).all()
    np.testing.assert_allclose(space.low, layout.low, rtol=3e-7)
    for corner in (space.low, space.high):
        assert layout.take(corner)[1] == 0


@pytest.mark.parametrize("mode", ["sync", "vector_entry_point"])
def test_vectors_are_made_both_ways_and_see_the_same(mode, env):
    arguments = {"robots": "Panda", "vectorization_mode": mode}
    envs = gymnasium.make_vec("wbc_suite/Lift-v1", num_envs=2, **arguments)
    observations, _ = envs.reset(seed=[3, 4])
    assert observations in envs.observation_space
    assert envs.single_action_space == env.action_space
    alone, _ = env.reset(seed=4)
    for key, values in observations.items():
        np.testing.assert_array_equal(values[1], alone[key])
    actions = envs.action_space.sample()
    observations, *_ = envs.step(actions)
    alone, *_ = env.step(actions[1])
    for key, values in observations.items():
        np.testing.assert_array_equal(values[1], alone[key])
    envs.close()


def test_specs_are_text(env):
    spec = gymnasium.spec("wbc_suite/Lift-v1")
    assert isinstance(spec.entry_point, str)
    assert isinstance(spec.vector_entry_point, str)
    assert json.loads(env.spec.to_json())["kwargs"]["robots"] == "Panda"


def test_gymnasiums_frame_stack_takes_dictionaries(env):
    stacked = FrameStackObservation(env, 3)
    first, _ = stacked.reset(seed=0)
    assert first in stacked.observation_space
    assert first["agentview_image"].shape == (3, 40, 40, 3)
    second, *_ = stacked.step(env.action_space.sample())
    for key, frames in second.items():
        np.testing.assert_array_equal(frames[:-1], first[key][1:])
