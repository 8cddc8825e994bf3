"""Bad numbers in the simulation are told in the control step that meets them."""

import numpy as np
import pytest

import wbc_suite

ARRAYS = ("qpos", "qvel", "qfrc_applied", "xfrc_applied")
COUNT = 200


@pytest.mark.slow
def test_all_bad_numbers_are_reported_at_once():
    env = wbc_suite.make("Lift", robots="Panda")
    rng, missed = np.random.default_rng(0), []
    for k in range(COUNT):
        env.reset(seed=k)
        for _ in range(rng.integers(0, 4)):
            env.step(env.hold_action)
        data = env.simulation.data
        name, value = ARRAYS[rng.integers(4)], (np.nan, 1e12)[rng.integers(2)]
        array = getattr(data, name)
        rows = array.reshape(-1)
        place = int(rng.integers(rows.size))
        rows[place] = value
        before = data.time
        observation, reward, terminated, _, info = env.step(env.hold_action)
        told = terminated and "physics_error" in info and reward == 0.0
        if not told or data.time < before:
            missed.append((k, name, value, place, info.get("physics_error")))
        assert all(np.isfinite(values).all() for values in observation.values())
        assert env.observation_space.contains(observation)
        data.xfrc_applied[:] = 0.0
        data.qfrc_applied[:] = 0.0
    assert missed == []
