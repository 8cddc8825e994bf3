"""How much the rows bend that a level presses against, and the damping that needs."""

import numpy as np

from wbc_suite.typing import Matrix, Vector

__all__ = ["RowBending", "multipliers_of_rows"]

_MEMORY = 0.2  # s, in which the damping of rows that no longer press falls to 1 / e
_RIDGE = 1e-6  # of the rows' squares; rows that depend on each other share a force


class RowBending:
    """Damping of each level by the rows that pressed on it at the last tick.

    Rows bend as tasks do: the curvature of `nu . A(q)` is bounded by the multipliers
    nu times the longest arms, see `rows.damping_of_rows`. For a lower level the rows of
    all levels above count as well. Without it a level that pulls hard against those
    above swings between its acceleration limits, tick by tick.

    The value rises at once and falls slowly: multipliers follow from the damping, and
    would swing with it.

    Args:
        levels: Number of levels.
        factor: What the bound is multiplied by; 0 is without.
    """

    def __init__(self, levels: int, factor: float) -> None:
        self.factor = factor
        self.values: Vector = np.zeros(levels)

    def forget(self) -> None:
        """Forget the last tick."""
        self.values[:] = 0.0

    def note(self, level: int, rows: Matrix, multipliers: Vector, dt: float) -> None:
        """Take in what pressed on a level at this tick.

        Args:
            level: Its number.
            rows: Shape (m, nv).
            multipliers: Shape (m,).
            dt: Step, s.
        """
        self.values[level] *= np.exp(-dt / _MEMORY)
        if not len(rows):
            return
        longest = np.maximum(rows.max(axis=1), -rows.min(axis=1))
        pressed = self.factor * float(np.abs(multipliers) @ longest)
        self.values[level] = max(pressed, self.values[level])


def multipliers_of_rows(rows: Matrix, force: Vector) -> Vector:
    """Return the multipliers nu of rows, shape (m,), whose force `rows^T nu` is given.

    The least squares solution: `(rows rows^T) nu = rows force`, with a small ridge.

    Args:
        rows: Shape (m, nv), of any rank.
        force: On the joints, shape (nv,).
    """
    square = rows @ rows.T
    square[np.diag_indices_from(square)] += _RIDGE * max(float(square.trace()), 1e-9)
    return np.linalg.solve(square, rows @ force)
