"""The two-sided search finds false verdicts where they are, and none elsewhere."""

import numpy as np
import pytest
from harness.geometric_judges import JUDGES
from two_sided import ALL, Search

from wbc_suite.benchmark import Stack
from wbc_suite.benchmark.base import load_benchmark


def found(name, robots, tries, seed=0):
    search = Search(name, robots, seed)
    for _ in range(tries):
        search.attempt()
    return search


def test_every_benchmark_that_is_searched_has_a_judge():
    for name in ALL:
        kinds = [kind.__name__ for kind in type(load_benchmark(name)).__mro__]
        assert any(kind in JUDGES for kind in kinds), name


def in_axes_of_b(stack):
    a, b, half = stack.states["cubeA"], stack.states["cubeB"], 0.025
    x, y, z = ((a.position - b.position) @ b.rotation).tolist()
    over = max(abs(x), abs(y)) < half < z
    return over and a.is_still and stack.scene.touching("cubeA", "cubeB")


def touches(stack):
    return stack.scene.touching("cubeA", "cubeB")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("success", "side"), [(in_axes_of_b, "failure"), (touches, "success")]
)
def test_a_wrong_idea_of_on_is_found(monkeypatch, success, side):
    monkeypatch.setattr(Stack, "success", success)
    assert side in {one["side"] for one in found("Stack", "Panda", 300).found}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "robots"),
    [
        *(("Stack", "Panda"), ("PickPlaceMilk", "PandaDexRH"), ("Door", "GR1")),
        *(("NutAssemblySquare", "Baxter"), ("TwoArmPegInHole", "Panda,Panda")),
    ],
)
def test_none_is_found_in_a_hundred_tries(name, robots):
    search = found(name, robots, 100, seed=1)
    assert not search.found
    assert search.done > 0
    assert search.counts["right"] > 90


@pytest.mark.slow
def test_the_same_seed_makes_the_same_tries():
    first, again = (found("Stack", "Panda", 20, seed=3) for _ in range(2))
    np.testing.assert_array_equal(first.data.qpos, again.data.qpos)
    assert first.counts == again.counts
