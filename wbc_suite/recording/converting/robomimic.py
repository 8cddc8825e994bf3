"""robomimic's HDF5 layout with its own columns only."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from wbc_suite.recording.atomic_files import check_folder
from wbc_suite.recording.converting.layout import Layout, Piece, Progress
from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.episode import Episode
from wbc_suite.recording.hdf5_writer import write_dataset

_OTHER_COLUMNS = ("clipped", "step_time", "stamp")
_FACTS = ("model_file", "success", "seed", "uid")


def _write(dataset: Dataset, piece: Piece, out: Path, on_progress: Progress) -> None:
    """Write `demo_0`, ...; the last `next_obs` repeats `obs` if it was not recorded."""
    names = {name: f"demo_{k}" for k, name in enumerate(piece.names)}

    def episodes() -> Iterator[Episode]:
        for episode in map(dataset.episode, piece.names):
            yield _own_columns(episode, names[episode.name])
            on_progress(1)

    masks = {
        key: [names[name] for name in masked if name in names]
        for key, masked in dataset.masks.items()
    }
    write_dataset(out, episodes(), dataset.header, masks=masks)


def _own_columns(episode: Episode, name: str) -> Episode:
    columns = {n: c for n, c in episode.columns.items() if n not in _OTHER_COLUMNS}
    for key in episode.observed:
        before = columns[f"obs/{key}"]
        columns.setdefault(f"next_obs/{key}", np.concatenate([before[1:], before[-1:]]))
    facts = {n: f for n, f in episode.facts.items() if n in _FACTS}
    return replace(episode, name=name, columns=columns, facts=facts, final_state=None)


LAYOUT = Layout(begin=lambda out: check_folder(out.parent), write=_write)
