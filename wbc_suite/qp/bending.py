"""How much the rows bend that a level presses against, and the damping that needs."""

import numpy as np

from wbc_suite.typing import Matrix, Vector

__all__ = ["RowBending", "multipliers_of_rows"]

_MEMORY = 0.2  # s, in which the damping of rows that no longer press falls to 1 / e
_CALM = 5.0  # s, in which what was seen of swinging is forgotten to 1 / e
_RISE = 3.0  # 1/s, of the bound, while ticks take back what the ticks before did
_SWING = 0.01  # rad/s; smaller changes of velocity are nothing to damp
_RIDGE = 1e-6  # of the rows' squares; rows that depend on each other share a force


class RowBending:
    """Damping of each level by the rows that pressed on it at the last tick.

    Rows bend as tasks do: the curvature of `nu . A(q)` is bounded by the multipliers
    nu times the longest arms, see `rows.damping_of_rows`. For a lower level the rows of
    all levels above count as well: without it a level that pulls hard against those
    above swings between its acceleration limits, tick by tick. There the bound is a
    loose one, and would slow a leaning humanoid; so it counts as far as the robot was
    seen to swing, which `watch` tells from changes of velocity that are taken back.

    The value rises at once and falls slowly: multipliers follow from the damping, and
    would swing with it.

    Args:
        levels: Number of levels.
        factor: What the bound is multiplied by; 0 is without.
    """

    def __init__(self, levels: int, factor: float) -> None:
        self.factor = factor
        self.values: Vector = np.zeros(levels)
        self.forget()

    def forget(self) -> None:
        """Forget the last tick."""
        self.values[:] = 0.0
        self._swinging = 0.0
        self._change: Vector = np.zeros(0)

    def watch(self, change: Vector, dt: float) -> None:
        """Take in by how much the velocity has changed at this tick, shape (nv,)."""
        before, self._change = self._change, change
        if len(before) and _taken_back(before, change) > _SWING:
            self._swinging = min(1.0, self._swinging + _RISE * dt)
        else:
            self._swinging *= np.exp(-dt / _CALM)

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
        if level:
            pressed *= self._swinging
        self.values[level] = max(pressed, self.values[level])


def _taken_back(before: Vector, change: Vector) -> float:
    """Return the greatest change of a joint that goes against the one before."""
    least = np.minimum(np.abs(before), np.abs(change))
    return float(least[before * change < 0.0].max(initial=0.0))


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
