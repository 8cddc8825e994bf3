"""Layouts that need no package: robomimic's HDF5 alone, and NumPy's own."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from wbc_suite.errors import DatasetError
from wbc_suite.executors.item import Json
from wbc_suite.recording.converting.piece import Piece, whole
from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.episode import Episode
from wbc_suite.recording.files import check_folder
from wbc_suite.recording.writing import write_dataset

__all__ = ["write_npz", "write_npz_piece", "write_robomimic"]

_OURS = ("clipped", "step_time", "stamp")


def write_robomimic(
    dataset: Dataset, out: Path, tell: Callable[[Episode], None] = lambda _: None
) -> Path:
    """Write robomimic's columns and nothing else, with `next_obs` and `data/demo_N`.

    The last action's `next_obs` repeats its `obs` where it was not recorded.
    """

    def episodes() -> Iterator[Episode]:
        for k, episode in enumerate(dataset):
            columns = {n: c for n, c in episode.columns.items() if n not in _OURS}
            for key in episode.observed:
                seen = columns[f"obs/{key}"]
                columns.setdefault(
                    f"next_obs/{key}", np.concatenate([seen[1:], seen[-1:]])
                )
            facts = {
                n: f
                for n, f in episode.facts.items()
                if n in ("model_file", "success", "seed", "uid")
            }
            yield replace(
                episode,
                name=f"demo_{k}",
                columns=columns,
                facts=facts,
                final_state=None,
            )
            tell(episode)

    names = {name: f"demo_{k}" for k, name in enumerate(dataset.names)}
    masks = {
        key: [names[n] for n in held if n in names]
        for key, held in dataset.masks.items()
    }
    write_dataset(out, episodes(), dataset.header, masks=masks)
    return out


def write_npz(
    dataset: Dataset, out: Path, tell: Callable[[Episode], None] = lambda _: None
) -> Path:
    """Write each episode as `demo_N.npz` into a folder; `np.load` needs no pickle.

    Keys are the columns' names, with `.` for `/`, and `final_state`, `success`, `seed`.
    """
    write_npz_piece(dataset, whole(dataset), out, tell)
    return out


def write_npz_piece(
    dataset: Dataset,
    piece: Piece,
    out: Path,
    tell: Callable[[Episode], None] = lambda _: None,
) -> dict[str, Json]:
    """Write some of the episodes."""
    check_folder(out)
    for episode in map(dataset.episode, piece.names):
        arrays = {n.replace("/", "."): c for n, c in episode.columns.items()}
        if episode.final_state is not None:
            arrays["final_state"] = episode.final_state
        for name in ("success", "seed"):
            if name in episode.facts:
                arrays[name] = np.asarray(episode.facts[name])
        try:
            np.savez_compressed(out / f"{episode.name}.npz", **arrays)  # pyright: ignore[reportArgumentType] - its stubs take the names for options
        except OSError as error:
            raise DatasetError(f"'{out}' cannot be written: {error}.") from error
        tell(episode)
    return {}
