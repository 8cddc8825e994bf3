"""Episodes of policies in environments, as work items of an executor."""

import re
import shutil
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
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


def plan_rollouts(
    cases: Iterable[Case], *, seeds: Sequence[int], chunk: int
) -> list[WorkItem]:
    """Split the episodes of all cases into items of `chunk` seeds each.

    An item depends on its own case and seeds only, so that results are found again
    when other cases are added. Raises ConfigError if there are no seeds.
    """
    if len(seeds) == 0 or chunk < 1:
        raise ConfigError(
            f"At least one seed and a chunk of at least 1 are needed, "
            f"not {len(seeds)} and {chunk}."
        )
    items = []
    for case in cases:
        title = re.sub(r"[^A-Za-z0-9]+", "-", case.title).strip("-")[:90]
        payload = payload_of(case)
        for start in range(0, len(seeds), chunk):
            mine = {"seeds": list(seeds[start : start + chunk])}
            label = f"{title}-{start:06d}"
            items.append(WorkItem.with_digest(label, payload | mine))
    return items


def payload_of(case: Case) -> dict[str, Any]:
    """Return a case as JSON data."""
    return asdict(case) | {"arguments": dict(case.arguments)}


def run_rollouts(item: WorkItem, folder: Path) -> dict[str, Any]:
    """Run an item; return `episodes`, one dictionary per episode.

    An episode counts as a success if the benchmark is solved at any step (`succeeded`),
    or at the last step (`success`). A physics error ends it as a failure. Recordings go
    to `episodes` in the folder, one file per item.
    """
    payload = item.payload
    env = inner = make_case(payload)
    if payload["record"]:
        path = folder / "episodes" / f"{item.name}.hdf5"
        path.unlink(missing_ok=True)  # a killed worker may have left a part
        shutil.rmtree(parts_folder(path), ignore_errors=True)
        env = DataCollection(inner, path)
    try:
        episodes = [
            run_episode(env, inner, seed, payload["policy"])
            for seed in payload["seeds"]
        ]
    finally:
        env.close()
    return {"episodes": episodes}


def make_case(payload: Mapping[str, Any], **more: Any) -> RobotEnv:
    """Make the environment of an item, with more arguments."""
    return make(
        payload["benchmark"],
        robots=payload["robots"],
        controller_configs=payload["controller"] or None,
        **payload["arguments"],
        **more,
    )


def run_episode(
    env: gymnasium.Env[Any, Any],
    inner: RobotEnv,
    seed: int,
    name: str,
    *,
    begin: Callable[[], None] = lambda: None,
    after_step: Callable[[], None] = lambda: None,
) -> dict[str, Any]:
    """Run an episode of a policy; `begin` is called after the reset.

    It ends as the environment says, or where the policy is `finished`.
    """
    observation, info = env.reset(seed=seed)
    begin()
    policy = make_policy(name, inner, seed)
    start, succeeded, over, rewards = time.perf_counter(), False, False, list[float]()
    with ExitStack() as stack:
        stack.callback(getattr(policy, "close", lambda: None))
        while not over:
            action = policy(observation)
            observation, reward, terminated, truncated, info = env.step(action)
            rewards.append(float(reward))
            succeeded = succeeded or bool(info["success"])
            over = terminated or truncated or getattr(policy, "finished", False)
            after_step()
    return {
        "seed": seed,
        "success": bool(info["success"]),
        "succeeded": succeeded,
        "return": sum(rewards),
        "max_reward": max(rewards),
        "steps": len(rewards),
        "seconds": round(time.perf_counter() - start, 4),
        "physics_error": info.get("physics_error"),
        "failure": info.get("failure"),
    }
