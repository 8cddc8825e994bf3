"""Why a task is not at its target: records of a tick, and typed reasons."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from wbc_suite.qp.level import TickLayout
from wbc_suite.qp.limit import LimitKind
from wbc_suite.qp.task import RowTask
from wbc_suite.typing import Indices, Matrix, Vector

_SHARE = 0.1  # part of a task's pull that something must oppose to be named
_NOTHING = 1e-12  # pull that is rounding: no joint moves the task at all
_STRETCHED = 0.05  # pull over its greatest possible value; below, no joint can help


@dataclass(frozen=True, slots=True)
class ActiveLimit:
    """A limit that the tasks press against.

    Attributes:
        kind: What set it.
        subject: What is limited: the name of a joint, or what `RowLimit.subject`
            returns, such as a `LinkPair`.
        side: Which bound is met.
        is_joint: Whether it is a bound of a single joint.
        unit: Unit of the limited quantity: rad, m, N m.
        multiplier: How hard the tasks press, [cost]^2 times the unit.
    """

    kind: LimitKind
    subject: object
    side: Literal["lower", "upper"]
    is_joint: bool
    unit: str
    multiplier: float

    @property
    def name(self) -> str:
        """The subject as text."""
        return str(self.subject)

    def __str__(self) -> str:
        """Return "joint limit: elbow (upper)", or "self-collision: forearm - torso"."""
        if not self.is_joint:
            kind = "limit" if self.kind is LimitKind.OTHER else str(self.kind)
            return f"{kind}: {self.subject}"
        kind = "joint" if self.kind is LimitKind.POSITION else str(self.kind)
        return f"{kind} limit: {self.subject} ({self.side})"


@dataclass(frozen=True, slots=True)
class Conflict:
    """Another task, equality rows or upper levels that oppose a task."""

    other: str

    def __str__(self) -> str:
        return f"conflict: {self.other}"


@dataclass(frozen=True, slots=True)
class OutOfReach:
    """No joint moves the task nearer to its target: its limb is stretched."""

    def __str__(self) -> str:
        return "out of reach: no joint moves it nearer"


@dataclass(frozen=True, slots=True)
class TargetNotFinite:
    """The target is not finite, so that the task holds what it controls."""

    def __str__(self) -> str:
        return "target not finite: held"


Reason = ActiveLimit | Conflict | OutOfReach | TargetNotFinite


@dataclass(frozen=True, slots=True)
class TaskReport:
    """How one task stands after a tick.

    Attributes:
        position_error: Length of the error before saturation, in `unit`.
        orientation_error: Angle to the target, rad; 0 for tasks without one.
        reached: Whether both are within the tolerances asked for.
        reasons: What keeps the task from its target, weightiest first; empty when it
            is reached or simply on its way. `str` turns each into text.
    """

    name: str
    position_error: float
    orientation_error: float
    unit: str
    reached: bool
    reasons: tuple[Reason, ...]

    def __str__(self) -> str:
        """Return "hand: 0.120 m, 0.30 rad; joint limit: elbow (upper)"."""
        if self.reached:
            return f"{self.name}: reached"
        error = f"{self.position_error:.3g} {self.unit}"
        if self.orientation_error > 0.0:
            error += f", {self.orientation_error:.3g} rad"
        why = "; ".join(str(reason) for reason in self.reasons)
        return f"{self.name}: {error} from its target; {why or 'moving'}"


@dataclass(frozen=True, slots=True)
class LevelRecord:
    """What a tick left of one level; see `TaskArrays` for what has no comment."""

    tasks: list[tuple[RowTask, slice]]  # row tasks, each with its rows
    held: tuple[str, ...]  # names of the tasks whose target was not finite
    pressed: Indices  # (k,), rows with a multiplier other than zero
    rows: Matrix  # (k, nv), these rows
    distances: Matrix
    W: Matrix
    e: Vector
    diagonal: Matrix
    x: Vector  # (nv,), the step that was found
    multipliers: Vector  # of bounds, inequality rows and equality rows

    def reasons(
        self, task: int, opponents: Sequence[tuple[Reason, Vector]]
    ) -> tuple[Reason, ...]:
        """Return what opposes the pull of a row task, weightiest first.

        At the optimum the forces on the joints balance: the pulls
        `g_i = W_i^T (e_i - W_i dq)` of all tasks against the multipliers of limits and
        equality rows. The share of an opponent with force f in stopping task i is
        `f . g_i / (g_i . g_i)`. A task that is not met though it hardly pulls has its
        limb stretched: no joint moves it nearer.
        """
        rest, (own, rows) = self.e - self.W @ self.x, self.tasks[task]
        pull = self.W[rows].T @ rest[rows]
        greatest = float(np.linalg.norm(self.W[rows]) * np.linalg.norm(rest[rows]))
        square = float(pull @ pull)
        others: list[tuple[Reason, Vector]] = [
            (Conflict(other.name), -self.W[rows].T @ rest[rows])
            for other, rows in self.tasks
            if other is not own
        ]
        joints = self.diagonal[0] * self.x - self.diagonal[1]
        forces = [*opponents, *others, (Conflict("posture"), joints)]
        found = [(reason, float(force @ pull)) for reason, force in forces]
        named = [(reason, part) for reason, part in found if part > _SHARE * square]
        reasons = tuple(reason for reason, _ in sorted(named, key=lambda r: -r[1]))
        if np.sqrt(square) <= max(_STRETCHED * greatest, _NOTHING):
            return (OutOfReach(), *reasons)
        return reasons


class TickRecord(NamedTuple):
    """What explains a tick, also after the next ones.

    It is made in each tick, and only copies; names and arrays are resolved when it is
    read. `held` and `pressed` have an entry for each solved level, see `LevelRecord`;
    `pressed` is empty for stacks without rows.
    """

    layout: TickLayout
    buffer: Vector  # results of all levels, a copy
    kinds: Indices  # (2 nv,), `LimitKind` of each lower, then each upper bound
    held: tuple[tuple[str, ...], ...]
    pressed: tuple[tuple[Indices, Matrix], ...]
    subjects: Mapping[int, tuple[LimitKind, object, str]]  # by row, with its unit
    driven: Sequence[int]  # velocity indices that an escape drives

    @property
    def levels(self) -> list[LevelRecord]:
        """Each level that was solved."""
        none = np.zeros(0, dtype=np.int64), np.zeros((0, len(self.layout.joints)))
        records: list[LevelRecord] = []
        for k, held in enumerate(self.held):
            results = self.layout.results(self.buffer)[f"level {k}"]
            values = {name: results[name] for name in results.dtype.names or ()}
            pressed = self.pressed[k] if self.pressed else none
            records.append(LevelRecord(self.layout.levels[k], held, *pressed, **values))
        return records

    def active(self) -> tuple[ActiveLimit, ...]:
        """Return the active limits of all levels, hardest pressed first."""
        size = len(self.layout.joints) + self.layout.inequalities
        merged: Vector = np.zeros(size)
        for level in self.levels:
            own = level.multipliers[:size]
            merged = np.where(np.abs(own) > np.abs(merged), own, merged)
        order = np.argsort(-np.abs(merged), kind="stable")
        return tuple(self._limit(int(i), float(merged[i])) for i in order if merged[i])

    def explain(
        self, *, position_tolerance: float = 1e-3, orientation_tolerance: float = 5e-3
    ) -> dict[str, TaskReport]:
        """Report every row task by name; errors within m and rad count as reached."""
        found: dict[str, TaskReport] = {}
        for k, level in enumerate(self.levels):
            opponents = list(self._opponents(level, is_first=k == 0))
            for n, (task, _) in enumerate(level.tasks):
                distance, angle = (float(x) for x in level.distances[n])
                near = distance <= position_tolerance and angle <= orientation_tolerance
                reasons: tuple[Reason, ...] = ()
                if task.name in level.held:
                    reasons = (TargetNotFinite(),)
                elif not near:
                    reasons = level.reasons(n, opponents)
                found[task.name] = TaskReport(
                    task.name, distance, angle, task.unit, near, reasons
                )
        return found

    def _limit(self, i: int, multiplier: float) -> ActiveLimit:
        """Describe one limit by its place among the multipliers."""
        nv, is_upper = len(self.layout.joints), multiplier > 0.0
        side, is_joint = "upper" if is_upper else "lower", i < nv
        if is_joint:
            kind = LimitKind(int(self.kinds[nv * is_upper + i]))
            subject, unit = self.layout.joints[i], self.layout.units[i]
        else:
            kind, subject, unit = self.subjects[i - nv]
        return ActiveLimit(kind, subject, side, is_joint, unit, abs(multiplier))

    def _opponents(
        self, level: LevelRecord, *, is_first: bool
    ) -> Iterator[tuple[Reason, Vector]]:
        """Yield each active limit and equality with its force on the joints."""
        nv, p = len(self.layout.joints), self.layout.inequalities
        for i in level.multipliers[:nv].nonzero()[0].tolist():
            force = np.zeros(nv)
            force[i] = value = float(level.multipliers[i])
            yield self._limit(i, value), force
        forces = level.multipliers[nv + level.pressed][:, None] * level.rows
        for row, force in zip(level.pressed.tolist(), forces, strict=True):
            if row < p:
                value = float(level.multipliers[nv + row])
                yield self._limit(nv + row, value), force
        if not is_first:
            upper = forces[level.pressed >= p].sum(axis=0)
            yield Conflict("tasks of a higher level"), upper
            return
        start = p
        for name, size in self.layout.equalities:
            own = (level.pressed >= start) & (level.pressed < start + size)
            yield Conflict(name), forces[own].sum(axis=0)
            start += size
