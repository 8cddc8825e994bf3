"""Recordings in the layouts of other projects, written here or in pieces by workers."""

import shutil
from collections.abc import Mapping
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from wbc_suite.atomic_files import (
    check_folder,
    delete_temporaries,
    replace_file,
    temporary_path,
)
from wbc_suite.errors import DatasetError
from wbc_suite.executors import Executor, WorkItem
from wbc_suite.recording.converting import lerobot, mcap, minari, robomimic
from wbc_suite.recording.converting.layout import (
    Layout,
    Piece,
    Progress,
    split_dataset,
    whole_dataset,
)
from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.resumable_work import run_pieces, work_folder
from wbc_suite.registry import Registry

__all__ = ["LAYOUTS", "Layout", "Piece", "Progress", "convert", "register_layout"]

LAYOUTS: Registry[Layout] = Registry("layout")
"""Layouts by name: for `wbc-suite convert --to`."""

register_layout = LAYOUTS.register


def _write_npz(
    dataset: Dataset, piece: Piece, out: Path, on_progress: Progress
) -> None:
    """Write each episode as `demo_N.npz` into a folder; nothing in it is pickled.

    Keys are the names of columns, with `.` for `/`, and `final_state`, `success`,
    `seed`.
    """
    check_folder(out)
    for episode in map(dataset.episode, piece.names):
        arrays: dict[str, Any] = {
            name.replace("/", "."): column for name, column in episode.columns.items()
        }
        if episode.final_state is not None:
            arrays["final_state"] = episode.final_state
        known = {"success", "seed"} & episode.facts.keys()
        arrays |= {name: episode.facts[name] for name in known}
        write = partial(np.savez_compressed, **arrays)
        replace_file(out / f"{episode.name}.npz", write)
        on_progress(1)


register_layout("npz", Layout(begin=check_folder, write=_write_npz, in_pieces=True))
register_layout("robomimic", robomimic.LAYOUT)
register_layout("lerobot", lerobot.LAYOUT)
register_layout("minari", minari.LAYOUT)
register_layout("mcap", mcap.LAYOUT)


def convert(
    source: str | Path,
    out: str | Path,
    layout: str,
    on_progress: Progress = lambda _: None,
    *,
    executor: Executor | None = None,
    workers: int = 1,
) -> Path:
    """Write a recording in one of `LAYOUTS`, or `module:NAME`; return its path.

    Without an executor, this process writes one piece. With one, episodes are split
    among `workers`, and finished pieces wait in `OUT.work` until all are finished: a
    stopped conversion continues when called again. Layouts of one file are one piece.
    `on_progress` is called with the number of episodes since the last call.

    Raises:
        UnknownNameError: If there is no such layout.
        DatasetError: If a package is missing, or see `Dataset`.
    """
    source, out = Path(source), Path(out)
    chosen = LAYOUTS.find(layout)
    with Dataset(source) as dataset:
        if not len(dataset):
            raise DatasetError(f"'{source}' has no episodes.")
        chosen.begin(out)
        pieces = [whole_dataset(dataset)]
        if executor is None:
            aside = temporary_path(out)
            try:
                aside.mkdir()
                written = aside / out.name
                result = chosen.write(dataset, pieces[0], written, on_progress)
                chosen.finish(dataset, written, [result or {}])
                _move(written, out)
            finally:
                shutil.rmtree(aside, ignore_errors=True)
            return out
        if chosen.in_pieces:
            pieces = split_dataset(dataset, workers)
        common = {"layout": layout, "out": out.name}
        done = run_pieces(
            convert_piece,
            [common | {"piece": asdict(piece)} for piece in pieces],
            source=source,
            out=out,
            executor=executor,
            on_piece=lambda item, _: on_progress(len(item.payload["piece"]["names"])),
        )
        written = work_folder(out) / "written" / out.name
        chosen.finish(dataset, written, [result for _, result in done])
    delete_temporaries(written)
    _move(written, out)
    shutil.rmtree(work_folder(out), ignore_errors=True)
    return out


def convert_piece(item: WorkItem, folder: Path) -> Mapping[str, Any]:
    """Write one piece, under its final name, into the work folder."""
    payload = item.payload
    layout, piece = LAYOUTS.find(payload["layout"]), Piece(**payload["piece"])
    written = folder / "written" / payload["out"]
    if not layout.in_pieces:
        shutil.rmtree(written, ignore_errors=True)  # of a worker that died
    written.parent.mkdir(parents=True, exist_ok=True)
    with Dataset(payload["source"]) as dataset:
        return layout.write(dataset, piece, written, lambda _: None) or {}


def _move(written: Path, out: Path) -> None:
    """Move a file or a folder into place, or its content into one that has some."""
    try:
        if not (written.is_dir() and out.is_dir() and any(out.iterdir())):
            written.replace(out)
            return
        for path in sorted(written.iterdir()):
            path.replace(out / path.name)
    except OSError as error:
        raise DatasetError(f"'{out}' cannot be written: {error}.") from error
