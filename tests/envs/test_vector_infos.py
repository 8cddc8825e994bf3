"""Infos of several environments are gathered as Gymnasium's own vectors do it."""

import gymnasium
import numpy as np
import pytest

from wbc_suite.envs.vector import gather_infos


class Reporter(gymnasium.Env):
    """An environment that returns a given info."""

    observation_space = action_space = gymnasium.spaces.Box(0.0, 1.0, (1,))

    def __init__(self, info):
        self.info = info

    def reset(self, *, seed=None, options=None):
        return np.zeros(1, np.float32), self.info


def assert_same(ours, theirs):
    assert ours.keys() == theirs.keys()
    for key, value in theirs.items():
        if isinstance(value, dict):
            assert_same(ours[key], value)
        else:
            np.testing.assert_array_equal(ours[key], value)
            assert ours[key].dtype == value.dtype, key


INFOS = {
    "numbers": [{"a": 1.5, "b": True, "c": 3}, {"a": 2.5, "b": False, "c": 4}],
    "absent in the first": [{}, {"a": 1.5, "b": True, "c": 3}],
    "absent in the last": [{"a": 1.5, "s": "x"}, {}],
    "arrays": [{"v": np.arange(3.0)}, {}, {"v": np.ones(3)}],
    "numbers of NumPy": [{"n": np.float64(2.0)}, {"n": np.float64(3.0)}],
    "text": [{"error": "BADQACC"}, {}],
    "dictionaries": [
        {"ik": {"reached": True, "errors": {"hand": 0.1}}},
        {"ik": {"reached": False, "errors": {"hand": 0.2, "foot": 0.3}}},
    ],
    "a dictionary absent": [{}, {"ik": {"reached": True}}],
    "tuples": [{"demo": (1, 2)}, {"demo": (3, 4)}],
    "nothing": [{}, {}],
}


@pytest.mark.parametrize("infos", INFOS.values(), ids=INFOS)
def test_infos_are_those_of_gymnasiums_vector(infos):
    makers = [lambda info=info: Reporter(info) for info in infos]
    theirs = gymnasium.vector.SyncVectorEnv(makers).reset()[1]
    assert_same(gather_infos(infos), theirs)


def test_final_observations_are_kept_as_they_are():
    first = {"q": np.zeros(2)}
    gathered = gather_infos([{}, {"final_obs": first, "final_info": {"n": 1}}])
    assert gathered["final_obs"].dtype == object
    assert gathered["final_obs"][0] is None
    assert gathered["final_obs"][1] is first
    np.testing.assert_array_equal(gathered["_final_obs"], [False, True])
    np.testing.assert_array_equal(gathered["final_info"]["n"], [0, 1])
    np.testing.assert_array_equal(gathered["final_info"]["_n"], [False, True])
