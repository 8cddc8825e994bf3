"""One compressed NumPy file for each episode; `np.load` needs no pickle for them.

Keys are the names of columns, with `.` for `/`, and `final_state`, `success`, `seed`.
"""

from pathlib import Path

import numpy as np

from wbc_suite.recording.atomic_files import check_folder, replace_file
from wbc_suite.recording.converting.layout import Layout, Piece, Progress
from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.episode import Episode


def _write(dataset: Dataset, piece: Piece, out: Path, on_progress: Progress) -> None:
    """Write each episode as `demo_N.npz` into a folder."""
    check_folder(out)
    for episode in map(dataset.episode, piece.names):
        _write_episode(episode, out / f"{episode.name}.npz")
        on_progress(1)


def _write_episode(episode: Episode, path: Path) -> None:
    arrays = {n.replace("/", "."): c for n, c in episode.columns.items()}
    if episode.final_state is not None:
        arrays["final_state"] = episode.final_state
    for name in ("success", "seed"):
        if name in episode.facts:
            arrays[name] = np.asarray(episode.facts[name])

    def write(temporary: Path) -> None:
        with temporary.open("wb") as file:
            np.savez_compressed(file, **arrays)  # pyright: ignore[reportArgumentType] - its stubs take the names for options

    replace_file(path, write)


NPZ = Layout(begin=check_folder, write=_write, in_pieces=True)
