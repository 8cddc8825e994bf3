"""Observations of an environment in one buffer, handed out by key."""

from collections.abc import Mapping

import gymnasium
import mujoco
import numpy as np

from wbc_suite.sensing.reading import Reading
from wbc_suite.typing import Vector

LARGEST = 1e4
"""Bound of observations, SI units; larger values, as of impacts, are clipped."""

UNIT_KEYS = ("_quat", "_cos", "_sin")
"""Endings of keys whose values are bounded by 1."""


class ObservationBuffer:
    """Reads all observations but pictures from a simulation.

    Readings follow one another in one buffer, group by group: a group's key names all
    of its readings, as `object-state` names all readings of objects. Empty groups are
    left out.

    Attributes:
        values: All readings of the last `update`, shape (size,). A buffer.
        places: Slice of each key in `values`; a group comes after its readings.
        bounds: Largest absolute value of each key.
        space: Space of the observations, by key.
    """

    def __init__(
        self, data: mujoco.MjData, groups: Mapping[str, Mapping[str, Reading]]
    ) -> None:
        self.places = _places(groups)
        self.bounds = {
            key: 1.0 if key.endswith(UNIT_KEYS) else LARGEST for key in self.places
        }
        size = max((place.stop for place in self.places.values()), default=0)
        self.values: Vector = np.zeros(size)
        self._high: Vector = np.zeros(size)
        self._reads = []
        for group in groups.values():
            for key, reading in group.items():
                place = self.places[key]
                self._reads.append((self.values[place], reading.bind(data)))
                self._high[place] = self.bounds[key]
        self._low: Vector = -self._high
        # A group is a slice of a second copy, so that no two keys share memory.
        self._cuts = [(k, int(k in groups), place) for k, place in self.places.items()]
        boxes: dict[str, gymnasium.Space] = {}
        for key, place in self.places.items():
            bound, shape = self.bounds[key], (place.stop - place.start,)
            boxes[key] = gymnasium.spaces.Box(-bound, bound, shape, np.float64)
        self.space: gymnasium.spaces.Dict = gymnasium.spaces.Dict(boxes)

    def update(self) -> None:
        """Read everything from the simulation into `values`, clipped to the bounds."""
        for place, read in self._reads:
            place[:] = read()
        np.maximum(self.values, self._low, out=self.values)
        np.minimum(self.values, self._high, out=self.values)

    def observation(self) -> dict[str, Vector]:
        """Return copies of the last readings by key, shape (size of the key,)."""
        copies = self.values.copy(), self.values.copy()
        return {key: copies[which][place] for key, which, place in self._cuts}


def _places(groups: Mapping[str, Mapping[str, Reading]]) -> dict[str, slice]:
    """Return the slice of each reading, and after them that of their group."""
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
