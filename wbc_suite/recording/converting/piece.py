"""Episodes that are converted together, wherever the others are converted."""

import math
from dataclasses import dataclass

from wbc_suite.recording.dataset import Dataset

__all__ = ["Piece", "pieces_of", "whole"]

MOST = 50
"""Episodes of a piece that is one of several: what is lost with a killed worker."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Piece:
    """Some of a dataset's episodes, one after the other.

    Attributes:
        number: Of the piece.
        names: Of its episodes.
        start: Actions before its first one, in the whole dataset.
        before: Episodes before its first one.
    """

    number: int
    names: tuple[str, ...]
    start: int
    before: int


def whole(dataset: Dataset) -> Piece:
    """Return the piece that is all of a dataset."""
    return Piece(number=0, names=dataset.names, start=0, before=0)


def pieces_of(dataset: Dataset, workers: int) -> list[Piece]:
    """Share a dataset's episodes out among so many workers."""
    names = dataset.names
    size = min(MOST, math.ceil(len(names) / workers))
    pieces, start = [], 0
    for before in range(0, len(names), size):
        chosen = names[before : before + size]
        pieces.append(
            Piece(number=len(pieces), names=chosen, start=start, before=before)
        )
        start += sum(dataset.length(name) for name in chosen)
    return pieces
