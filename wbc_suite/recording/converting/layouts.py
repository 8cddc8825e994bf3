"""The layouts that a recording can be converted to."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TypeAlias

from wbc_suite.executors.item import Json
from wbc_suite.recording.converting.lerobot import (
    begin_lerobot,
    finish_lerobot,
    write_lerobot,
    write_lerobot_piece,
)
from wbc_suite.recording.converting.mcap import write_mcap
from wbc_suite.recording.converting.minari import write_minari
from wbc_suite.recording.converting.piece import Piece
from wbc_suite.recording.converting.plain import (
    write_npz,
    write_npz_piece,
    write_robomimic,
)
from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.episode import Episode
from wbc_suite.recording.files import check_folder

__all__ = ["LAYOUTS", "Layout", "Shares", "Tell"]

Tell: TypeAlias = Callable[[Episode], None]
Told: TypeAlias = Mapping[str, Json]


def _nothing_more(dataset: Dataset, out: Path, told: Sequence[Told]) -> None:
    pass


@dataclass(frozen=True, kw_only=True, slots=True)
class Shares:
    """How a layout is written by several workers, each a piece.

    Attributes:
        begin: Sees to it that the path can be written.
        piece: Writes a piece's own files, and says what others need of it.
        finish: Writes what is about all pieces, told what each said.
    """

    begin: Callable[[Path], None]
    piece: Callable[[Dataset, Piece, Path], Told]
    finish: Callable[[Dataset, Path, Sequence[Told]], None] = _nothing_more


@dataclass(frozen=True, kw_only=True, slots=True)
class Layout:
    """A layout of others.

    Attributes:
        write: Writes a dataset to a path, in one go.
        shares: How the work is shared out; None for one file that grows by its end.
    """

    write: Callable[[Dataset, Path, Tell], Path]
    shares: Shares | None = None


LAYOUTS: Mapping[str, Layout] = MappingProxyType(
    {
        "robomimic": Layout(write=write_robomimic),
        "npz": Layout(
            write=write_npz, shares=Shares(begin=check_folder, piece=write_npz_piece)
        ),
        "lerobot": Layout(
            write=write_lerobot,
            shares=Shares(
                begin=begin_lerobot, piece=write_lerobot_piece, finish=finish_lerobot
            ),
        ),
        "minari": Layout(write=write_minari),
        "mcap": Layout(write=write_mcap),
    }
)
