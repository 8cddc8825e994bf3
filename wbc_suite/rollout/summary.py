"""What many episodes say together."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from wbc_suite.executors import Outcome

__all__ = ["Summary", "episodes_of", "summarise", "wilson"]


@dataclass(frozen=True, kw_only=True, slots=True)
class Summary:
    """Figures of a set of episodes.

    Attributes:
        episodes: How many.
        success: Share of them that succeeded at some step.
        interval: Between which shares the true one lies, with 95 % confidence.
        mean_return: Mean sum of rewards.
        mean_steps: Mean length.
        physics_errors: How many ended in a fault of the physics.
        steps_per_second: Of wall time and worker, policies included.
    """

    episodes: int
    success: float
    interval: tuple[float, float]
    mean_return: float
    mean_steps: float
    physics_errors: int
    steps_per_second: float


def episodes_of(outcomes: Iterable[Outcome]) -> list[dict[str, Any]]:
    """Gather the episodes that items of `roll_out` played; failed items have none."""
    played = (cast("list[Any]", o.result.get("episodes", [])) for o in outcomes)
    return [episode for episodes in played for episode in episodes]


def summarise(episodes: Sequence[dict[str, Any]]) -> Summary:
    """Sum up at least one episode; the order does not matter, nor does a repetition."""
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
    """Compute the Wilson score interval of a share, for `wins` of n >= 1.

    Source: Wilson (1927), "Probable Inference, the Law of Succession, and Statistical
    Inference", JASA 22(158), with z = 1.96 for 95 %.
    """
    share, weight = wins / n, z * z / n
    middle = (share + weight / 2) / (1 + weight)
    half = z / (1 + weight) * math.sqrt(share * (1 - share) / n + weight / (4 * n))
    return max(0.0, middle - half), min(1.0, middle + half)
