"""One compressed NumPy file for each episode; `np.load` needs no pickle for them.

Keys are the names of columns, with `.` for `/`, and `final_state`, `success`, `seed`.
"""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from wbc_suite.recording.atomic_files import check_folder, replace_file
from wbc_suite.recording.converting.layout import Layout, Piece, Progress
from wbc_suite.recording.dataset import Dataset


def _write(dataset: Dataset, piece: Piece, out: Path, on_progress: Progress) -> None:
    """Write each episode as `demo_N.npz` into a folder."""
    check_folder(out)
    for episode in map(dataset.episode, piece.names):
        arrays: dict[str, Any] = {
            name.replace("/", "."): column for name, column in episode.columns.items()
        }
        if episode.final_state is not None:
            arrays["final_state"] = episode.final_state
        known = {"success", "seed"} & episode.facts.keys()
        arrays |= {name: episode.facts[name] for name in known}
        replace_file(out / f"{episode.name}.npz", partial(_save, arrays=arrays))
        on_progress(1)


def _save(path: Path, *, arrays: dict[str, Any]) -> None:
    with path.open("wb") as file:
        np.savez_compressed(file, **arrays)


LAYOUT = Layout(begin=check_folder, write=_write, in_pieces=True)
