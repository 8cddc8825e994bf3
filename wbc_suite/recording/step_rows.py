"""Steps of an environment as rows: what was before an action, and what came of it.

A recorder works after a step has filled the processor's caches with other things, so
that each object it touches costs more than the numbers it copies. Three calls write a
step here: its action, what tells how it went, and state and readings at once.
"""

import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import wrappers as known
from numpy.typing import ArrayLike

from wbc_suite.envs import RobotEnv
from wbc_suite.errors import DatasetError
from wbc_suite.recording.episode import Column
from wbc_suite.recording.row_log import RowLog
from wbc_suite.sensing.observer import Observer

__all__ = ["StepRows"]

OUTCOME = (
    ("rewards", "f8"),
    ("dones", "i8"),
    ("clipped", "i8"),
    ("step_time", "f8"),
    ("stamp", "f8"),
)
"""The end of a row; the time of the next one's state comes right after it."""
_PACKED = struct.Struct("=dqqddd")
_HAND_ON = (
    known.OrderEnforcing,
    known.PassiveEnvChecker,
    known.RecordEpisodeStatistics,
    known.TimeLimit,
)
"""Wrappers of Gymnasium's that do not change what is seen."""


class StepRows:
    """Rows of the episode in progress.

    Args:
        env: One of our environments, wrapped or not.
        folder: See `RowLog`.
    """

    def __init__(self, env: Any, folder: Path) -> None:
        self._env: RobotEnv = env.unwrapped
        self._whole = _hands_on(env)
        self._log = RowLog(folder)

    def __len__(self) -> int:
        """Return the number of steps."""
        return len(self._log)

    def begin(self) -> None:
        """Begin an episode where the environment stands."""
        env, data = self._env, self._env.simulation.data
        state, seen = env.physics_state, env.observation()
        self._observables, self._observer = env.observables, env.observer
        places = self._observer.places if self._whole else {}
        apart = {k: np.asarray(v) for k, v in seen.items() if k not in places}
        self._places = {k: place for k, place in places.items() if k in seen}
        self._keys = tuple(seen)
        values = self._observer.values if self._whole else np.empty(0)
        self._log.begin(_kind(state, values, apart, env.action_layout.size))
        self._data, self._sources = data, (data.qpos, data.qvel, values)
        self._bind(apart)
        block = self._log.block
        block["states"][0], block["seen"][0] = state, values
        for name, field in self._apart:
            field[0] = seen[name]

    def add(
        self,
        action: ArrayLike,
        observation: Mapping[str, Any],
        outcome: tuple[float, int, int, float, float],
    ) -> None:
        """Complete a row by what came of its action, and begin the next one.

        Args:
            action: The action, as it was given.
            observation: What was seen after it; only what a wrapper may have changed
                and pictures are taken from there.
            outcome: Values of `OUTCOME`.

        Raises:
            DatasetError: If something else is seen than before the first action, or
                the disk is full.
        """
        log, name = self._log, "actions"
        at = log.at
        if self._observables.observer is not self._observer:
            self._look_elsewhere(self._observables.observer)
        try:
            self._actions[at] = action
            begin = self._outcome + at * self._width
            _PACKED.pack_into(self._bytes, begin, *outcome, self._data.time)
            np.concatenate(self._sources, out=self._after_time[at + 1])
            for name, field in self._apart:
                field[at + 1] = observation[name]
        except (KeyError, ValueError) as error:
            raise _differs(name, error) from error
        log.advance()

    def columns(self, *, next_obs: bool = False) -> tuple[dict[str, Column], Column]:
        """Return columns by name, read-only, and the state after the last action.

        Args:
            next_obs: Whether what was seen after each action is among them.

        Raises:
            DatasetError: If the disk is full.
        """
        rows = self._log.rows()
        taken, after = rows[:-1], rows[1:]
        names = "states", "actions", *(name for name, _ in OUTCOME)
        columns = {name: taken[name] for name in names}
        for before, some in (("obs", taken), ("next_obs", after))[: 1 + next_obs]:
            columns |= {f"{before}/{key}": self._seen(some, key) for key in self._keys}
        return columns, rows["states"][-1].copy()

    def close(self) -> None:
        """Forget everything."""
        self._log.close()

    def _seen(self, rows: Column, key: str) -> Column:
        place = self._places.get(key)
        return rows[f"obs/{key}"] if place is None else rows["seen"][:, place]

    def _bind(self, apart: Mapping[str, Any]) -> None:
        """Find the places in the block that steps are written to."""
        block, wide = self._log.block, self._log.block.itemsize
        fields = block.dtype.fields
        assert fields is not None, "rows have names"
        self._bytes, self._width = block.view(np.uint8).data, wide
        self._outcome = fields["rewards"][1]
        assert self._outcome + _PACKED.size == wide + 8, "time follows the outcome"
        self._actions = block["actions"]
        self._apart = [(key, block[f"obs/{key}"]) for key in apart]
        count = sum(source.size for source in self._sources)
        self._after_time = np.ndarray(
            (len(block), count), buffer=block, offset=8, strides=(wide, 8)
        )

    def _look_elsewhere(self, observer: Observer) -> None:
        """Go on with another observer of the same keys."""
        if self._whole and observer.places != self._observer.places:
            raise _differs("observation", "other keys are observed")
        self._observer = observer
        if self._whole:
            self._sources = (*self._sources[:2], observer.values)


def _kind(
    state: Column, values: Column, apart: Mapping[str, Column], actions: int
) -> np.dtype[Any]:
    """Return a row's type; state and readings first, the outcome last."""
    fields = [("states", "f8", state.shape), ("seen", "f8", values.shape)]
    fields += [(f"obs/{key}", a.dtype, a.shape) for key, a in apart.items()]
    fields += [("actions", "f8", (actions,))]
    fields += [(name, kind, ()) for name, kind in OUTCOME]
    return np.dtype(fields, align=True)


def _hands_on(env: Any) -> bool:
    """Return whether a wrapped environment's readings arrive as they were read."""
    while isinstance(env, gymnasium.Wrapper):
        kind = type(env)
        ours = kind.__module__.startswith("wbc_suite.") or kind in _HAND_ON
        if not ours and kind.step is not gymnasium.Wrapper.step:
            return False
        env = env.env
    kind = type(env)
    return kind.step is RobotEnv.step and kind.observation is RobotEnv.observation


def _differs(name: str, error: object) -> DatasetError:
    return DatasetError(f"A step's '{name}' differs from the first step's: {error}.")
