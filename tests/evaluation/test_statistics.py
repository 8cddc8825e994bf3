"""Intervals cover what they claim, and statistics agree with their definitions."""

import numpy as np
import pytest
from scipy import stats

from wbc_suite.errors import ConfigError
from wbc_suite.evaluation import (
    interquartile_mean,
    probability_of_improvement,
    stratified_bootstrap,
    success_interval,
    summarise,
)


def episode(seed, *, succeeded=False, **more):
    line = {"seed": seed, "succeeded": succeeded, "return": 1.0, "steps": 5}
    return line | {"seconds": 0.5, "physics_error": None} | more


def mean(values):
    return float(np.mean(values))


def binomial_mass(n, p):
    """Return the probability of 0 ... n successes, by the recursion of Pascal."""
    mass = np.array([1.0])
    for _ in range(n):
        mass = np.convolve(mass, [1.0 - p, p])
    return mass


def coverage(n, p, method):
    """Return the exact probability that the interval of n episodes contains p."""
    inside = [
        low <= p <= high
        for low, high in (success_interval(k, n, method) for k in range(n + 1))
    ]
    return float(binomial_mass(n, p)[inside].sum())


def test_summary_counts_each_seed_once():
    lines = [episode(0), episode(1, succeeded=True), episode(1, succeeded=True)]
    lines.append(episode(2, physics_error="Not finite"))
    summary = summarise(lines)
    assert (summary.episodes, summary.successes) == (3, 1)
    assert summary.success_rate == pytest.approx(1 / 3)
    assert summary.physics_errors == 1
    assert summary.steps_per_second == pytest.approx(10.0)


def test_wilson_intervals_are_those_of_the_literature():
    # 8 of 10, as Wilson's formula gives it in Brown, Cai and DasGupta (2001).
    assert success_interval(8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-4)
    assert success_interval(0, 10)[0] == 0.0
    assert success_interval(10, 10)[1] == 1.0


def test_wilson_intervals_are_those_of_scipy():
    from scipy.stats import binomtest

    for n in (1, 7, 500):
        for k in {0, 1, n // 3, n}:
            ours = success_interval(k, n)
            theirs = binomtest(k, n).proportion_ci(method="wilson")
            assert ours == pytest.approx(tuple(theirs), abs=1e-12)


def test_exact_intervals_are_those_of_the_literature():
    # 0 of 10 and 3 of 10 in Clopper and Pearson's chart, as tables print them.
    assert success_interval(0, 10, "exact") == pytest.approx((0.0, 0.3085), abs=1e-4)
    assert success_interval(3, 10, "exact") == pytest.approx((0.0667, 0.6525), abs=1e-4)


@pytest.mark.parametrize("p", [0.05, 0.3, 0.5, 0.9, 0.99])
def test_exact_intervals_cover_at_least_what_they_claim(p):
    assert coverage(60, p, "exact") >= 0.95


def test_wilson_intervals_cover_what_they_claim_on_average():
    rates = np.linspace(0.02, 0.98, 25)
    covered = [coverage(60, p, "wilson") for p in rates]
    assert np.mean(covered) == pytest.approx(0.95, abs=0.01)
    assert min(covered) > 0.90


@pytest.mark.slow
def test_intervals_cover_95_percent_of_simulated_evaluations():
    rng, true = np.random.default_rng(0), 0.83
    played = rng.binomial(400, true, size=2000)
    for method in ("wilson", "exact"):
        intervals = {k: success_interval(int(k), 400, method) for k in set(played)}
        inside = np.mean([intervals[k][0] <= true <= intervals[k][1] for k in played])
        # Three standard errors of 2,000 evaluations: 0.015.
        assert inside >= 0.95 - 0.015


@pytest.mark.slow
def test_the_stratified_bootstrap_covers_95_percent_of_simulated_evaluations():
    rng, true = np.random.default_rng(1), (0.2, 0.6, 0.9)
    inside = 0
    for k in range(300):
        strata = [rng.random(100) < p for p in true]
        low, high = stratified_bootstrap(strata, mean, resamples=400, seed=k)
        inside += low <= np.mean(true) <= high
    # Three standard errors of 300 evaluations: 0.038.
    assert inside / 300 == pytest.approx(0.95, abs=0.038)


def test_strata_keep_their_share():
    """Between benchmarks of which one is always and one never solved nothing varies."""
    assert stratified_bootstrap([np.ones(50), np.zeros(50)], mean) == (0.5, 0.5)
    low, high = stratified_bootstrap([np.repeat([0.0, 1.0], 50)], mean)
    assert low < 0.45
    assert high > 0.55


def test_a_bootstrap_of_nothing_is_refused():
    for strata in ([], [[]]):
        with pytest.raises(ConfigError, match="none empty"):
            stratified_bootstrap(strata, mean)


@pytest.mark.parametrize("count", range(1, 10))
def test_interquartile_mean_is_scipys_trimmed_mean(count):
    scores = np.random.default_rng(count).normal(size=count)
    expected = stats.trim_mean(scores, 0.25)
    assert interquartile_mean(scores) == pytest.approx(expected, rel=1e-12)


def test_interquartile_mean_leaves_out_the_outer_quarters():
    assert interquartile_mean([-1e9, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 1e9]) == 3.5


def test_probability_of_improvement_is_the_share_of_pairs():
    rng = np.random.default_rng(2)
    first, second = rng.integers(0, 6, 40), rng.integers(1, 7, 30)
    larger = (second[:, None] > first).mean() + 0.5 * (second[:, None] == first).mean()
    assert probability_of_improvement(first, second) == pytest.approx(larger)
    assert probability_of_improvement(first, first) == pytest.approx(0.5)
