"""How much the rows bend that a stack presses against, and the damping that needs."""

import math

from wbc_suite.compiling import compiled
from wbc_suite.typing import Matrix, Vector

__all__ = ["RowBending"]

_MEMORY = 0.2  # s, in which the damping of rows that no longer press falls to 1 / e


class RowBending:
    """Damping of the first level by the rows that pressed on it at the last tick.

    Rows bend as tasks do: the curvature of `nu . A(q)` is bounded by the multipliers
    nu times the longest arms, see `rows.damping_of_rows`.

    The value rises at once and falls slowly: multipliers follow from the damping, and
    would swing with it.

    Args:
        factor: What the bound is multiplied by; 0 is without.
    """

    def __init__(self, factor: float) -> None:
        self.factor = factor
        self.forget()

    def forget(self) -> None:
        """Forget the last tick."""
        self.value = 0.0

    def note(self, rows: Matrix, multipliers: Vector, dt: float, *, kept: bool) -> None:
        """Take in what pressed at this tick.

        Args:
            rows: Shape (m, nv).
            multipliers: Shape (m,).
            dt: Step, s.
            kept: Whether the rows were; those that are relaxed count as not pressing.
        """
        self.value *= math.exp(-dt / _MEMORY)
        if kept:
            self.value = max(self.factor * _bending(rows, multipliers), self.value)


@compiled
def _bending(rows: Matrix, multipliers: Vector) -> float:
    """Return `sum |nu| max|A|`, over rows (m, nv) and multipliers nu (m,)."""
    total = 0.0
    for row in range(rows.shape[0]):
        if multipliers[row] != 0.0:
            longest = 0.0
            for i in range(rows.shape[1]):
                longest = max(longest, abs(rows[row, i]))
            total += abs(multipliers[row]) * longest
    return total
