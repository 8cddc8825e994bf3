"""Steps of the episode in progress, in rows that go to disk."""

import mmap
import os
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wbc_suite.envs import RobotEnv
from wbc_suite.errors import DatasetError
from wbc_suite.recording.episode import Column

BLOCK_BYTES = 1 << 16  # rows are written to disk in blocks of so many bytes

OUTCOME = {"rewards": "f8", "dones": "i8", "clipped": "i8"}
OUTCOME |= {"step_time": "f8", "stamp": "f8"}
"""Columns of numbers that a step returns, and their types."""


class RowBuffer:
    """Rows of one structured type, in a file without a name in a folder.

    Two rows are in memory, in `pair`, an array that `begin` replaces: the one in
    progress, at index `at`, and the next one, at `1 - at`, which may be begun too.
    `advance` completes the first, and the places change their roles. Nothing is left in
    the folder, also after a crash.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._file: Any = None
        self.begin(np.dtype([]))

    def __len__(self) -> int:
        """Return the number of complete rows."""
        return self._count

    def begin(self, kind: np.dtype[Any]) -> None:
        """Delete all rows, and take rows of a type."""
        self.close()
        self.pair = np.zeros(2, dtype=kind)

    def advance(self) -> None:
        """Complete the row in progress; raise DatasetError if the disk is full."""
        self._write()
        self._count += 1
        self.at = 1 - self.at

    def rows(self) -> NDArray[Any]:
        """Return all complete rows and the one in progress, read-only.

        They are read from disk when they are used. Later rows do not change them, but
        for the last. Raises DatasetError if the disk is full.
        """
        self._write(in_progress=True)
        held = mmap.mmap(self._file.fileno(), 0, access=mmap.ACCESS_READ)
        return np.ndarray((self._count + 1,), self.pair.dtype, buffer=held)

    def close(self) -> None:
        """Delete all rows."""
        if self._file is not None:
            with suppress(OSError):  # of what a full disk did not take
                self._file.close()
        self._file = None
        self.at = self._count = 0

    def _write(self, *, in_progress: bool = False) -> None:
        """Append a row to the file; one in progress is replaced when it is complete."""
        row = self.pair[self.at : self.at + 1].view(np.uint8)
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile(  # noqa: SIM115 - closed by close()
                    dir=self._folder, buffering=BLOCK_BYTES
                )
            self._file.write(row)
            if in_progress:  # `seek` writes all that is buffered
                self._file.seek(-row.size, os.SEEK_CUR)
        except OSError as error:
            raise DatasetError(
                f"'{self._folder}' cannot be written: {error.strerror}. The episode in "
                "progress is lost; finished ones are safe."
            ) from error


class StepBuffer:
    """Steps of an environment's episode in progress, in a `RowBuffer` in a folder."""

    def __init__(self, env: Any, folder: Path) -> None:
        self._env: RobotEnv = env.unwrapped
        labelled = env.has_wrapper_attr("labels_actions")
        self._labels = ("intended", "disturbed") if labelled else ()
        self._rows = RowBuffer(folder)

    def __len__(self) -> int:
        """Return the number of steps."""
        return len(self._rows)

    def begin(self) -> None:
        """Begin an episode in the present state of the environment."""
        env = self._env
        observation = {k: np.asarray(v) for k, v in env.observation().items()}
        self._places, size = {}, 0
        for key, value in observation.items():
            if value.dtype == np.float64 and value.ndim == 1:
                self._places[key] = slice(size, size + value.size)
                size += value.size
        apart = {k: v for k, v in observation.items() if k not in self._places}
        self._keys = tuple(observation)
        fields = [("states", "f8", env.physics_state.shape), ("vectors", "f8", (size,))]
        fields += [(f"obs/{key}", a.dtype, a.shape) for key, a in apart.items()]
        fields += [("actions", "f8", (env.action_layout.size,))]
        fields += [(name, kind, ()) for name, kind in OUTCOME.items()]
        if self._labels:
            fields += [("intended", "f8", (env.action_layout.size,))]
            fields += [("disturbed", "i8", ())]
        self._rows.begin(np.dtype(fields, align=True))
        pair = self._rows.pair
        self._states, self._vectors = pair["states"], pair["vectors"]
        self._actions = pair["actions"]
        self._outcome = [pair[name] for name in OUTCOME]
        self._apart = [(key, pair[f"obs/{key}"]) for key in apart]
        self._write_state(0, observation)

    def add(
        self,
        action: ArrayLike,
        observation: Mapping[str, Any],
        outcome: tuple[float, int, int, float, float],
        info: Mapping[str, Any],
    ) -> None:
        """Complete a step with the values of `OUTCOME`, and begin the next one.

        The labels of `Disturbance` are in `info`.
        """
        at = self._rows.at
        try:
            self._actions[at] = action
            for column, value in zip(self._outcome, outcome, strict=True):
                column[at] = value
            for name in self._labels:
                self._rows.pair[name][at] = info[name]
            self._write_state(1 - at, observation)
        except KeyError as error:
            raise DatasetError(
                f"An observation lacks {error}, which the first one of the episode has."
            ) from error
        except ValueError as error:
            raise DatasetError(
                f"The shapes of a step differ from those of the first: {error}."
            ) from error
        self._rows.advance()

    def columns(self, *, next_obs: bool = False) -> tuple[dict[str, Column], Column]:
        """Return columns by name, read-only, and the state after the last action."""
        rows = self._rows.rows()
        before, after = rows[:-1], rows[1:]
        names = ("states", "actions", *OUTCOME, *self._labels)
        columns = {name: before[name] for name in names}
        for group, some in (("obs", before), ("next_obs", after))[: 1 + next_obs]:
            columns |= {f"{group}/{key}": self._column(some, key) for key in self._keys}
        return columns, rows["states"][-1].copy()

    def close(self) -> None:
        """Delete all steps."""
        self._rows.close()

    def _write_state(self, at: int, observation: Mapping[str, Any]) -> None:
        self._states[at] = self._env.physics_state
        vectors = [observation[key] for key in self._places]
        if vectors:
            np.concatenate(vectors, out=self._vectors[at])
        for key, column in self._apart:
            column[at] = observation[key]

    def _column(self, rows: Column, key: str) -> Column:
        place = self._places.get(key)
        return rows[f"obs/{key}"] if place is None else rows["vectors"][:, place]
