"""A warm active-set solver for the stack's own kind of problem, compiled.

A level's cost has few rows and a positive diagonal, `0.5 |W x - e|^2 + 0.5 x^T D x -
r^T x`, and mostly the joints that met a bound at the last tick meet it again. For a
given set of joints at bounds the optimum follows from one small linear system of the
size of the rows, not of the robot:

    x_F = D_F^-1 (r_F - B_F^T y),   B = [W; A],   S = diag(1 for W, 0 for A)
    (S + B_F D_F^-1 B_F^T) y = B_F D_F^-1 r_F + B_K x_K - [e; b]

with F the free and K the kept joints. Joints that leave their bounds are kept, joints
whose multiplier has the wrong sign are freed, until nothing changes: then the KKT
conditions hold, and x is the one optimum if it keeps `A x = b`, which the caller
checks: rows that the kept joints leave nothing to are left out. All at once is quick
from a set that is nearly right, and else may go in circles; then it begins again with
none kept, and of the joints beyond their bounds keeps the farthest alone. Where that
takes too long nothing is answered, and a general solver takes over.

Source: Hintermueller, Ito, Kunisch (2002), "The Primal-Dual Active Set Strategy as a
Semismooth Newton Method", SIAM J. Optim. 13(3); the small system is the matrix
inversion lemma.
"""

import numpy as np

from wbc_suite.compiling import compiled
from wbc_suite.qp.sums import dot
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["solve_warm"]

_QUICK = 8  # rounds in which all joints beyond their bounds are kept at once
_CAREFUL = 16  # rounds after those, in which one more is kept
_DEPENDENT = 1e-12  # part of a row's square that is left by the rows above
_TOLERANCE = 1e-13  # m, rad: how far a free joint may pass its bound by rounding


@compiled
def solve_warm(  # noqa: C901, one flat loop is what compiles well
    W: Matrix,
    e: Vector,
    A: Matrix,
    b: Vector,
    diagonal: Matrix,
    mu: float,
    lb: Vector,
    ub: Vector,
    side: Indices,
    x: Vector,
    multipliers: Vector,
    row_multipliers: Vector,
) -> bool:
    """Minimise `0.5 |W x - e|^2 + 0.5 x^T D x - r^T x` with `A x = b`, `lb <= x <= ub`.

    Args:
        W: Weighted rows, shape (m, n).
        e: Weighted steps, shape (m,).
        A: Equality rows, shape (k, n), independent.
        b: Their right-hand side, shape (k,).
        diagonal: D without mu, and r, shape (2, n).
        mu: Added to D; positive.
        lb: Lower bounds, shape (n,).
        ub: Upper bounds, shape (n,).
        side: In and out, -1 or 1 where x is kept at its lower or upper bound, else 0.
        x: Output, the optimum, shape (n,).
        multipliers: Output, of the bounds, shape (n,); positive at upper ones.
        row_multipliers: Output, of A, shape (k,).

    Returns:
        Whether x is the optimum, provided that it keeps A x = b.
    """
    m, k, n = W.shape[0], A.shape[0], x.shape[0]
    scaled, system = np.empty((m + k, n)), np.empty((m + k, m + k))
    y, root = np.empty(m + k), np.empty(n)
    loose, kept = np.empty(n), np.empty(n)
    ends = np.empty(m + k, dtype=np.int64)
    for row in range(m + k):
        ends[row] = _end(W[row] if row < m else A[row - m])
    for i in range(n):
        root[i] = 1.0 / np.sqrt(diagonal[0, i] + mu)
    for count in range(_QUICK + _CAREFUL):
        if count == _QUICK:
            for i in range(n):
                side[i] = 0
        for i in range(n):
            loose[i], kept[i] = root[i], 0.0
            if side[i] != 0:
                loose[i], kept[i] = 0.0, ub[i] if side[i] > 0 else lb[i]
            x[i] = loose[i] * diagonal[1, i]  # scaled right-hand side, for now
        for row in range(m + k):
            of, own, end = W[row] if row < m else A[row - m], scaled[row], ends[row]
            for i in range(end):
                own[i] = of[i] * loose[i]
            y[row] = dot(of, kept, end) - (e[row] if row < m else b[row - m])
            y[row] += dot(own, x, end)
            for other in range(row + 1):
                last = min(end, ends[other])
                system[row, other] = dot(own, scaled[other], last)
            if row < m:
                system[row, row] += 1.0
        _solve_in_place(system, y)
        for i in range(n):
            x[i] = root[i] * diagonal[1, i]
        for row in range(m + k):
            for i in range(ends[row]):
                x[i] -= scaled[row, i] * y[row]
        same = _free(W, A, y, diagonal, mu, root, lb, ub, side, x, multipliers)
        if _keep(lb, ub, side, x, count >= _QUICK) and same:
            for row in range(k):
                row_multipliers[row] = y[m + row]
            return True
    for i in range(n):
        side[i] = 0
    return False


