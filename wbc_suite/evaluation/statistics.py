"""Statistics of many episodes."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from wbc_suite.executors import Outcome


@dataclass(frozen=True, kw_only=True, slots=True)
class Summary:
    """Statistics of a set of episodes."""

    episodes: int
    success: float  # share of episodes that succeeded at some step
    interval: tuple[float, float]  # of that share, 95 % confidence (Wilson)
    mean_return: float  # of the sums of rewards
    mean_steps: float
    physics_errors: int  # episodes that one ended
    steps_per_second: float  # of wall time and worker, policy included


def episodes_of(outcomes: Iterable[Outcome]) -> list[dict[str, Any]]:
    """Return the episodes of `run_rollouts`; failed items have none."""
    return [e for outcome in outcomes for e in outcome.result.get("episodes", [])]


def summarise(episodes: Sequence[dict[str, Any]]) -> Summary:
    """Summarise at least one episode; each seed counts once.

    Source of the interval: Wilson (1927), "Probable Inference, the Law of Succession,
    and Statistical Inference", JASA 22(158).
    """
    from scipy.stats import binomtest  # takes half a second to import

    distinct = list({episode["seed"]: episode for episode in episodes}.values())
    wins = sum(bool(e["succeeded"]) for e in distinct)
    steps = sum(int(e["steps"]) for e in distinct)
    interval = binomtest(wins, len(distinct)).proportion_ci(method="wilson")
    return Summary(
        episodes=len(distinct),
        success=wins / len(distinct),
        interval=(float(interval.low), float(interval.high)),
        mean_return=float(np.mean([e["return"] for e in distinct])),
        mean_steps=steps / len(distinct),
        physics_errors=sum(e["physics_error"] is not None for e in distinct),
        steps_per_second=steps / max(sum(float(e["seconds"]) for e in distinct), 1e-9),
    )
