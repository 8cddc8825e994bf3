"""Results of an evaluation: its cases, their episodes, summaries and comparisons."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from wbc_suite.evaluation.comparison import Comparison, compare
from wbc_suite.evaluation.rollouts import Case, ErrorKind, failed_episode
from wbc_suite.evaluation.statistics import (
    Summary,
    interquartile_mean,
    stratified_bootstrap,
    success_interval,
    summarise,
)
from wbc_suite.executors import Outcome, WorkItem


@dataclass(frozen=True, kw_only=True, slots=True)
class Film:
    """An animation of one episode, in WebP."""

    seed: int
    path: Path
    steps: int

    @property
    def data_url(self) -> str:
        """The animation as the address of a picture in a page."""
        data = base64.b64encode(self.path.read_bytes()).decode("ascii")
        return f"data:image/webp;base64,{data}"


@dataclass(frozen=True, kw_only=True, slots=True)
class Results:
    """What an evaluation found.

    Attributes:
        episodes: Of each case that has any, in order of its seeds.
        summaries: Likewise.
        comparisons: Of the first policy with each other one, by their names.
        films: Of failures, by case.
        items: Number of work items.
        failed: Number of items without a result.
        seconds: Wall time.
    """

    episodes: Mapping[Case, Sequence[dict[str, Any]]]
    summaries: Mapping[Case, Summary]
    comparisons: Mapping[tuple[str, str], Comparison]
    items: int
    failed: int
    seconds: float
    films: dict[Case, list[Film]] = field(default_factory=dict)

    def figures(self) -> dict[str, Any]:
        """Return all figures, JSON data: over all episodes, by case, comparisons.

        Over several cases, `stratified` is the bootstrap interval of the success rate
        that keeps each case's share.
        """
        each = list(self.summaries.values())
        total = sum(s.episodes for s in each)
        successes = sum(s.successes for s in each)
        overall: dict[str, Any] = {"episodes": total, "successes": successes}
        if total:
            strata = [[e["succeeded"] for e in es] for es in self.episodes.values()]
            returns = [[e["return"] for e in es] for es in self.episodes.values()]
            overall |= {
                "success_rate": successes / total,
                "intervals": {
                    "confidence": 0.95,
                    "wilson": success_interval(successes, total, "wilson"),
                    "exact": success_interval(successes, total, "exact"),
                    "stratified": stratified_bootstrap(strata, _mean),
                },
                "iqm_return": interquartile_mean(np.concatenate(returns)),
                "iqm_return_interval": stratified_bootstrap(
                    returns, interquartile_mean
                ),
            }
        return overall | {
            "errors": [
                {"case": case.title, "seed": e["seed"]} | e["error"]
                for case, episodes in self.episodes.items()
                for e in episodes
                if e.get("error")
            ],
            "failed_items": self.failed,
            "seconds": round(self.seconds, 2),
            "cases": [_case(c) | asdict(s) for c, s in self.summaries.items()],
            "comparisons": [
                {"first": first, "second": second} | asdict(found)
                for (first, second), found in self.comparisons.items()
            ],
        }

    def as_lerobot(self) -> dict[str, Any]:
        """Return the content of `eval_info.json` as LeRobot's `lerobot-eval` writes it.

        A task group is a benchmark with its robots, controller and policy; the id is
        its number among all.

        Source: LeRobot 0.6.1, `lerobot.scripts.lerobot_eval`.
        """
        films = {c: [str(f.path) for f in self.films.get(c, ())] for c in self.episodes}
        per_task = [
            {
                "task_group": case.title,
                "task_id": k,
                "metrics": {
                    "sum_rewards": [e["return"] for e in episodes],
                    "max_rewards": [e["max_reward"] for e in episodes],
                    "successes": [e["succeeded"] for e in episodes],
                    "video_paths": films[case],
                    "predicted_video_paths": [],
                },
            }
            for k, (case, episodes) in enumerate(self.episodes.items())
        ]
        groups = {
            case.title: _lerobot_group(episodes, films[case])
            for case, episodes in self.episodes.items()
        }
        everyone = [e for episodes in self.episodes.values() for e in episodes]
        overall = _lerobot_group(
            everyone, [path for paths in films.values() for path in paths]
        )
        per_episode = self.seconds / max(1, len(everyone))
        time = {"eval_s": self.seconds, "eval_ep_s": per_episode}
        return {"per_task": per_task, "per_group": groups, "overall": overall | time}


def collect(
    items: Mapping[Case, Sequence[WorkItem]],
    outcomes: Sequence[Outcome],
    *,
    seconds: float,
) -> Results:
    """Collect the outcomes of `run_rollouts` by case."""
    by_name = {outcome.name: outcome for outcome in outcomes}
    played = {
        case: [e for item in mine for e in episodes_of(item, by_name[item.name])]
        for case, mine in items.items()
    }
    played = {case: episodes for case, episodes in played.items() if episodes}
    return Results(
        episodes=played,
        summaries={case: summarise(episodes) for case, episodes in played.items()},
        comparisons=_comparisons(played),
        items=len(outcomes),
        failed=sum(outcome.error is not None for outcome in outcomes),
        seconds=seconds,
    )


def episodes_of(item: WorkItem, outcome: Outcome) -> list[dict[str, Any]]:
    """Return the episodes of an item of `run_rollouts`; they failed if it failed."""
    if outcome.error is None:
        return outcome.result["episodes"]
    return [
        failed_episode(seed, ErrorKind.ITEM, outcome.error)
        for seed in item.payload["seeds"]
    ]


def _comparisons(
    played: Mapping[Case, Sequence[dict[str, Any]]],
) -> dict[tuple[str, str], Comparison]:
    by_policy: dict[str, dict[str, Sequence[dict[str, Any]]]] = {}
    for case, episodes in played.items():
        scene = f"{case.benchmark} {'+'.join(case.robots)} {case.controller}"
        scene += f" {case.perturb}"
        by_policy.setdefault(case.policy, {})[scene] = episodes
    first, *others = by_policy or [""]
    return {
        (first, other): compare(by_policy[first], by_policy[other])
        for other in others
        if by_policy[first].keys() & by_policy[other].keys()
    }


def _case(case: Case) -> dict[str, Any]:
    return {
        "case": case.title,
        "benchmark": case.benchmark,
        "robots": list(case.robots),
        "controller": case.controller,
        "policy": case.policy,
        "perturb": case.perturb,
    }


def _lerobot_group(
    episodes: Sequence[Mapping[str, Any]], films: list[str]
) -> dict[str, Any]:
    def mean(key: str) -> float:
        return float(np.mean([e[key] for e in episodes])) if episodes else float("nan")

    return {
        "avg_sum_reward": mean("return"),
        "avg_max_reward": mean("max_reward"),
        "pc_success": 100.0 * mean("succeeded"),
        "n_episodes": len(episodes),
        "video_paths": films,
        "predicted_video_paths": [],
    }


def _mean(values: np.ndarray) -> float:
    return float(values.mean())
