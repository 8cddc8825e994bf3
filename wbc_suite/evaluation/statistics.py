"""Statistics of many episodes: rates, means, and intervals of 95 % confidence.

SciPy is imported where it is used: that takes half a second.
"""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from wbc_suite.errors import ConfigError
from wbc_suite.typing import Vector

CONFIDENCE = 0.95  # of all intervals
RESAMPLES = 2000  # of a bootstrap

Interval: TypeAlias = tuple[float, float]
"""Lower and upper bound."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Summary:
    """Statistics of a set of episodes.

    Attributes:
        successes: Number of episodes that succeeded at some step.
        wilson: Interval of the success rate, by Wilson's score.
        exact: The same by Clopper and Pearson, which covers at least 95 %.
        mean_return: Mean of the sums of rewards.
        iqm_return: Mean of the middle half of them, and its bootstrap interval.
        physics_errors: Number of episodes that a physics error ended.
        errors: Number of episodes that an error of the policy ended, by kind.
        steps_per_second: Per worker, policy included.
    """

    episodes: int
    successes: int
    success_rate: float
    wilson: Interval
    exact: Interval
    mean_return: float
    iqm_return: float
    iqm_return_interval: Interval
    mean_steps: float
    physics_errors: int
    errors: dict[str, int]
    steps_per_second: float


def summarise(episodes: Sequence[dict[str, Any]]) -> Summary:
    """Summarise at least one episode; each seed counts once."""
    distinct = list({episode["seed"]: episode for episode in episodes}.values())
    successes = sum(bool(e["succeeded"]) for e in distinct)
    returns = np.array([e["return"] for e in distinct], dtype=np.float64)
    steps = sum(int(e["steps"]) for e in distinct)
    return Summary(
        episodes=len(distinct),
        successes=successes,
        success_rate=successes / len(distinct),
        wilson=success_interval(successes, len(distinct), "wilson"),
        exact=success_interval(successes, len(distinct), "exact"),
        mean_return=float(returns.mean()),
        iqm_return=interquartile_mean(returns),
        iqm_return_interval=stratified_bootstrap([returns], interquartile_mean),
        mean_steps=steps / len(distinct),
        physics_errors=sum(e["physics_error"] is not None for e in distinct),
        errors=dict(Counter(e["error"]["kind"] for e in distinct if e.get("error"))),
        steps_per_second=steps / max(sum(float(e["seconds"]) for e in distinct), 1e-9),
    )


def success_interval(
    successes: int, episodes: int, method: Literal["wilson", "exact"] = "wilson"
) -> Interval:
    """Return the interval of a success rate.

    Sources: Wilson (1927), "Probable Inference, the Law of Succession, and Statistical
    Inference", JASA 22(158); Clopper and Pearson (1934), "The Use of Confidence or
    Fiducial Limits", Biometrika 26(4).
    """
    if method == "exact":
        from scipy.stats import binomtest  # takes 0.7 s to import

        test = binomtest(successes, episodes)
        interval = test.proportion_ci(confidence_level=CONFIDENCE, method=method)
        return float(interval.low), float(interval.high)
    z = NormalDist().inv_cdf((1.0 + CONFIDENCE) / 2.0)
    rate, spread = successes / episodes, z**2 / episodes
    middle = rate + spread / 2.0
    half = math.sqrt(spread * (rate * (1.0 - rate) + spread / 4.0))
    low = (middle - half) / (1.0 + spread) if successes else 0.0
    high = (middle + half) / (1.0 + spread) if successes < episodes else 1.0
    return low, high


def interquartile_mean(scores: ArrayLike) -> float:
    """Return the mean of the middle half of all scores, shape of any kind.

    A quarter of them, rounded down, is left out at each end.

    Source: Agarwal et al. (2021), "Deep Reinforcement Learning at the Edge of the
    Statistical Precipice", NeurIPS.
    """
    ordered = np.sort(np.ravel(scores))
    left_out = ordered.size // 4
    return float(ordered[left_out : ordered.size - left_out].mean())


def stratified_bootstrap(
    strata: Sequence[ArrayLike],
    statistic: Callable[[Vector], float],
    *,
    resamples: int = RESAMPLES,
    seed: int = 0,
) -> Interval:
    """Return the percentile interval of a statistic of several samples.

    Each stratum (the episodes of a benchmark, or the runs of one) is resampled alone,
    so that its share is kept; the statistic is that of all strata in one array.

    Raises:
        ConfigError: If there is no stratum, or one is empty.
    """
    samples = [np.asarray(s, dtype=np.float64).ravel() for s in strata]
    if not samples or any(s.size == 0 for s in samples):
        raise ConfigError("A bootstrap needs one stratum or more, and none empty.")
    rng = np.random.default_rng(seed)
    found = [
        statistic(np.concatenate([rng.choice(s, s.size) for s in samples]))
        for _ in range(resamples)
    ]
    tail = (1.0 - CONFIDENCE) / 2.0
    low, high = np.quantile(found, [tail, 1.0 - tail])
    return float(low), float(high)


def probability_of_improvement(first: ArrayLike, second: ArrayLike) -> float:
    """Return the probability that a score of the second exceeds one of the first.

    Equal scores count one half. This is the statistic of Mann and Whitney over the
    number of pairs.
    """
    from scipy.stats import rankdata

    before, after = np.ravel(first), np.ravel(second)
    ranks = rankdata(np.concatenate([after, before]))[: after.size]
    wins = ranks.sum() - after.size * (after.size + 1) / 2.0
    return float(wins / (before.size * after.size))
