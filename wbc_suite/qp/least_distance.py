"""A quadratic program as the least distance that a few of its bounds ask for.

With the Cholesky factor `H = L L^T` and the free optimum `x0 = -H^-1 c`, the rows a_j
that bind push it with forces lam to

    x = x0 - L^-T Y lam,   Y = [L^-1 a_j, ...].

Which do, and how hard, is a problem of no more variables than rows. With M lower
triangular and `M M^T = Y^T Y`, and u in place of `-M^T lam`:

    minimise 0.5 |u|^2  subject to  lower - a x0 <= M u <= upper - a x0.

A solver gets that one. Few of a robot's many bounds bind, so those are looked at that
did last time; what the answer breaks joins them, and the small problem is solved again.
An answer that breaks nothing fulfils the KKT conditions of the whole problem.

Source: Lawson, Hanson (1974), "Solving Least Squares Problems", chapter 23, for least
distances; Kelley (1960), "The Cutting-Plane Method for Solving Convex Programs", for
rows that join.
"""

from enum import IntEnum

import numpy as np

from wbc_suite.compiling import compiled, compiled_inner
from wbc_suite.kinematics.array_table import ArrayTable, indices, matrix, vector
from wbc_suite.qp.sums import dot
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["LeastDistance"]

_BROKEN = 1e-12  # m, rad: a row or bound that is broken by more joins
_SINGULAR = 1e-14  # part of a diagonal entry of H that the factor must leave
_DEPENDENT = 1e-13  # part of a row's square that is left by the rows before it


class _Field(IntEnum):
    """Arrays of a `LeastDistance`.

    L with its diagonal inverted; x0; the rows that joined, and whether a row did; Y, a
    row each; M; their bounds, less what x0 has, and how they bind; -1 or 1 where a row
    bound last time, at its lower or upper bound; x; the multipliers of all rows.
    """

    FACTOR = 0
    FREE = 1
    JOINED = 2
    IS_IN = 3
    Y = 4
    M = 5
    LOW = 6
    HIGH = 7
    SENSE = 8
    SIDE = 9
    X = 10
    MULTIPLIERS = 11


class LeastDistance:
    """Buffers for problems of one size; remembers which rows bound.

    Rows count with the bounds of the variables before them.

    Args:
        nv: Number of variables.
        rows: Number of rows beside their bounds.
        equalities: How many of them, the last ones, are equalities; they always join.

    Attributes:
        M: Rows of the small problem; the upper left block counts.
        low: Their lower bounds.
        high: Their upper bounds.
        sense: How they bind, for daqp: 5 is an equality, 1 and 3 did so last time.
        x: The answer, shape (nv,).
        multipliers: Of bounds and rows, positive at upper ones, shape (nv + rows,).
    """

    def __init__(self, nv: int, rows: int, equalities: int) -> None:
        count, f = nv + rows, _Field
        self._equalities = equalities
        self.M: Matrix = np.zeros((count, count))
        self.low: Vector = np.zeros(count)
        self.high: Vector = np.zeros(count)
        self.sense: Indices = np.zeros(count, dtype=np.int64)
        self.x: Vector = np.zeros(nv)
        self.multipliers: Vector = np.zeros(count)
        self._side: Indices = np.zeros(count, dtype=np.int64)
        self._arrays = ArrayTable(
            _Field,
            {
                f.FACTOR: np.zeros((nv, nv)),
                f.FREE: np.zeros(nv),
                f.JOINED: np.zeros(count, dtype=np.int64),
                f.IS_IN: np.zeros(count, dtype=np.int64),
                f.Y: np.zeros((count, nv)),
                f.M: self.M,
                f.LOW: self.low,
                f.HIGH: self.high,
                f.SENSE: self.sense,
                f.SIDE: self._side,
                f.X: self.x,
                f.MULTIPLIERS: self.multipliers,
            },
        )

    def begin(
        self, H: Matrix, c: Vector, rows: Matrix, lower: Vector, upper: Vector
    ) -> int:
        """Factorise a problem; return how many rows join, -1 if H is not definite."""
        table = self._arrays.table
        return _begin(H, c, rows, lower, upper, self._equalities, table)

    def complete(
        self, forces: Vector, rows: Matrix, lower: Vector, upper: Vector
    ) -> int:
        """Write x and multipliers; return how many rows join with those it breaks.

        Args:
            forces: Multipliers of the small problem.
            rows: As in `begin`.
            lower: As in `begin`.
            upper: As in `begin`.
        """
        return _complete(forces, rows, lower, upper, self._arrays.table)

    def forget(self) -> None:
        """Forget which rows bound."""
        self._side[:] = 0


