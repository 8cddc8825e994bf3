"""How much the rows bend that a stack presses against, and the damping that needs."""

import math

import numpy as np

from wbc_suite.compiling import compiled
from wbc_suite.typing import Matrix, Vector

__all__ = ["RowBending"]

_MEMORY = 0.2  # s, in which the damping of rows that no longer press falls to 1 / e
_MOST = 1e6  # times what tasks pull with; what presses more feeds on the damping


class RowBending:
    """Damping of the first level by the rows that pressed on it at the last tick.

    Rows bend as tasks do: the curvature of `nu . A(q)` is bounded by the multipliers
    nu times the longest arms, see `rows.damping_of_rows`.

    The value rises at once and falls slowly: multipliers follow from the damping, and
    would swing with it. Where rows nearly depend on each other, rounding alone presses
    in proportion to the damping: both would grow for ever, so that a multiple of what
    the tasks pull with is the most.

    Args:
        factor: What the bound is multiplied by; 0 is without.
    """

    def __init__(self, factor: float) -> None:
        self.factor = factor
        self.forget()

    def forget(self) -> None:
        """Forget the last tick."""
        self.value = 0.0

    def note(
        self,
        rows: Matrix,
        multipliers: Vector,
        pulls: tuple[Matrix, Vector, Vector],
        dt: float,
        *,
        kept: bool,
    ) -> None:
        """Take in what pressed at this tick.

        Args:
            rows: Shape (m, nv).
            multipliers: Shape (m,).
            pulls: W, e and r of the level, whose tasks pull with `W^T e + r`.
            dt: Step, s.
            kept: Whether the rows were; those that are relaxed count as not pressing.
        """
        self.value *= math.exp(-dt / _MEMORY)
        if kept and np.count_nonzero(multipliers):
            bending = _bending(rows, multipliers, *pulls)
            self.value = max(self.factor * bending, self.value)


@compiled
def _bending(
    rows: Matrix, multipliers: Vector, W: Matrix, e: Vector, r: Vector
) -> float:
    """Return `sum |nu| max|A|`, or the most that counts.

    Args:
        rows: A, shape (m, nv).
        multipliers: nu, shape (m,).
        W: Weighted rows of tasks, shape (k, nv).
        e: Weighted steps, shape (k,).
        r: Weighted steps of joints, shape (nv,).
    """
    most = 0.0
    for i in range(r.shape[0]):
        pull = r[i]
        for row in range(e.shape[0]):
            pull += W[row, i] * e[row]
        most += _MOST * abs(pull)
    total = 0.0
    for row in range(rows.shape[0]):
        if multipliers[row] != 0.0:
            longest = 0.0
            for i in range(rows.shape[1]):
                longest = max(longest, abs(rows[row, i]))
            total += abs(multipliers[row]) * longest
    return min(total, most)
