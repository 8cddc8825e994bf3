"""Converting shared out among workers."""

import shutil
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from wbc_suite.errors import DatasetError
from wbc_suite.executors import Executor, Item
from wbc_suite.executors.item import Json
from wbc_suite.recording.converting.layouts import LAYOUTS
from wbc_suite.recording.converting.piece import Piece, pieces_of, whole
from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.sharing import share_out, work_folder

__all__ = ["convert_piece", "convert_shared"]

MADE = "made"
"""Where pieces write, in the folder of the work."""


def convert_shared(
    dataset: Dataset,
    out: Path,
    layout: str,
    *,
    executor: Executor,
    workers: int,
    tell: Callable[[int], None],
) -> None:
    """Convert piece by piece; see `convert`."""
    shares = LAYOUTS[layout].shares
    if shares is not None:
        shares.begin(out)
    pieces = [whole(dataset)] if shares is None else pieces_of(dataset, workers)
    done = share_out(
        convert_piece,
        [{"layout": layout, "piece": _as_json(piece)} for piece in pieces],
        source=dataset.path,
        out=out,
        executor=executor,
        tell=lambda item: tell(len(_piece(item).names)),
    )
    made = work_folder(out) / MADE
    if shares is not None:
        shares.finish(dataset, made, [result for _, result in done])
    _move(made, out)
    shutil.rmtree(work_folder(out), ignore_errors=True)


def convert_piece(item: Item, folder: Path) -> Mapping[str, Json]:
    """Write one piece to `FOLDER/made`; again, in place of what was begun there."""
    layout, made = LAYOUTS[str(item.payload["layout"])], folder / MADE
    with Dataset(str(item.payload["source"])) as dataset:
        if layout.shares is not None:
            return layout.shares.piece(dataset, _piece(item), made)
        shutil.rmtree(made, ignore_errors=True)
        layout.write(dataset, made, lambda _: None)
    return {}


def _as_json(piece: Piece) -> dict[str, Json]:
    return {**asdict(piece), "names": list(piece.names)}


def _piece(item: Item) -> Piece:
    told: Any = item.payload["piece"]
    return Piece(**{**told, "names": tuple(told["names"])})


def _move(made: Path, out: Path) -> None:
    """Put what was made in its place; a folder is filled."""
    try:
        if not made.is_dir():
            made.replace(out)
            return
        out.mkdir(parents=True, exist_ok=True)
        for path in sorted(made.iterdir()):
            path.replace(out / path.name)
    except OSError as error:
        raise DatasetError(f"'{out}' cannot be written: {error}.") from error