@compiled
def _end(row: Vector) -> int:
    """Return where a row's last entry other than zero is, and one more.

    Joints count from the root outwards, so that many rows end early.
    """
    end = row.shape[0]
    while end > 0 and row[end - 1] == 0.0:
        end -= 1
    return end


@compiled
def _solve_in_place(S: Matrix, y: Vector) -> None:
    """Solve `S y = y` by Cholesky, lower triangle.

    The factor's diagonal is kept as its inverse. Rows that follow from those above are
    left out, with y = 0: on the way to the right set, joints that are kept for now may
    leave fewer free ones than there are equality rows.
    """
    n = y.shape[0]
    for i in range(n):
        own = S[i]
        for j in range(i):
            own[j] = (own[j] - dot(own, S[j], j)) * S[j, j]
        pivot = own[i] - dot(own, own, i)
        own[i] = 1.0 / np.sqrt(pivot) if pivot > _DEPENDENT * own[i] else 0.0
        y[i] = (y[i] - dot(own, y, i)) * own[i]
    for i in range(n - 1, -1, -1):
        y[i] *= S[i, i]
        for j in range(i):
            y[j] -= S[i, j] * y[i]


@compiled
def _free(
    W: Matrix,
    A: Matrix,
    y: Vector,
    diagonal: Matrix,
    mu: float,
    root: Vector,
    lb: Vector,
    ub: Vector,
    side: Indices,
    x: Vector,
    multipliers: Vector,
) -> bool:
    """Finish x; free joints that are pulled off their bounds; True if there are none.

    Comes in with `x = root^2 r` less the rows' part on free joints scaled by one root.
    """
    m, same = W.shape[0], True
    for i in range(x.shape[0]):
        multipliers[i] = 0.0
        if side[i] == 0:
            x[i] *= root[i]
            continue
        x[i] = ub[i] if side[i] > 0 else lb[i]
        force = diagonal[1, i] - (diagonal[0, i] + mu) * x[i]
        for row in range(y.shape[0]):
            force -= (W[row, i] if row < m else A[row - m, i]) * y[row]
        multipliers[i] = force
        if force * side[i] < 0.0 and lb[i] < ub[i]:
            side[i], same = 0, False
    return same


@compiled
def _keep(lb: Vector, ub: Vector, side: Indices, x: Vector, only_one: bool) -> bool:
    """Keep joints beyond their bounds, or the farthest; True if there are none."""
    found, worst = -1, _TOLERANCE
    for i in range(x.shape[0]):
        over, under = x[i] - ub[i], lb[i] - x[i]
        beyond = over if over > under else under
        if beyond <= worst:  # False for what is not a number
            x[i] = min(max(x[i], lb[i]), ub[i])
            continue
        found = i
        if only_one:
            worst = beyond
        else:
            side[i] = 1 if over > under else -1
    if only_one and found >= 0:
        side[found] = 1 if x[found] > ub[found] else -1
    return found < 0