@compiled
def _begin(
    H: Matrix,
    c: Vector,
    rows: Matrix,
    lower: Vector,
    upper: Vector,
    equalities: int,
    table: Indices,
) -> int:
    """Factorise, and let equalities join and what bound last time."""
    L, free = matrix(table, _Field.FACTOR), vector(table, _Field.FREE)
    n = free.shape[0]
    for i in range(n):
        own = L[i]
        for j in range(i):
            own[j] = (H[i, j] - dot(own, L[j], j)) * L[j, j]
        pivot = H[i, i] - dot(own, own, i)
        if not pivot > _SINGULAR * H[i, i]:
            return -1
        own[i] = 1.0 / np.sqrt(pivot)
        free[i] = (-c[i] - dot(own, free, i)) * own[i]
    _solve_transposed(L, free)
    side, is_in = indices(table, _Field.SIDE), indices(table, _Field.IS_IN)
    last, count = lower.shape[0], 0
    for i in range(last):
        is_in[i] = 0
    for i in range(last):
        if side[i] != 0 or i >= last - equalities:
            sense = 2 - side[i] if i < last - equalities else 5
            count = _join(i, sense, count, rows, lower, upper, table)
    return count


@compiled
def _complete(
    forces: Vector, rows: Matrix, lower: Vector, upper: Vector, table: Indices
) -> int:
    """Write x, multipliers and sides; let join what x breaks."""
    x, free = vector(table, _Field.X), vector(table, _Field.FREE)
    multipliers, Y = vector(table, _Field.MULTIPLIERS), matrix(table, _Field.Y)
    joined, is_in = indices(table, _Field.JOINED), indices(table, _Field.IS_IN)
    side, n, count = indices(table, _Field.SIDE), x.shape[0], forces.shape[0]
    for i in range(lower.shape[0]):
        multipliers[i], side[i] = 0.0, 0
    for i in range(n):
        x[i] = 0.0
    for k in range(count):
        force, y = forces[k], Y[k]
        multipliers[joined[k]] = force
        side[joined[k]] = 1 if force > 0.0 else -1 if force < 0.0 else 0
        for i in range(n):
            x[i] -= force * y[i]
    _solve_transposed(matrix(table, _Field.FACTOR), x)
    for i in range(n):
        x[i] += free[i]
    for i in range(lower.shape[0]):
        if not is_in[i]:
            value = x[i] if i < n else dot(rows[i - n], x, n)
            if value > upper[i] + _BROKEN or value < lower[i] - _BROKEN:
                count = _join(i, 0, count, rows, lower, upper, table)
    return count


@compiled_inner
def _join(
    i: int,
    sense: int,
    count: int,
    rows: Matrix,
    lower: Vector,
    upper: Vector,
    table: Indices,
) -> int:
    """Write a row's part of the small problem; return the new number of rows.

    A row of zeros does not join.
    """
    L, free = matrix(table, _Field.FACTOR), vector(table, _Field.FREE)
    Y, M = matrix(table, _Field.Y), matrix(table, _Field.M)
    n, y, own = free.shape[0], Y[count], M[count]
    at = free[i] if i < n else dot(rows[i - n], free, n)
    for j in range(n):
        value = rows[i - n, j] if i >= n else 1.0 if i == j else 0.0
        y[j] = (value - dot(L[j], y, j)) * L[j, j]
    square = dot(y, y, n)
    indices(table, _Field.IS_IN)[i] = 1
    if square == 0.0:
        return count
    for k in range(count):
        rest = dot(y, Y[k], n) - dot(own, M[k], k)
        own[k] = rest / M[k, k] if M[k, k] > 0.0 else 0.0
    pivot = square - dot(own, own, count)
    own[count] = np.sqrt(pivot) if pivot > _DEPENDENT * square else 0.0
    vector(table, _Field.LOW)[count] = lower[i] - at
    vector(table, _Field.HIGH)[count] = upper[i] - at
    indices(table, _Field.SENSE)[count] = sense
    indices(table, _Field.JOINED)[count] = i
    return count + 1


@compiled_inner
def _solve_transposed(L: Matrix, x: Vector) -> None:
    """Solve `L^T x = x`; the diagonal of L is inverted."""
    for i in range(x.shape[0] - 1, -1, -1):
        x[i] *= L[i, i]
        value, row = x[i], L[i]
        for j in range(i):
            x[j] -= row[j] * value
