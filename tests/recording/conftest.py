"""One small recording that all tests of recordings share, and what plays it."""

import numpy as np
import pytest
from random_episodes import HEADER, make_episode

import wbc_suite
from wbc_suite.evaluation import make_policy
from wbc_suite.recording import Store
from wbc_suite.wrappers import DataCollection


@pytest.fixture(scope="session")
def lift_recording(tmp_path_factory):
    """Two episodes of Lift with Panda: the cube is lifted, then noise."""
    path = tmp_path_factory.mktemp("lift") / "lift.hdf5"
    made = wbc_suite.make("Lift", robots="Panda", horizon=70, terminate_on_success=True)
    with_file = DataCollection(made, path)
    for seed, device in enumerate(["expert", "random"]):
        driver = make_policy(device, made, seed)
        seen, _ = with_file.reset(seed=seed)
        for _ in range(70 if seed == 0 else 12):
            seen, _, terminated, truncated, _ = with_file.step(driver(seen))
            if terminated or truncated:
                break
    with_file.close()
    return path


@pytest.fixture(scope="session")
def lift_env():
    """The environment of `lift_recording`, made anew."""
    return wbc_suite.make("Lift", robots="Panda", horizon=70, terminate_on_success=True)


@pytest.fixture
def small_recording(tmp_path):
    """Four episodes of random numbers in a file that is closed."""
    path = tmp_path / "small.hdf5"
    with Store(path, HEADER) as store:
        for seed in range(4):
            store.add(make_episode(seed))
    return path


@pytest.fixture
def same_numbers():
    """Compare the numbers of two episodes, or of two datasets' episodes in order."""

    def compare(one, other):
        assert one.columns.keys() == other.columns.keys()
        for name, column in one.columns.items():
            np.testing.assert_array_equal(column, other.columns[name])
            assert column.dtype == other.columns[name].dtype
        np.testing.assert_array_equal(one.final_state, other.final_state)

    return compare
