"""Episodes of policies in environments, as work items of an executor."""

import re
import shutil
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import gymnasium

from wbc_suite.envs import RobotEnv, make
from wbc_suite.errors import ConfigError
from wbc_suite.evaluation.policies import make_policy
from wbc_suite.executors import WorkItem
from wbc_suite.recording.dataset import parts_folder
from wbc_suite.wrappers import DataCollection


@dataclass(frozen=True, kw_only=True, slots=True)
class Case:
    """An environment and the policy that acts in it.

    Benchmark and controller are names or files. `arguments` are further ones of
    `wbc_suite.make`, plain JSON data, sorted.
    """

    benchmark: str
    robots: tuple[str, ...]
    controller: str | None = None
    policy: str = "random"
    record: bool = False
    arguments: tuple[tuple[str, str | int | float | bool], ...] = ()

    @property
    def title(self) -> str:
        """The case in one line."""
        parts = (self.benchmark, "+".join(self.robots), self.controller, self.policy)
        return " ".join(p for p in parts if p)


def plan_rollouts(cases: Iterable[Case], *, seeds: range, chunk: int) -> list[WorkItem]:
    """Split the episodes of all cases into items of `chunk` seeds each.

    An item depends on its own case and seeds only, so that results are found again
    when other cases are added. Raises ConfigError if there are no seeds.
    """
    if len(seeds) == 0 or seeds.start < 0 or seeds.step != 1 or chunk < 1:
        raise ConfigError(f"Seeds {seeds} in chunks of {chunk}: at least one of each.")
    items = []
    for case in cases:
        title = re.sub(r"[^A-Za-z0-9]+", "-", case.title).strip("-")[:90]
        payload = asdict(case) | {"arguments": dict(case.arguments)}
        for start in range(seeds.start, seeds.stop, chunk):
            mine = {"seeds": [start, min(start + chunk, seeds.stop)]}
            label = f"{title}-{start:06d}"
            items.append(WorkItem.with_digest(label, payload | mine))
    return items


def run_rollouts(item: WorkItem, folder: Path) -> dict[str, Any]:
    """Run an item; return `episodes`, one dictionary per episode.

    An episode counts as a success if the benchmark is solved at any step (`succeeded`),
    or at the last step (`success`). A physics error ends it as a failure. Recordings go
    to `episodes` in the folder, one file per item.
    """
    payload = item.payload
    env = inner = make(
        payload["benchmark"],
        robots=payload["robots"],
        controller_configs=payload["controller"] or None,
        **payload["arguments"],
    )
    if payload["record"]:
        path = folder / "episodes" / f"{item.name}.hdf5"
        path.unlink(missing_ok=True)  # a killed worker may have left a part
        shutil.rmtree(parts_folder(path), ignore_errors=True)
        env = DataCollection(inner, path)
    try:
        seeds = range(*payload["seeds"])
        episodes = [run_episode(env, inner, s, payload["policy"]) for s in seeds]
    finally:
        env.close()
    return {"episodes": episodes}


def run_episode(
    env: gymnasium.Env[Any, Any],
    inner: RobotEnv,
    seed: int,
    name: str,
    *,
    begin: Callable[[], None] = lambda: None,
) -> dict[str, Any]:
    """Run an episode of a policy; `begin` is called after the reset."""
    observation, info = env.reset(seed=seed)
    begin()
    policy = make_policy(name, inner, seed)
    start, steps, total, succeeded, over = time.perf_counter(), 0, 0.0, False, False
    while not over:
        action = policy(observation)
        observation, reward, terminated, truncated, info = env.step(action)
        steps, total = steps + 1, total + float(reward)
        succeeded = succeeded or bool(info["success"])
        over = terminated or truncated
    return {
        "seed": seed,
        "success": bool(info["success"]),
        "succeeded": succeeded,
        "return": total,
        "steps": steps,
        "seconds": round(time.perf_counter() - start, 4),
        "physics_error": info.get("physics_error"),
    }
