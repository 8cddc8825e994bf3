"""Statistics of many episodes."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from wbc_suite.executors import Outcome


@dataclass(frozen=True, kw_only=True, slots=True)
class Summary:
    """Statistics of a set of episodes.

    Attributes:
        episodes: Number of episodes.
        success: Share of episodes that succeeded at some step.
        interval: 95 % confidence interval of that share (Wilson).
        mean_return: Mean sum of rewards.
        mean_steps: Mean number of actions.
        physics_errors: Episodes that a physics error ended.
        steps_per_second: Actions per second of wall time and worker, policy included.
    """

    episodes: int
    success: float
    interval: tuple[float, float]
    mean_return: float
    mean_steps: float
    physics_errors: int
    steps_per_second: float


def episodes_of(outcomes: Iterable[Outcome]) -> list[dict[str, Any]]:
    """Return the episodes of `run_rollouts`; failed items have none."""
    return [e for outcome in outcomes for e in outcome.result.get("episodes", [])]


def summarise(episodes: Sequence[dict[str, Any]]) -> Summary:
    """Summarise at least one episode; each seed counts once."""
    distinct = list({episode["seed"]: episode for episode in episodes}.values())
    wins = sum(bool(e["succeeded"]) for e in distinct)
    steps = sum(int(e["steps"]) for e in distinct)
    return Summary(
        episodes=len(distinct),
        success=wins / len(distinct),
        interval=wilson(wins, len(distinct)),
        mean_return=float(np.mean([e["return"] for e in distinct])),
        mean_steps=steps / len(distinct),
        physics_errors=sum(e["physics_error"] is not None for e in distinct),
        steps_per_second=steps / max(sum(float(e["seconds"]) for e in distinct), 1e-9),
    )


def wilson(wins: int, n: int, z: float = 1.96) -> tuple[float, float]:
    """Compute the Wilson score interval of a share, of `wins` of n >= 1 episodes.

    Source: Wilson (1927), "Probable Inference, the Law of Succession, and Statistical
    Inference", JASA 22(158), with z = 1.96 for 95 %.
    """
    share, weight = wins / n, z * z / n
    middle = (share + weight / 2) / (1 + weight)
    half = z / (1 + weight) * math.sqrt(share * (1 - share) / n + weight / (4 * n))
    return max(0.0, middle - half), min(1.0, middle + half)
