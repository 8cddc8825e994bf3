"""Disturbed actions: as large as asked, labelled, repeatable, replayed bit by bit."""

import numpy as np
import pytest

import wbc_suite
from wbc_suite.errors import ConfigError
from wbc_suite.recording import Dataset
from wbc_suite.recording.replaying import divergence
from wbc_suite.wrappers import DataCollection, Disturbance


@pytest.fixture(scope="module")
def env():
    made = wbc_suite.make("Lift", robots="Panda", horizon=400)
    yield made
    made.close()


def infos(env, steps, seed=0):
    env.reset(seed=seed)
    inner = env.unwrapped
    return [env.step(inner.hold_action)[4] for _ in range(steps)]


def test_noise_has_the_deviation_that_was_asked_for_and_leaves_fingers_alone(env):
    found = infos(Disturbance(env, noise=0.1), 300)
    noise = np.array([i["executed"] - i["intended"] for i in found])
    arm, hand = noise[:, :6], noise[:, 6:]
    assert np.std(arm) == pytest.approx(0.1, rel=0.1)  # of 1800 numbers
    assert abs(np.mean(arm)) < 0.01
    assert not hand.any()
    assert not any(i["disturbed"] for i in found)


def test_pushes_come_as_often_as_asked_and_move_the_hand(env):
    disturbed = Disturbance(env, pushes=5.0)
    found = infos(disturbed, 300)
    pushed = np.array([i["disturbed"] for i in found])
    begun = np.count_nonzero(np.diff(pushed) == 1)
    assert 7 <= begun <= 25  # 12 are expected: those of 300 actions less their length
    moved = np.array([np.any(i["executed"] != i["intended"]) for i in found])
    np.testing.assert_array_equal(moved, pushed)


def test_a_seed_repeats_disturbances(env):
    disturbed = Disturbance(env, noise=0.1, pushes=10.0)
    first, again, other = (infos(disturbed, 30, seed) for seed in (3, 3, 4))
    pairs = [(a["executed"], b["executed"]) for a, b in zip(first, again, strict=True)]
    assert all(np.array_equal(a, b) for a, b in pairs)
    assert not np.array_equal(first[0]["executed"], other[0]["executed"])


def test_an_absolute_goal_is_pushed_on_in_metres():
    part = {"type": "OSC_POSE", "input_type": "absolute"}
    config = {"format": 1, "type": "BASIC", "body_parts": {"right": part}}
    env = wbc_suite.make("Lift", robots="Panda", controller_configs=config)
    found = infos(Disturbance(env, noise=0.2, pushes=100.0), 40)
    shifts = np.array([i["executed"] - i["intended"] for i in found])[:, :3]
    assert 0.005 < np.abs(shifts).max() < 6 * 0.03 + 5 * 0.2 * 0.05
    env.close()


def test_recordings_hold_what_was_done_beside_what_was_meant(env, tmp_path):
    path = tmp_path / "a.hdf5"
    collected = DataCollection(Disturbance(env, noise=0.2, pushes=20.0), path)
    collected.reset(seed=1)
    given = [env.action_space.sample() * 0.3 for _ in range(25)]
    for action in given:
        collected.step(action)
    collected.recorder.keep()
    collected.recorder.close()
    with Dataset(path) as dataset:
        (episode,) = dataset
    np.testing.assert_array_equal(episode.columns["intended"], np.array(given))
    assert not np.array_equal(episode.columns["actions"], episode.columns["intended"])
    assert 0 < episode.columns["disturbed"].sum() < 25
    assert divergence(env, episode).exact


def test_other_environments_and_negative_noise_are_refused(env):
    import gymnasium

    with pytest.raises(ConfigError, match="RobotEnv"):
        Disturbance(gymnasium.Env())
    with pytest.raises(ConfigError, match="noise"):
        Disturbance(env, noise=-0.1)
