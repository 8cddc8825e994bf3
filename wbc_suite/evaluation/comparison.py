"""Comparison of two policies on the same scenes."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any, Literal

import numpy as np

from wbc_suite.errors import ConfigError
from wbc_suite.evaluation.statistics import (
    CONFIDENCE,
    RESAMPLES,
    Interval,
    probability_of_improvement,
)

Verdict = Literal["better", "worse", "undecided"]
Episodes = Sequence[Mapping[str, Any]]


@dataclass(frozen=True, kw_only=True, slots=True)
class Comparison:
    """A second policy beside a first one, seed by seed.

    Attributes:
        pairs: Number of scenes that both have.
        only_first: Number of scenes in which the first succeeded and the second did
            not.
        only_second: Likewise.
        difference: Success rate of the second less that of the first.
        interval: Of this difference, 95 % (Agresti and Min).
        p_value: Of McNemar's exact test: the probability of scenes at least as uneven
            if both policies are equally good.
        false_alarms: The verdict is other than `undecided` for at most this share of
            comparisons of equal policies.
        verdict: Of the second.
        improvement: Probability that an episode of the second has a larger return than
            one of the first, mean over benchmarks.
        improvement_interval: Of this probability, stratified bootstrap, 95 %.
    """

    pairs: int
    only_first: int
    only_second: int
    difference: float
    interval: Interval
    p_value: float
    false_alarms: float
    verdict: Verdict
    improvement: float
    improvement_interval: Interval


def compare(
    first: Mapping[str, Episodes],
    second: Mapping[str, Episodes],
    *,
    false_alarms: float = 1.0 - CONFIDENCE,
) -> Comparison:
    """Compare the episodes of two policies, by benchmark.

    Only scenes that both have count: those of one benchmark and one seed.

    Raises:
        ConfigError: If they have no scene in common.

    Sources: McNemar (1947), "Note on the Sampling Error of the Difference between
    Correlated Proportions", Psychometrika 12(2); Agresti and Min (2005), "Simple
    Improved Confidence Intervals for Comparing Matched Proportions", Statistics in
    Medicine 24(5).
    """
    from scipy.stats import binomtest

    strata = [_paired(first[name], second[name]) for name in first if name in second]
    strata = [pairs for pairs in strata if pairs.size]
    if not strata:
        raise ConfigError(
            "These evaluations have no scene in common: compare the same benchmarks "
            "with the same seeds."
        )
    pairs = np.concatenate(strata)
    won, lost = pairs[:, 1] > pairs[:, 0], pairs[:, 1] < pairs[:, 0]
    wins, losses, n = int(won.sum()), int(lost.sum()), len(pairs)
    uneven = wins + losses
    p_value = float(binomtest(wins, uneven).pvalue) if uneven else 1.0
    verdict = "better" if wins > losses else "worse"
    return Comparison(
        pairs=n,
        only_first=losses,
        only_second=wins,
        difference=(wins - losses) / n,
        interval=_difference_interval(wins, losses, n),
        p_value=p_value,
        false_alarms=false_alarms,
        verdict=verdict if p_value <= false_alarms else "undecided",
        improvement=_improvement(strata),
        improvement_interval=_improvement_interval(strata),
    )


def _paired(first: Episodes, second: Episodes) -> np.ndarray:
    """Return successes and returns of both, shape (n, 4), of the seeds of both."""
    theirs = {e["seed"]: e for e in second}
    both = {e["seed"]: (e, theirs[e["seed"]]) for e in first if e["seed"] in theirs}
    rows = [
        [a["succeeded"], b["succeeded"], a["return"], b["return"]]
        for a, b in both.values()
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def _difference_interval(wins: int, losses: int, n: int) -> Interval:
    """Return Wald's interval after adding half a pair to each of the four cells."""
    z = NormalDist().inv_cdf((1.0 + CONFIDENCE) / 2.0)
    mean = (wins - losses) / (n + 2.0)
    spread = (wins + losses + 1.0) / (n + 2.0) - mean**2
    half = z * math.sqrt(spread / (n + 2.0))
    return max(mean - half, -1.0), min(mean + half, 1.0)


def _improvement(strata: Sequence[np.ndarray]) -> float:
    each = [probability_of_improvement(s[:, 2], s[:, 3]) for s in strata]
    return float(np.mean(each))


def _improvement_interval(strata: Sequence[np.ndarray]) -> Interval:
    """Resample the scenes of each benchmark, both policies together."""
    rng = np.random.default_rng(0)
    found = [
        _improvement([s[rng.integers(len(s), size=len(s))] for s in strata])
        for _ in range(RESAMPLES // 4)
    ]
    low, high = np.quantile(found, [(1.0 - CONFIDENCE) / 2.0, (1.0 + CONFIDENCE) / 2.0])
    return float(low), float(high)
