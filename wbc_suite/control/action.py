"""Actions: one flat vector, cut into named slices with units and bounds."""

import math
import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import zip_longest
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from wbc_suite.compiling import compiled
from wbc_suite.errors import ActionError, ConfigError, UnknownNameError
from wbc_suite.typing import Vector

__all__ = ["ActionLayout", "ActionPart", "ActionSlice", "SliceKind"]

SliceKind = Literal[
    "pose",
    "position",
    "orientation",
    "gripper",
    "base",
    "posture",
    "velocity",
    "torque",
    "stiffness",
    "damping",
]

CELL = 40
"""Letters in a line of a printed layout's cell."""
FLOAT64 = np.dtype(np.float64)


@dataclass(frozen=True, kw_only=True, slots=True)
class ActionPart:
    """What one controller wants of the action: named values with units and bounds.

    Attributes:
        name: Name of the slice.
        kind: What the values mean.
        labels: One word per value.
        units: One unit per value.
        low: Least values.
        high: Greatest values.
    """

    name: str
    kind: SliceKind
    labels: tuple[str, ...]
    units: tuple[str, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]

    def __post_init__(self) -> None:
        sizes = {len(self.labels), len(self.units), len(self.low), len(self.high)}
        if len(sizes) != 1:
            raise ConfigError(f"Action part '{self.name}': lengths differ: {sizes}.")

    def prefixed(self, prefix: str) -> "ActionPart":
        """Return the same part under another name."""
        return ActionPart(
            name=prefix + self.name,
            kind=self.kind,
            labels=self.labels,
            units=self.units,
            low=self.low,
            high=self.high,
        )


@dataclass(frozen=True, kw_only=True, slots=True)
class ActionSlice(ActionPart):
    """An `ActionPart` with its place in the vector, `action[start:stop]`."""

    start: int
    stop: int


