"""New observations and rewards at the states of recorded episodes."""

import math
import shutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from wbc_suite.envs import RobotEnv
from wbc_suite.errors import DatasetError
from wbc_suite.executors import Executor, WorkItem
from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.env_source import EnvSource, rebuild
from wbc_suite.recording.episode import Episode
from wbc_suite.recording.hdf5_writer import write_dataset
from wbc_suite.recording.replaying import play_states
from wbc_suite.recording.resumable_work import reading_pieces, run_pieces, work_folder

PART = 10  # maximum number of episodes of a work item; each item makes an environment


def extract(
    path: str | Path,
    out: str | Path,
    *,
    trust_files: bool = False,
    executor: Executor | None = None,
    workers: int = 1,
    on_progress: Callable[[int], None] = lambda _: None,
    **changes: Any,
) -> int:
    """Restore recorded states, and store observations and rewards; count episodes.

    The file `out` may be the same. Episodes are split among `workers` of the executor,
    or run in this process. Finished parts wait in `OUT.work`: a stopped extraction
    continues when called again. `on_progress` is called with the number of episodes of
    each part. `changes` are arguments of the environment, such as `use_camera_obs`,
    `camera_names`, `reward_shaping`; for `trust_files` see `EnvSource.build`.

    Raises:
        DatasetError: If the environment cannot be made, or states do not fit.
    """
    path, out = Path(path), Path(out)
    with Dataset(path) as dataset:
        if not len(dataset):
            raise DatasetError(f"'{path}' has no episodes.")
        names, masks = dataset.names, dataset.masks
    size = min(PART, math.ceil(len(names) / workers))
    common = {"trust_files": trust_files, "changes": changes}
    done = run_pieces(
        extract_part,
        [common | {"names": names[k : k + size]} for k in range(0, len(names), size)],
        source=path,
        out=out,
        executor=executor,
        on_piece=lambda item, _: on_progress(len(item.payload["names"])),
    )
    folder = work_folder(out)
    parts = [folder / f"{item.name}.hdf5" for item, _ in done]

    def episodes() -> Iterator[Episode]:
        for part in parts:
            with Dataset(part, alone=True, checked=True) as dataset:
                yield from dataset

    with reading_pieces(out):
        with Dataset(parts[0], alone=True, checked=True) as first:
            header = first.header
        needed = sum(part.stat().st_size for part in parts)
        write_dataset(out, episodes(), header, masks=masks, needed=needed)
    shutil.rmtree(folder, ignore_errors=True)
    return len(names)


def extract_part(item: WorkItem, folder: Path) -> dict[str, Any]:
    """Extract a few episodes into `FOLDER/ITEM.hdf5`."""
    payload = item.payload
    with Dataset(payload["source"]) as dataset:
        env = rebuild(dataset, trust_files=payload["trust_files"], **payload["changes"])
        try:
            header = dataset.header | {"env_args": EnvSource.of(env).text}
            chosen = (observe_again(env, dataset.episode(n)) for n in payload["names"])
            write_dataset(folder / f"{item.name}.hdf5", chosen, header)
        finally:
            env.close()
    return {"episodes": len(payload["names"])}


def observe_again(env: RobotEnv, episode: Episode) -> Episode:
    """Return an episode with an environment's observations and rewards at its states.

    Delays of sensors are those of a robot at rest. The last reward is the recorded one
    where the state after it is missing.
    """
    observations: list[dict[str, Any]] = []
    rewards: list[float] = []
    for k in play_states(env, episode):
        if k < episode.length:
            observations.append(env.observation())
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
    for key in observations[0]:
        columns[f"obs/{key}"] = np.array([row[key] for row in observations])
    return replace(episode, columns=columns)
