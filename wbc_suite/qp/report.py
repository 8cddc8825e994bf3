"""Why a task is not where it should be."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from wbc_suite.typing import Matrix, Vector

__all__ = ["LevelRecord", "TaskReport", "TickRecord", "reasons"]

_SHARE = 0.1  # part of a task's pull that something must oppose to be named
_NOTHING = 1e-12  # pull that is rounding: no joint moves the task at all
_STRETCHED = 0.05  # pull over its greatest possible value; below, no joint can help


@dataclass(frozen=True, slots=True)
class TaskReport:
    """How one task stands after a tick.

    Attributes:
        name: The task's name.
        position_error: Distance to the target before saturation, m.
        orientation_error: Angle to the target, rad; 0 for tasks without one.
        reached: Whether both are within the tolerances asked for.
        reasons: What keeps the task from its target, weightiest first, in words;
            empty when it is reached or simply on its way.
    """

    name: str
    position_error: float
    orientation_error: float
    reached: bool
    reasons: tuple[str, ...]


Opponents = Iterable[tuple[str, Vector]]
"""Words and force on the joints, shape (nv,), of each active limit and equality."""


@dataclass(frozen=True, slots=True)
class LevelRecord:
    """What a level knew at one tick, in arrays of its own.

    Attributes:
        names: Its row tasks.
        slices: Where each one's rows are.
        errors: Position (m) and orientation error (rad) of each.
        held: Names of the tasks whose target was not finite.
        W: Weighted rows, shape (m, nv).
        e: Weighted steps, shape (m,).
        diagonal: Squared weights and weighted steps of joints, shape (2, nv).
    """

    names: tuple[str, ...]
    slices: Sequence[slice]
    errors: Sequence[tuple[float, float]]
    held: tuple[str, ...]
    W: Matrix
    e: Vector
    diagonal: Matrix

    def reports(
        self,
        x: Vector,
        opponents: Sequence[tuple[str, Vector]],
        position_tolerance: float,
        orientation_tolerance: float,
    ) -> dict[str, TaskReport]:
        """Report every row task by name; see `reasons` for the arguments."""
        found: dict[str, TaskReport] = {}
        for n, (name, (position, angle)) in enumerate(
            zip(self.names, self.errors, strict=True)
        ):
            near = position <= position_tolerance and angle <= orientation_tolerance
            why: tuple[str, ...] = ()
            if name in self.held:
                why = ("target not finite: held",)
            elif not near:
                why = reasons(self, n, x, opponents)
            found[name] = TaskReport(
                name=name,
                position_error=position,
                orientation_error=angle,
                reached=near,
                reasons=why,
            )
        return found


@dataclass(frozen=True, slots=True)
class TickRecord:
    """What a stack knew at one tick: it explains it at any later time.

    Attributes:
        levels: Each level that was solved, with its step and what tells its opponents.
    """

    levels: Sequence[tuple[Callable[[], LevelRecord], Vector, Callable[[], Opponents]]]

    def explain(
        self, *, position_tolerance: float, orientation_tolerance: float
    ) -> dict[str, TaskReport]:
        """See `TaskStack.explain`."""
        found: dict[str, TaskReport] = {}
        for level, x, opponents in self.levels:
            found |= level().reports(
                x, list(opponents()), position_tolerance, orientation_tolerance
            )
        return found


def reasons(
    level: LevelRecord, task: int, x: Vector, opponents: Opponents
) -> tuple[str, ...]:
    """Return what opposes the pull of a task, weightiest first.

    At the optimum the forces on the joints balance: the pulls
    `g_i = W_i^T (e_i - W_i dq)` of all tasks against the multipliers of limits and
    equality rows. The share of an opponent with force f in stopping task i is
    `f . g_i / (g_i . g_i)`. A task that is not met though it hardly pulls has its limb
    stretched: no joint moves it nearer.

    Args:
        level: The level of the task.
        task: Its number among the level's row tasks.
        x: The step that was found, shape (nv,).
        opponents: Words and force, shape (nv,), of each active limit and equality.
    """
    pulls = [
        level.W[rows].T @ (level.e[rows] - level.W[rows] @ x) for rows in level.slices
    ]
    pull, rows = pulls[task], level.slices[task]
    rest = level.e[rows] - level.W[rows] @ x
    greatest = float(np.linalg.norm(level.W[rows]) * np.linalg.norm(rest))
    square = float(pull @ pull)
    found = [(words, float(force @ pull)) for words, force in opponents]
    found += [
        (f"conflict: {other}", float(-other_pull @ pull))
        for k, (other, other_pull) in enumerate(zip(level.names, pulls, strict=True))
        if k != task
    ]
    joints = level.diagonal[1] - level.diagonal[0] * x
    found.append(("conflict: posture", float(-joints @ pull)))
    named = [(words, part) for words, part in found if part > _SHARE * square]
    words = tuple(words for words, _ in sorted(named, key=lambda w: -w[1]))
    if np.sqrt(square) <= max(_STRETCHED * greatest, _NOTHING):
        return ("out of reach: no joint moves it nearer", *words)
    return words
