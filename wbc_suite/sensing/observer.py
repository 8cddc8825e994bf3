"""Observations of an environment: one buffer, filled at once and handed out by key."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import gymnasium
import mujoco
import numpy as np

from wbc_suite.kinematics.array_table import ArrayTable
from wbc_suite.sensing.reading import BOUNDED, LARGEST, Reading, SeenField, fill
from wbc_suite.typing import Indices, Vector

__all__ = ["Observer"]

UNIT_KEYS = ("_quat", "_cos", "_sin")


class Observer:
    """Looks at a simulation.

    Readings stand one after the other in one buffer, group by group: a group's own key
    names all of it, as `object-state` holds all that is seen of objects. Keys that end
    in `_quat`, `_cos` or `_sin` are bounded by 1.

    Args:
        data: State of the simulation.
        groups: Readings by key, by the group's key; empty groups are left out.

    Attributes:
        values: What was seen last, all readings, shape (size,). A buffer.
        places: Where each key's values are in `values`; a group comes after its own.
        bounds: The largest size of each key's values.
        space: What can be seen, by key.
    """

    def __init__(
        self, data: mujoco.MjData, groups: Mapping[str, Mapping[str, Reading]]
    ) -> None:
        self.places = _lay_out(groups)
        self.bounds = {key: _bound(key) for key in self.places}
        end = max((place.stop for place in self.places.values()), default=0)
        readings = {
            key: reading for group in groups.values() for key, reading in group.items()
        }
        self._readings = readings
        self._chooses = any(r.choose is not None for r in readings.values())
        self._rows = self._ask_rows()
        self._computed = [
            (self.places[key], r.function)
            for key, r in readings.items()
            if r.function is not None and r.part is None
        ]
        self._apart: dict[Callable[[], Any], list[tuple[int, int]]] = {}
        for key, r in readings.items():
            if r.function is not None and r.part is not None:
                parts = self._apart.setdefault(r.function, [])
                parts.append((self.places[key].start, r.part))
        self._table = ArrayTable(
            SeenField, {f: getattr(data, f.name.lower()) for f in SeenField}
        )
        self.values: Vector = np.zeros(end)
        # Of groups from a second copy: those of single readings are others' arrays.
        places = self.places.items()
        self._cuts = [(key, int(key in groups), place) for key, place in places]
        self.space: gymnasium.spaces.Dict = gymnasium.spaces.Dict(
            {key: _box(key, place) for key, place in self.places.items()}
        )

    def start(self) -> None:
        """Begin an episode: ask what is seen in it."""
        if self._chooses:
            self._rows = self._ask_rows()

    def _ask_rows(self) -> Indices:
        """Return what `fill` is to do, shape (n, 3)."""
        rows = [
            (kind, index, self.places[key].start + at)
            for key, reading in self._readings.items()
            for kind, index, at in self._rows_of(key, reading)
        ]
        return np.array(rows, dtype=np.int64).reshape(-1, 3)

    def _rows_of(self, key: str, reading: Reading) -> Iterable[tuple[int, int, int]]:
        if reading.choose is not None:
            return reading.choose()
        if reading.function is None:
            return reading.rows
        return [(BOUNDED, int(self.bounds[key]), at) for at in range(reading.size)]

    def look(self) -> None:
        """Read everything out of the simulation into `values`."""
        values = self.values
        for place, function in self._computed:
            values[place] = function()
        for function, parts in self._apart.items():
            found = function()
            for place, part in parts:
                values[place] = found[part]
        fill(self._rows, self._table.table, values)

    def observation(self) -> dict[str, Vector]:
        """Return what was seen last, by key; nobody else holds these arrays."""
        copies = self.values.copy(), self.values.copy()
        return {key: copies[which][place] for key, which, place in self._cuts}


def _lay_out(groups: Mapping[str, Mapping[str, Reading]]) -> dict[str, slice]:
    """Return where each reading, and after them their group, has its place."""
    places: dict[str, slice] = {}
    end = 0
    for group, readings in groups.items():
        begin = end
        for key, reading in readings.items():
            places[key] = slice(end, end + reading.size)
            end += reading.size
        if readings:
            places[group] = slice(begin, end)
    return places


def _box(key: str, place: slice) -> gymnasium.spaces.Box:
    bound = _bound(key)
    return gymnasium.spaces.Box(-bound, bound, (place.stop - place.start,), np.float64)


def _bound(key: str) -> float:
    return 1.0 if key.endswith(UNIT_KEYS) else LARGEST
