"""Minari's dataset layout, by `h5py` alone.

    data/metadata.json       spaces, counts, the environment
    data/main_data.hdf5      episode_N: observations (n + 1 rows), actions, rewards,
                             terminations, truncations, infos

`minari.MinariDataset(OUT / "data")` reads it; with OUT in `MINARI_DATASETS_PATH`,
`minari.load_dataset(name of OUT)`.

Source: minari 0.5.4, `minari/dataset/_storages/hdf5_storage.py`.
"""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from wbc_suite.atomic_files import new_folder, replace_file, write_bytes
from wbc_suite.errors import DatasetError
from wbc_suite.recording.converting.layout import Layout, Piece, Progress
from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.episode import Episode
from wbc_suite.registration import WITH_ID, environment_id

VERSION = "0.5.4"
_NAME = re.compile(r"[-\w]+?-v\d+\Z")


def _write(dataset: Dataset, piece: Piece, out: Path, on_progress: Progress) -> None:
    """Write the episodes into a folder; pictures are not compressed as JPEG."""
    first = dataset.episode(piece.names[0])
    steps = 0

    def write(temporary: Path) -> None:
        nonlocal steps
        with h5py.File(temporary, "w", track_order=True) as file:
            for number, episode in enumerate(map(dataset.episode, piece.names)):
                if set(episode.columns) != set(first.columns):
                    raise DatasetError(
                        f"'{episode.name}' has other columns than the first episode."
                    )
                _write_episode(file.create_group(f"episode_{number}"), number, episode)
                steps += episode.length
                on_progress(1)

    (out / "data").mkdir(parents=True)
    main = out / "data/main_data.hdf5"
    replace_file(main, write)
    spaces = {key: _box(first.columns[f"obs/{key}"]) for key in first.observed}
    metadata = {
        "total_episodes": len(dataset),
        "total_steps": steps,
        "data_format": "hdf5",
        "jpeg_encoding": False,
        "observation_space": json.dumps({"type": "Dict", "subspaces": spaces}),
        "action_space": json.dumps(_action_space(dataset, first)),
        "env_spec": json.dumps(_env_spec(dataset)),
        "dataset_id": _dataset_id(dataset, out),
        "minari_version": VERSION,
        "dataset_size": round(main.stat().st_size / 1e6, 1),
        "requirements": ["wbc-suite"],
        "description": "Converted by wbc-suite from a recording in robomimic's layout.",
    }
    content = json.dumps({k: v for k, v in metadata.items() if v != "null"}, indent=1)
    write_bytes(out / "data/metadata.json", content.encode())


def _write_episode(group: h5py.Group, number: int, episode: Episode) -> None:
    columns = episode.columns
    group.attrs["id"] = number
    group.attrs["total_steps"] = episode.length
    for name in ("seed", "success", "uid"):
        if name in episode.facts:
            group.attrs[name] = episode.facts[name]
    observations = group.create_group("observations")
    for key in episode.observed:
        before = columns[f"obs/{key}"]
        last = columns.get(f"next_obs/{key}", before)[-1:]
        observations[key] = np.concatenate([before, last])
    group["actions"] = columns["actions"]
    group["rewards"] = columns.get("rewards", np.zeros(episode.length))
    ended = np.arange(episode.length) == episode.length - 1
    solved = ended & bool(episode.success)
    group["terminations"] = solved
    group["truncations"] = ended & ~solved
    infos = group.create_group("infos")  # of n + 1 rows; the first is of the reset
    for name in ("clipped", "step_time", "stamp"):
        if name in columns:
            zeros = np.zeros_like(columns[name][:1])
            infos[name] = np.concatenate([zeros, columns[name]])
    if "states" in columns:
        states, final = columns["states"], episode.final_state
        last = states[-1:] if final is None else final[None]
        infos["states"] = np.concatenate([states, last])


def _action_space(dataset: Dataset, first: Episode) -> dict[str, Any]:
    """Return the space of actions; without bounds where the recording has none."""
    space = _box(first.columns["actions"])
    try:
        low, high = json.loads(str(dataset.header["action_bounds"]))
        bounds = np.array([low, high], dtype=np.float64)
    except (KeyError, ValueError, TypeError, OverflowError, RecursionError):
        return space
    if bounds.shape != (2, *space["shape"]):
        return space
    return {**space, "low": bounds[0].tolist(), "high": bounds[1].tolist()}


def _box(column: NDArray[Any]) -> dict[str, Any]:
    shape = column.shape[1:]
    low, high = (0, 255) if column.dtype == np.uint8 else (-np.inf, np.inf)
    return {
        "type": "Box",
        "dtype": str(column.dtype),
        "shape": list(shape),
        "low": np.full(shape, low).tolist(),
        "high": np.full(shape, high).tolist(),
    }


def _env_spec(dataset: Dataset) -> Mapping[str, Any] | None:
    """Return Gymnasium's description of the environment, if it is registered."""
    try:
        source = json.loads(str(dataset.header.get("env_args", "{}")))
        name, arguments = source["env_name"], dict(source.get("env_kwargs", {}))
    except (ValueError, KeyError, TypeError, RecursionError):
        return None
    if source.get("package") != "wbc_suite" or name not in WITH_ID:
        return None
    return {
        "id": environment_id(name),
        "entry_point": "wbc_suite.envs.env:RobotEnv",
        "reward_threshold": None,
        "nondeterministic": False,
        "max_episode_steps": None,
        "order_enforce": True,
        "disable_env_checker": False,
        "kwargs": {**arguments, "benchmark": name},
        "additional_wrappers": [],
        "vector_entry_point": "wbc_suite.envs.vector:VectorRobotEnv",
    }


def _dataset_id(dataset: Dataset, out: Path) -> str:
    """Return the folder's name where it can be Minari's, else the benchmark's."""
    if _NAME.match(out.name):
        return out.name
    word = re.sub(r"\W+", "-", str(dataset.header.get("env", "demonstrations")))
    return f"{word.strip('-').lower() or 'demonstrations'}-v0"


LAYOUT = Layout(begin=lambda out: new_folder(out, "a Minari dataset"), write=_write)
