"""Other observations and rewards of episodes that were recorded long ago."""

import json
import math
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from wbc_suite.envs import RobotEnv
from wbc_suite.errors import DatasetError
from wbc_suite.executors import Executor, Item
from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.episode import Episode
from wbc_suite.recording.replaying import play_states
from wbc_suite.recording.sharing import share_out, work_folder
from wbc_suite.recording.source import EnvSource, rebuild
from wbc_suite.recording.writing import write_dataset

__all__ = ["extract", "extract_part", "seen_again"]

PART = 10
"""Episodes of one item of work at most: each makes its environment anew."""


def extract(
    path: str | Path,
    out: str | Path,
    *,
    trust_files: bool = False,
    executor: Executor | None = None,
    workers: int = 1,
    tell: Callable[[int], None] = lambda _: None,
    **changes: Any,
) -> int:
    """Show every recorded state again, and store what is seen and rewarded.

    What is finished waits in `OUT.work`: stopped, it goes on when called again.

    Args:
        path: A recording, of anybody's whose states fit.
        out: File to write; it may be the same.
        trust_files: See `EnvSource.build`.
        executor: Who does the work; this process when left out.
        workers: How many it has: episodes are shared out among them.
        tell: Called with the number of episodes of each piece that is done.
        changes: Arguments of the environment, such as `use_camera_obs`,
            `camera_names`, `reward_shaping`.

    Returns:
        The number of episodes.

    Raises:
        DatasetError: If the environment cannot be made, or states do not fit.
    """
    path, out = Path(path), Path(out)
    with Dataset(path) as dataset:
        if not len(dataset):
            raise DatasetError(f"'{path}' has no episodes.")
        names, masks = dataset.names, dataset.masks
    size = min(PART, math.ceil(len(names) / workers))
    common = {"trust_files": trust_files, "changes": json.loads(json.dumps(changes))}
    done = share_out(
        extract_part,
        [
            {**common, "names": list(names[k : k + size])}
            for k in range(0, len(names), size)
        ],
        source=path,
        out=out,
        executor=executor,
        tell=lambda item: tell(len(_names(item))),
    )
    folder = work_folder(out)
    parts = [folder / f"{item.name}.hdf5" for item, _ in done]

    def episodes() -> Iterator[Episode]:
        for part in parts:
            with Dataset(part, alone=True) as dataset:
                yield from dataset

    with Dataset(parts[0], alone=True) as first:
        header = first.header
    needed = sum(part.stat().st_size for part in parts)
    write_dataset(out, episodes(), header, masks=masks, needed=needed)
    shutil.rmtree(folder, ignore_errors=True)
    return len(names)


def extract_part(item: Item, folder: Path) -> dict[str, Any]:
    """Do a few episodes; they are written to `FOLDER/ITEM.hdf5`."""
    told: Any = item.payload
    with Dataset(told["source"]) as dataset:
        env = rebuild(dataset, trust_files=told["trust_files"], **told["changes"])
        try:
            header = dataset.header | {"env_args": EnvSource.of(env).text}
            chosen = (seen_again(env, dataset.episode(n)) for n in told["names"])
            write_dataset(folder / f"{item.name}.hdf5", chosen, header)
        finally:
            env.close()
    return {"episodes": len(told["names"])}


def _names(item: Item) -> list[Any]:
    names: Any = item.payload["names"]
    return names


def seen_again(env: RobotEnv, episode: Episode) -> Episode:
    """Return an episode with what this environment sees and rewards at its states.

    What depends on the past, such as a delay or noise of a sensor, is as at rest; the
    last reward is as recorded where the state after it is missing.
    """
    seen: list[dict[str, Any]] = []
    rewards: list[float] = []
    for k in play_states(env, episode):
        if k < episode.length:
            seen.append(env.observation())
        if k > 0:
            reward = env.benchmark.reward(shaped=env.config.reward_shaping)
            rewards.append(reward * env.config.reward_scale)
    if len(rewards) < episode.length:
        recorded = episode.columns.get("rewards")
        rewards.append(float(recorded[-1]) if recorded is not None else rewards[-1])
    columns = {
        name: column
        for name, column in episode.columns.items()
        if not name.startswith(("obs/", "next_obs/"))
    }
    columns["rewards"] = np.array(rewards)
    for key in seen[0]:
        columns[f"obs/{key}"] = np.array([now[key] for now in seen])
    return replace(episode, columns=columns)
