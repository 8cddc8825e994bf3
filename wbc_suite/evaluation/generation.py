"""Recordings of many episodes of a policy, as work items of an executor."""

import json
import math
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from wbc_suite.envs import RobotEnv, make
from wbc_suite.evaluation.rollouts import run_episode
from wbc_suite.executors import Executor, WorkItem
from wbc_suite.recording import Dataset, Store
from wbc_suite.recording.dataset import parts_folder
from wbc_suite.recording.resumable_work import reading_pieces, run_pieces, work_folder
from wbc_suite.wrappers import DataCollection, Disturbance

PART = 20  # episodes of a work item
TRIES_PER_EPISODE = 20  # episodes that are played for each that is wanted, at most


@dataclass(frozen=True, kw_only=True, slots=True)
class Plan:
    """What is recorded.

    Attributes:
        benchmark: Name or file.
        arguments: Those of `wbc_suite.make`, plain JSON data.
        policy: See `make_policy`.
        noise: See `Disturbance`.
        pushes: Likewise.
        only_success: Whether other episodes are discarded.
        next_obs: See `DataCollection`.
    """

    benchmark: str
    arguments: Mapping[str, Any]
    policy: str = "expert"
    noise: float = 0.0
    pushes: float = 0.0
    only_success: bool = True
    next_obs: bool = False


@dataclass(frozen=True, kw_only=True, slots=True)
class Generated:
    """What came of it.

    Attributes:
        played: A dictionary for each episode, see `run_episode`.
        kept: How many of them are recorded.
        total: Episodes in the file, earlier ones included.
    """

    played: Sequence[Mapping[str, Any]]
    kept: int
    total: int

    @property
    def successes(self) -> int:
        """How many of the played episodes succeeded."""
        return sum(bool(each["success"]) for each in self.played)


def generate(
    plan: Plan,
    out: Path,
    *,
    episodes: int,
    first_seed: int = 0,
    executor: Executor | None = None,
    on_kept: Callable[[int], None] = lambda _: None,
) -> Generated:
    """Record so many episodes, and add them to a file in the order of their seeds.

    Seeds are taken one after the other until enough episodes are kept, or
    `TRIES_PER_EPISODE` times as many are played. Finished items wait in `OUT.work`:
    the same call goes on there. `on_kept` is called with the number of episodes that an
    item kept.

    Raises:
        DatasetError: If an item fails, or the file is of another environment.
    """
    tried, parts = 0, list[list[int]]()
    done: list[tuple[WorkItem, Mapping[str, Any]]] = []
    told: set[str] = set()
    names: list[tuple[Path, str]] = []
    while len(names) < episodes and tried < TRIES_PER_EPISODE * episodes:
        missing = episodes - len(names)
        if tried:  # as many as the share kept so far lets expect
            missing = math.ceil(missing * (tried + 1) / (len(names) + 1))
        last = min(tried + missing, TRIES_PER_EPISODE * episodes)
        for k in range(tried, last, PART):
            parts.append([first_seed + s for s in range(k, min(k + PART, last))])
        tried = last
        done = _run(plan, out, parts, executor, told, on_kept)
        names = [
            (work_folder(out) / f"{item.name}.hdf5", name)
            for item, result in done
            for name in result["kept"]
        ][:episodes]
    with reading_pieces(out):
        total = _add_to(out, names)
    shutil.rmtree(work_folder(out), ignore_errors=True)
    played = [each for _, result in done for each in result["episodes"]]
    return Generated(played=played, kept=len(names), total=total)


def _run(
    plan: Plan,
    out: Path,
    parts: Sequence[Sequence[int]],
    executor: Executor | None,
    told: set[str],
    on_kept: Callable[[int], None],
) -> list[tuple[WorkItem, Mapping[str, Any]]]:
    """Play the episodes that were not played yet; return all items and results."""

    def tell(item: WorkItem, result: Mapping[str, Any]) -> None:
        if item.name not in told:
            told.add(item.name)
            on_kept(len(result["kept"]))

    given = asdict(plan) | {"arguments": dict(plan.arguments)}
    return run_pieces(
        record_part,
        [given | {"seeds": seeds} for seeds in parts],
        source=Path(plan.policy),
        out=out,
        executor=executor if len(parts) > 1 else None,
        on_piece=tell,
    )


def record_part(item: WorkItem, folder: Path) -> dict[str, Any]:
    """Record a few episodes into `FOLDER/ITEM.hdf5`; return them, and names kept."""
    plan, path = item.payload, folder / f"{item.name}.hdf5"
    path.unlink(missing_ok=True)  # a killed worker may have left a part
    shutil.rmtree(parts_folder(path), ignore_errors=True)
    inner = _environment(plan["benchmark"], json.dumps(plan["arguments"]))
    disturbed = bool(plan["noise"] or plan["pushes"])
    env = inner
    if disturbed:
        env = Disturbance(inner, noise=plan["noise"], pushes=plan["pushes"])
    collected = DataCollection(
        env, path, automatic=False, next_obs=bool(plan["next_obs"])
    )
    recorder = collected.recorder
    recorder.notes = {"policy": Path(plan["policy"]).name}
    if disturbed:
        recorder.notes |= {"noise": plan["noise"], "pushes": plan["pushes"]}
    kept, episodes = [], []
    try:
        for seed in plan["seeds"]:
            played = run_episode(
                collected, inner, seed, plan["policy"], begin=recorder.begin
            )
            episodes.append(played)
            if played["success"] or not plan["only_success"]:
                kept.append(recorder.keep())
    finally:
        recorder.close()
    return {"episodes": episodes, "kept": kept}


@lru_cache(maxsize=1)
def _environment(benchmark: str, arguments: str) -> RobotEnv:
    """Make an environment, once for all items that a process works on."""
    return make(benchmark, **json.loads(arguments))


def _add_to(out: Path, names: Sequence[tuple[Path, str]]) -> int:
    """Add episodes of other files to a file; return how many are in it."""
    if not names:
        return 0
    with Dataset(names[0][0], alone=True, checked=True) as first:
        header = first.header
    with Store(out, header) as store:
        for path in dict.fromkeys(path for path, _ in names):
            with Dataset(path, alone=True, checked=True) as part:
                for name in (n for p, n in names if p == path):
                    store.add(part.episode(name))
        return len(store)
