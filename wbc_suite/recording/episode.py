"""One recorded episode: columns of numbers, and facts."""

import hashlib
import mmap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Column: TypeAlias = NDArray[Any]  # one row per action
Fact: TypeAlias = str | int | float | bool  # a value about a whole episode

PIECE = 1 << 20  # bytes that are read at once while a column is written


@dataclass(frozen=True, kw_only=True, slots=True)
class Episode:
    """Columns and facts of one episode.

    Attributes:
        name: `demo_0`, `demo_1`, ...
        columns: By name, each of shape (n, ...): `states` before each action (time,
            qpos, qvel), `actions`, `rewards`, `dones`, `obs/KEY` before each action,
            perhaps `next_obs/KEY`, `clipped`, `step_time` s, `stamp` s.
        facts: `success`, `seed`, `rng_state`, `model_file`, ...
        final_state: State after the last action, if it was recorded.
    """

    name: str
    columns: Mapping[str, Column]
    facts: Mapping[str, Fact]
    final_state: Column | None = None

    @property
    def length(self) -> int:
        """Number of actions."""
        return len(self.columns["actions"])

    @property
    def success(self) -> bool | None:
        """Whether it succeeded; None if this is not recorded."""
        success = self.facts.get("success")
        return None if success is None else bool(success)

    @property
    def observed(self) -> tuple[str, ...]:
        """Keys of observations."""
        return tuple(k.removeprefix("obs/") for k in self.columns if k[:4] == "obs/")


def fingerprint(columns: Mapping[str, Column], final_state: Column | None) -> str:
    """Return the SHA-256 of all numbers, with their names, types and shapes."""
    digest = hashlib.sha256()
    named = dict(columns)
    if final_state is not None:
        named["final_state"] = final_state
    for name in sorted(named):
        column = named[name]
        digest.update(f"{name} {column.dtype.str} {column.shape or (1,)}\n".encode())
        for _, piece in pieces(column):
            digest.update(piece.tobytes())
    return digest.hexdigest()


def pieces(column: Column) -> Iterator[tuple[int, Column]]:
    """Yield contiguous pieces of at most a megabyte, and their first rows' numbers."""
    if not column.ndim:
        column = np.reshape(column, 1)
    wide = abs(column.strides[0]) if isinstance(column, np.ndarray) else 0
    wide = max(column[:1].nbytes, wide)
    rows = max(1, PIECE // wide if wide else len(column))
    for begin in range(0, len(column), rows):
        yield begin, np.ascontiguousarray(column[begin : begin + rows])
        _release_pages(column)  # of a mapped file; they would count as memory


def _release_pages(column: Column) -> None:
    if getattr(column, "flags", None) is None or column.flags.writeable:
        return
    held: Any = column
    while isinstance(held, np.ndarray):
        held = held.base
    if isinstance(held, mmap.mmap) and hasattr(mmap, "MADV_DONTNEED"):
        held.madvise(mmap.MADV_DONTNEED)