class ActionLayout:
    """The one owner of slices, names, bounds and units of an action.

    Args:
        parts: Parts in the order of the vector.

    Raises:
        ConfigError: If two parts have the same name.

    Attributes:
        slices: The parts with their places.
        low: Least values, shape (size,), read-only.
        high: Greatest values, shape (size,), read-only.
    """

    def __init__(self, parts: Iterable[ActionPart]) -> None:
        slices: list[ActionSlice] = []
        start = 0
        for part in parts:
            stop = start + len(part.labels)
            slices.append(
                ActionSlice(
                    name=part.name,
                    kind=part.kind,
                    labels=part.labels,
                    units=part.units,
                    low=part.low,
                    high=part.high,
                    start=start,
                    stop=stop,
                )
            )
            start = stop
        self.slices = tuple(slices)
        self.size = start
        self._by_name = {s.name: s for s in slices}
        if len(self._by_name) != len(slices):
            raise ConfigError(f"Action slices share a name: {[s.name for s in slices]}")
        self.low = _frozen([x for s in slices for x in s.low])
        self.high = _frozen([x for s in slices for x in s.high])

    def __getitem__(self, name: str) -> ActionSlice:
        """Return a slice by name; raises UnknownNameError."""
        if name not in self._by_name:
            raise UnknownNameError("action slice", name, self._by_name)
        return self._by_name[name]

    def __contains__(self, name: object) -> bool:
        return name in self._by_name

    def pack(
        self, values: Mapping[str, ArrayLike], *, base: ArrayLike | None = None
    ) -> Vector:
        """Put named values into one action.

        Args:
            values: Values by slice.
            base: Action that gives the slices that `values` leaves out, such as a
                controller's `hold_action`.

        Raises:
            UnknownNameError: If there is no such slice.
            ActionError: If a slice is missing without a base, or a shape is wrong.
        """
        missing = [s.name for s in self.slices if s.name not in values]
        if base is None and missing:
            raise ActionError(
                f"pack: no value for {', '.join(missing)}. Give them, or a base action."
            )
        action = np.zeros(self.size) if base is None else self.check(base)
        for name, value in values.items():
            part = self[name]
            array = np.atleast_1d(np.asarray(value, dtype=np.float64))
            if array.shape != (len(part.labels),):
                raise ActionError(
                    f"pack: slice '{name}' has {len(part.labels)} values "
                    f"({', '.join(part.labels)}), not shape {array.shape}."
                )
            action[part.start : part.stop] = array
        return action

    def unpack(self, action: ArrayLike) -> dict[str, Vector]:
        """Return the slices of an action by name, as copies."""
        vector = self.check(action)
        return {s.name: vector[s.start : s.stop].copy() for s in self.slices}

    def check(self, action: ArrayLike) -> Vector:
        """Return an action as a float64 copy.

        Raises:
            ActionError: If the shape or type is wrong or a value is not finite; names
                the index and the slice.
        """
        try:
            array = np.asarray(action)
        except ValueError as error:  # rows of different lengths
            raise ActionError(f"An action is a flat vector, not {action!r:.60}.") from (
                error
            )
        if array.dtype.kind not in "fiu":
            raise ActionError(
                f"An action holds real numbers, not {array.dtype} ({action!r:.60})."
            )
        if array.shape != (self.size,):
            raise ActionError(
                f"An action has shape ({self.size},), not {array.shape}. "
                "print(env.unwrapped.action_layout) explains the values."
            )
        vector = array.astype(np.float64)
        values = vector.tolist()
        if not all(map(math.isfinite, values)):
            bad = next(i for i, x in enumerate(values) if not math.isfinite(x))
            raise ActionError(
                f"Action value {vector[bad]} at index {bad} "
                f"({self.describe(bad)}) is not finite."
            )
        return vector

    def clip(self, action: Vector) -> tuple[Vector, int]:
        """Return the action within the bounds, and how many values were outside."""
        clipped = np.minimum(np.maximum(action, self.low), self.high)
        return clipped, int(np.count_nonzero(clipped != action))

    def take(self, action: ArrayLike) -> tuple[Vector, int]:
        """Check and clip an action; what `clip` returns of what `check` does.

        Raises:
            ActionError: See `check`.
        """
        if isinstance(action, np.ndarray) and action.dtype == FLOAT64:
            vector = action.copy()
            if vector.shape == self.low.shape:
                outside = _clip(vector, self.low, self.high)
                if outside >= 0:
                    return vector, outside
        return self.clip(self.check(action))

    def describe(self, index: int) -> str:
        """Return "slice: label" of one value."""
        for part in self.slices:
            if index < part.stop:
                return f"{part.name}: {part.labels[index - part.start]}"
        raise IndexError(index)

    def __str__(self) -> str:
        rows = [("slice", "kind", "index", "values", "unit", "low", "high")]
        for s in self.slices:
            rows.append(
                (
                    s.name,
                    s.kind,
                    f"{s.start}:{s.stop}",
                    " ".join(s.labels),
                    " ".join(dict.fromkeys(s.units)),
                    " ".join(f"{x:g}" for x in dict.fromkeys(s.low)),
                    " ".join(f"{x:g}" for x in dict.fromkeys(s.high)),
                )
            )
        return _table(rows)


def _table(rows: list[tuple[str, ...]]) -> str:
    """Return rows as lines; long cells go on below."""
    wrapped = [[textwrap.wrap(cell, CELL) or [""] for cell in row] for row in rows]
    widths = [
        max(len(x) for row in wrapped for x in row[k]) for k in range(len(rows[0]))
    ]
    lines = [
        "  ".join(cell.ljust(w) for cell, w in zip(line, widths, strict=True)).rstrip()
        for row in wrapped
        for line in zip_longest(*row, fillvalue="")
    ]
    return "\n".join(lines)


@compiled
def _clip(values: Vector, low: Vector, high: Vector) -> int:
    """Clip in place; return how many values were outside, or -1 if one is not finite.

    It keeps Python's lock, which other threads would take for longer than this takes.
    """
    outside = 0
    for i in range(len(values)):
        value = values[i]
        if not np.isfinite(value):
            return -1
        if not low[i] <= value <= high[i]:
            values[i] = min(max(value, low[i]), high[i])
            outside += 1
    return outside


def _frozen(values: list[float]) -> Vector:
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array
