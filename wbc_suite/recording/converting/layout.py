"""The interface of a layout that recordings are converted to."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.episode import Column, Episode

MAX_EPISODES = 50  # episodes of a piece, which are lost with a killed worker

Progress: TypeAlias = Callable[[int], None]
"""Called with the number of episodes that were written since the last call."""
Finish: TypeAlias = Callable[[Dataset, Path, Sequence[Mapping[str, Any]]], None]
"""Called with what was written, where, and the results of all pieces in order."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Piece:
    """Successive episodes of a dataset that one worker converts."""

    number: int
    names: tuple[str, ...]
    start: int  # number of actions in the dataset before these episodes
    before: int  # number of episodes before these


@dataclass(frozen=True, kw_only=True, slots=True)
class Layout:
    """How recordings are written in a format of another project.

    `begin` checks that packages are installed and the path can be written. `write`
    writes a piece, and returns what `finish` needs of it to write files about all. With
    `in_pieces`, several workers may each write a piece.
    """

    begin: Callable[[Path], None]
    write: Callable[[Dataset, Piece, Path, Progress], Mapping[str, Any] | None]
    finish: Finish = lambda *_: None
    in_pieces: bool = False


def policy_actions(episode: Episode) -> Column:
    """Return the actions that a policy shall imitate: intended, not disturbed ones."""
    return episode.columns.get("intended", episode.columns["actions"])


def whole_dataset(dataset: Dataset) -> Piece:
    """Return the piece that contains all episodes."""
    return Piece(number=0, names=dataset.names, start=0, before=0)


def split_dataset(dataset: Dataset, workers: int) -> list[Piece]:
    """Split a dataset among workers, in pieces of at most `MAX_EPISODES`."""
    names = dataset.names
    size = min(MAX_EPISODES, math.ceil(len(names) / workers))
    pieces, start = [], 0
    for before in range(0, len(names), size):
        chosen = names[before : before + size]
        pieces.append(
            Piece(number=len(pieces), names=chosen, start=start, before=before)
        )
        start += sum(dataset.length(name) for name in chosen)
    return pieces
