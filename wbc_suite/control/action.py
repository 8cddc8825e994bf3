"""Actions: one flat vector of named slices with units and bounds."""

import math
import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from enum import StrEnum
from itertools import zip_longest

import numpy as np
from numpy.typing import ArrayLike

from wbc_suite.errors import ActionError, ConfigError, UnknownNameError
from wbc_suite.typing import Vector


class SliceKind(StrEnum):
    """What the values of a slice set."""

    POSE = "pose"
    POSITION = "position"
    ORIENTATION = "orientation"
    GRIPPER = "gripper"
    BASE = "base"
    POSTURE = "posture"
    VELOCITY = "velocity"
    TORQUE = "torque"
    STIFFNESS = "stiffness"
    DAMPING = "damping"


class Axis(StrEnum):
    """Components of a pose, and of the velocity of a base in its own axes."""

    X = "x"
    Y = "y"
    Z = "z"
    RX = "rx"
    RY = "ry"
    RZ = "rz"
    QX = "qx"
    QY = "qy"
    QZ = "qz"
    QW = "qw"
    YAW = "yaw"
    FORWARD = "forward"
    SIDEWAYS = "sideways"
    TURN = "turn"


@dataclass(frozen=True, slots=True)
class Unit:
    """What a value of 1 means; prints as `rad`, or as `0.05 rad` with a scale.

    Attributes:
        symbol: Unit of the quantity, such as `m`, or what values mean that have none.
        scale: Quantity that a value of 1 commands; None for values that are the
            quantity itself.
    """

    symbol: str
    scale: float | None = None

    def __str__(self) -> str:
        return self.symbol if self.scale is None else f"{self.scale:g} {self.symbol}"


FULL_TURN = 2.0 * math.pi
"""Bound of absolute rotation vectors and angles, rad: both vectors of a rotation that
are shorter than a full turn, r and `r - 2 pi r / |r|`, are within it."""

_VECTOR, _QUATERNION = (Axis.RX, Axis.RY, Axis.RZ), (Axis.QX, Axis.QY, Axis.QZ, Axis.QW)

LONGEST_VALUE = 1e100
"""Values beyond it are scaled down to it; such rotations have lost all digits."""

CELL = 40
"""Characters in a line of a printed layout's cell."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ActionPart:
    """What one controller reads from the action: named values with units and bounds.

    Labels are the names of the values: each an `Axis`, a joint, or another word.

    Attributes:
        wraps: Whether rotation vectors (`rx`, `ry`, `rz`), `yaw` and quaternions in it
            stand for a rotation as they are. Beyond the bounds they are replaced by
            values of the same rotation, not clipped.
    """

    name: str
    kind: SliceKind
    labels: tuple[str, ...]
    units: tuple[Unit, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    wraps: bool = False

    def __post_init__(self) -> None:
        sizes = {len(self.labels), len(self.units), len(self.low), len(self.high)}
        if len(sizes) != 1:
            raise ConfigError(f"Action part '{self.name}': lengths differ: {sizes}.")

    def prefixed(self, prefix: str) -> "ActionPart":
        """Return the same part with a prefix before its name."""
        return replace(self, name=prefix + self.name)


@dataclass(frozen=True, kw_only=True, slots=True)
class ActionSlice(ActionPart):
    """An `ActionPart` with its place in the vector, `action[start:stop]`."""

    start: int
    stop: int


class ActionLayout:
    """Slices, names, bounds and units of an action; parts are in its order.

    Raises ConfigError if two parts have the same name.

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
            values = {f.name: getattr(part, f.name) for f in fields(ActionPart)}
            slices.append(ActionSlice(**values, start=start, stop=stop))
            start = stop
        self.slices = tuple(slices)
        self.size = start
        self._by_name = {s.name: s for s in slices}
        if len(self._by_name) != len(slices):
            raise ConfigError(f"Action slices share a name: {[s.name for s in slices]}")
        self._rotations = [
            (np.array(index), labels is _QUATERNION)
            for s in slices
            for labels in (_VECTOR, (Axis.YAW,), _QUATERNION)
            if s.wraps
            if (index := [s.start + k for k, x in enumerate(s.labels) if x in labels])
        ]
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
        """Put values by slice into one action.

        Slices without a value are taken from the base, such as a `hold_action`.

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
            raise ActionError(
                f"An action must be a flat vector, not {action!r:.60}."
            ) from error
        if array.dtype.kind not in "fiu":
            raise ActionError(
                f"An action must hold real numbers, not {array.dtype} ({action!r:.60})."
            )
        if array.shape != (self.size,):
            raise ActionError(
                f"An action must have shape ({self.size},), not {array.shape}. "
                "print(env.unwrapped.action_layout) explains the values."
            )
        vector = array.astype(np.float64)
        if not np.isfinite(vector).all():
            bad = int(np.argmin(np.isfinite(vector)))
            raise ActionError(
                f"Action value {vector[bad]} at index {bad} "
                f"({self.describe(bad)}) is not finite."
            )
        return vector

    def clip(self, action: Vector) -> tuple[Vector, int]:
        """Return the action within the bounds, and how many values were outside.

        Rotations of slices that wrap are brought into the bounds as they are; they do
        not count as outside.
        """
        clipped = np.minimum(np.maximum(action, self.low), self.high)
        outside = clipped != action
        if not outside.any():
            return clipped, 0
        for index, is_quaternion in self._rotations:
            if outside[index].any():
                clipped[index] = _same_rotation(action[index], is_quaternion)
                outside[index] = False
        return clipped, int(np.count_nonzero(outside))

    def take(self, action: ArrayLike) -> tuple[Vector, int]:
        """Check and clip an action; see `check` and `clip`."""
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
            index, labels = f"{s.start}:{s.stop}", " ".join(s.labels)
            units = " ".join(map(str, dict.fromkeys(s.units)))
            low, high = (
                " ".join(f"{x:g}" for x in dict.fromkeys(bounds))
                for bounds in (s.low, s.high)
            )
            rows.append((s.name, s.kind, index, labels, units, low, high))
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


def _same_rotation(values: Vector, is_quaternion: bool) -> Vector:
    """Return the unit quaternion, or the rotation vector of at most half a turn."""
    most = float(np.abs(values).max())
    values = values / max(1.0, most / LONGEST_VALUE)  # so that squares are finite
    length = float(np.linalg.norm(values))
    if is_quaternion:
        return values / length
    return values * (math.remainder(length, FULL_TURN) / length)


def _frozen(values: list[float]) -> Vector:
    array = np.array(values, dtype=np.float64)
    array.flags.writeable = False
    return array
