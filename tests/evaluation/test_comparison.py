"""Two policies are compared scene by scene, and equal ones seldom differ."""

import math

import numpy as np
import pytest

from wbc_suite.errors import ConfigError
from wbc_suite.evaluation import compare


def played(successes, seeds=None):
    seeds = range(len(successes)) if seeds is None else seeds
    return [
        {"seed": seed, "succeeded": bool(s), "return": float(s)}
        for seed, s in zip(seeds, successes, strict=True)
    ]


def scenes(rng, count, first, second):
    """Draw scenes that are hard or easy for both, as two policies see them."""
    ease = rng.random(count)
    a = rng.random(count) < np.clip(first + 0.3 * (ease - 0.5), 0.0, 1.0)
    b = rng.random(count) < np.clip(second + 0.3 * (ease - 0.5), 0.0, 1.0)
    return a, b


def two_sided(wins, losses):
    """Return McNemar's exact p-value by counting coin tosses."""
    n, few = wins + losses, min(wins, losses)
    return min(1.0, 2.0 * sum(math.comb(n, k) for k in range(few + 1)) / 2.0**n)


def test_the_p_value_is_that_of_coin_tosses():
    first = [1] * 30 + [1] * 2 + [0] * 9 + [0] * 9
    second = [1] * 30 + [0] * 2 + [1] * 9 + [0] * 9
    found = compare({"Lift": played(first)}, {"Lift": played(second)})
    assert (found.pairs, found.only_first, found.only_second) == (50, 2, 9)
    assert found.p_value == pytest.approx(two_sided(9, 2))
    assert found.difference == pytest.approx(7 / 50)
    assert found.verdict == "undecided"


def test_a_clear_difference_is_seen_on_both_sides():
    worse, better = played([0] * 40 + [1] * 60), played([1] * 100)
    up = compare({"Lift": worse}, {"Lift": better})
    down = compare({"Lift": better}, {"Lift": worse})
    assert (up.verdict, down.verdict) == ("better", "worse")
    assert up.interval == pytest.approx((-down.interval[1], -down.interval[0]))
    assert up.interval[0] > 0.0
    assert up.improvement == pytest.approx(0.7)


def test_the_same_policy_twice_is_undecided():
    mine = {"Lift": played([1, 0, 1]), "Door": played([0, 0, 1])}
    found = compare(mine, mine)
    assert (found.verdict, found.p_value, found.difference) == ("undecided", 1.0, 0.0)
    assert found.improvement == pytest.approx(0.5)


def test_only_equal_scenes_count():
    first = {"Lift": played([1, 1, 1], [1, 2, 3]), "Door": played([1])}
    second = {"Lift": played([0, 0], [3, 4])}
    assert compare(first, second).pairs == 1
    with pytest.raises(ConfigError, match="no scene in common"):
        compare({"Lift": played([1], [1])}, {"Lift": played([1], [2])})


@pytest.mark.slow
@pytest.mark.parametrize("rate", [0.5, 0.8, 0.95])
def test_equal_policies_raise_a_false_alarm_in_at_most_5_percent(rate, monkeypatch):
    monkeypatch.setattr("wbc_suite.evaluation.comparison.RESAMPLES", 4)
    rng, alarms, covered = np.random.default_rng(3), 0, 0
    for _ in range(1000):
        a, b = scenes(rng, 400, rate, rate)
        found = compare({"Lift": played(a)}, {"Lift": played(b)})
        alarms += found.verdict != "undecided"
        covered += found.interval[0] <= 0.0 <= found.interval[1]
    assert alarms <= 50
    assert covered >= 935  # 950, less two standard errors


@pytest.mark.slow
def test_the_interval_covers_a_true_difference(monkeypatch):
    monkeypatch.setattr("wbc_suite.evaluation.comparison.RESAMPLES", 4)
    rng, inside = np.random.default_rng(4), 0
    for _ in range(500):
        a, b = scenes(rng, 400, 0.6, 0.7)  # no clipping: the means are 0.6 and 0.7
        low, high = compare({"Lift": played(a)}, {"Lift": played(b)}).interval
        inside += low <= 0.1 <= high
    assert inside / 500 == pytest.approx(0.95, abs=0.03)
