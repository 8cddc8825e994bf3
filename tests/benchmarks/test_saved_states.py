"""Saved states restore the worlds that they are of; see `saved_states`."""

import numpy as np
import pytest
from saved_states import measure, unequal


def test_arrays_that_differ_in_a_bit_are_named():
    one = {"a": np.zeros(3), "b": np.ones(2)}
    other = {"a": np.zeros(3), "b": np.array([1.0, 1.0 + 2.3e-16])}
    assert unequal(one, one) == []
    assert unequal(one, other) == ["b"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Door", "WalkTo"])
def test_recordings_go_on_from_a_random_state_as_they_did(name, tmp_path):
    row = measure(name, range(8000, 8002), tmp_path)
    assert row["arrays_that_differ"] == []
    assert row["worlds_equal"] == row["ends_same"] == row["ends_exact"] == 2
    assert row["solved"] == 2
