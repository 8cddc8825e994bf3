"""The search for false successes finds them where they are, and none elsewhere."""

import numpy as np
import pytest
from false_success import ALL, Search
from harness.task_checks import CHECKS

from wbc_suite.benchmark import Lift
from wbc_suite.benchmark.base import load_benchmark


def test_every_benchmark_that_is_searched_has_a_check():
    for name in ALL:
        kinds = type(load_benchmark(name)).__mro__
        assert any(kind in CHECKS for kind in kinds), name


@pytest.mark.slow
def test_a_success_by_height_alone_is_found_false(monkeypatch):
    def is_high(self):
        height = self.cube_position.item(2) - self.config.table.center[2]
        return height > self.config.reward.lift_height

    monkeypatch.setattr(Lift, "success", is_high)
    search = Search("Lift", seed=0)
    for _ in range(30):
        search.attempt()
    assert search.found
    assert "does not come along" in search.found[0]["why"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Lift", "Stack", "Door"])
def test_none_is_found_in_a_few_tries(name):
    search = Search(name, seed=1)
    for _ in range(30):
        search.attempt()
    assert not search.found
    assert search.tries == 30


@pytest.mark.slow
def test_a_success_of_the_expert_is_no_false_one():
    search = Search("Stack", seed=0)
    env, check = search.env, None
    for scene, actions in enumerate(search.recorded()):
        env.begin(scene)
        check = search.check()
        for action in actions:
            *_, info = env.advance(action)
            assert check.after_step() is None
        assert info["success"]
        assert check.fault() is None


@pytest.mark.slow
def test_the_same_seed_makes_the_same_tries():
    numbers = []
    for _ in range(2):
        search = Search("Lift", seed=3)
        numbers.append([search.attempt().numbers for _ in range(5)])
    np.testing.assert_array_equal(*numbers)
