"""A compiled active-set solver for the QP of one level, warm-started.

A level's cost has few rows and a positive diagonal, `0.5 |W x - e|^2 + 0.5 x^T D x -
r^T x`, and mostly the bounds and rows that were active at the last tick are active
again. For a given active set the optimum follows from one small linear system of the
size of the rows, not of the robot:

    x_F = D_F^-1 (r_F - B_F^T y),   B = [W; rows],   S = diag(1 for W, s for rows)
    (S + B_F D_F^-1 B_F^T) y = B_F D_F^-1 r_F + B_K x_K - [e; b]

with F the free joints and K those at a bound, rows the equality rows and the active
inequality rows. A soft row, of the cost `0.5 w max(0, g x - wanted)^2`, is an active
row with `s = 1 / w`; of hard ones s is 0. What violates its bound becomes active, what
has a multiplier of the wrong sign inactive, until nothing changes: then the KKT
conditions hold, and x is the one optimum if it keeps all rows, which the caller checks,
since rows that depend on others are left out. All changes at once are quick from a set
that is nearly right, and may cycle; then the solver begins again with an empty set and
adds only the worst violation. Where that takes too long, daqp takes over.

Source: Hintermueller, Ito, Kunisch (2002), "The Primal-Dual Active Set Strategy as a
Semismooth Newton Method", SIAM J. Optim. 13(3); the small system is the matrix
inversion lemma.
"""

from typing import NamedTuple

import numpy as np

from wbc_suite.compiling import compiled, inner, struct
from wbc_suite.linear_algebra import cholesky, dot, solve_lower, solve_upper
from wbc_suite.qp.problem import UNBOUNDED
from wbc_suite.typing import Indices, Matrix, Vector

_QUICK = 8  # rounds in which all violated bounds and rows become active at once
_CAREFUL = 32  # rounds after those, in which the worst one does
_DEPENDENT = 1e-12  # part of a row's square that the rows above must leave
_TOLERANCE = 1e-13  # m, rad: violation of a bound by rounding
_ROW_TOLERANCE = 1e-11  # m: violation of a row by rounding

_SOFT, _HARD = 1, 2  # states of active rows: at `wanted` with slack, or at the bound


@struct
class QpArrays(NamedTuple):
    """The QP of one level: m cost rows, p inequality rows, up to k equality rows.

    Bounds stand in the order x, inequality rows, equality rows. `side` is the active
    set, in and out: -1 or 1 where x is at its lower or upper bound; 1 for soft, 2 for
    hard inequality rows; else 0. What follows `multipliers` is scratch.
    """

    W: Matrix  # (m, n), weighted cost rows
    e: Vector  # (m,), weighted steps
    diagonal: Matrix  # (2, n), D without mu, and r
    mu: Vector  # (1,), added to D, positive
    rows: Matrix  # (p + k, n), inequality rows, then equality rows
    lower: Vector  # (n + p + k,)
    upper: Vector  # (n + p + k,)
    wanted: Vector  # (p,), bounds that rows keep softly, where they are below `upper`
    weight: Vector  # (1,), cost w of soft rows
    counts: Indices  # (2,), p, and how many equality rows there are
    side: Indices  # (n + p,)
    x: Vector  # (n,), output: the optimum
    multipliers: Vector  # (n + p + k,), output: positive at upper bounds
    active: Indices  # (m + p + k,), rows of the small system
    last: Indices  # (m + p + k,), end of the entries of each row that are not zero
    scaled: Matrix  # (m + p + k, n), rows times D^-1/2
    system: Matrix  # the small system
    y: Vector  # its solution
    root: Vector  # (n,), D^-1/2
    kept: Vector  # (n,), x at bounds, else 0


def make_qp_arrays(
    W: Matrix,
    e: Vector,
    diagonal: Matrix,
    mu: Vector,
    *,
    inequalities: int = 0,
    equalities: int = 0,
    x: Vector | None = None,
    multipliers: Vector | None = None,
) -> QpArrays:
    """Return the arrays of a QP without bounds, over the cost that is given.

    It has room for so many rows. Optimum and multipliers may have buffers already.
    """
    m, n = W.shape
    rows, size = inequalities + equalities, m + inequalities + equalities
    return QpArrays(
        W=W,
        e=e,
        diagonal=diagonal,
        mu=mu,
        rows=np.zeros((rows, n)),
        lower=np.full(n + rows, -UNBOUNDED),
        upper=np.full(n + rows, UNBOUNDED),
        wanted=np.full(inequalities, UNBOUNDED),
        weight=np.zeros(1),
        counts=np.array([inequalities, equalities], dtype=np.int64),
        side=np.zeros(n + inequalities, dtype=np.int64),
        x=np.zeros(n) if x is None else x,
        multipliers=np.zeros(n + rows) if multipliers is None else multipliers,
        active=np.zeros(size, dtype=np.int64),
        last=np.zeros(size, dtype=np.int64),
        scaled=np.zeros((size, n)),
        system=np.zeros((size, size)),
        y=np.zeros(size),
        root=np.zeros(n),
        kept=np.zeros(n),
    )


@compiled
def solve_warm(qp: QpArrays) -> bool:
    """Minimise `0.5 |W x - e|^2 + 0.5 x^T (D + mu) x - r^T x` within bounds and rows.

    Return whether x is the optimum, provided that it keeps the rows.
    """
    n, m = qp.x.shape[0], qp.e.shape[0]
    counts, side, upper, wanted, last = qp.counts, qp.side, qp.upper, qp.wanted, qp.last
    root, diagonal, mu, W, rows = qp.root, qp.diagonal, qp.mu[0], qp.W, qp.rows
    p, k, system, y = counts[0], counts[1], qp.system, qp.y
    for i in range(n):
        root[i] = 1.0 / np.sqrt(diagonal[0, i] + mu)
    for row in range(m + p + k):
        last[row] = _end(W[row] if row < m else rows[row - m])
    for row in range(p):
        if upper[n + row] >= UNBOUNDED and wanted[row] >= UNBOUNDED:
            side[n + row] = 0
    for count in range(_QUICK + _CAREFUL):
        if count == _QUICK:
            side[:] = 0
        size = _state_system(qp)
        cholesky(system, size, _DEPENDENT)
        solve_lower(system, y, size)
        solve_upper(system, y, size)
        changed = _recover(qp, size)
        if not _activate(qp, count >= _QUICK) and not changed:
            return True
    side[:] = 0
    return False


@inner
def _end(row: Vector) -> int:
    """Return the end of a row's entries: many end early, as joints count outwards."""
    end = row.shape[0]
    while end > 0 and row[end - 1] == 0.0:
        end -= 1
    return end


@inner
def _state_system(qp: QpArrays) -> int:
    """Write the small system and its right-hand side; return its size.

    Leaves the columns of free joints in `scaled`, and their `D^-1/2 r` in x.
    """
    # Fields are read once: each access counts references.
    n, m, p = qp.x.shape[0], qp.e.shape[0], qp.counts[0]
    x, kept, side, root, y = qp.x, qp.kept, qp.side, qp.root, qp.y
    W, rows, upper, last, active = qp.W, qp.rows, qp.upper, qp.last, qp.active
    all_scaled, system = qp.scaled, qp.system
    for i in range(n):
        kept[i], x[i] = 0.0, root[i] * qp.diagonal[1, i]
        if side[i] != 0:
            kept[i], x[i] = upper[i] if side[i] > 0 else qp.lower[i], 0.0
    size = 0
    for row in range(m + p + qp.counts[1]):
        if row < m:
            own, b, slack = W[row], qp.e[row], 1.0
        else:
            i = row - m
            own, b, slack = rows[i], upper[n + i], 0.0
            if i < p and side[n + i] == 0:
                continue
            if i < p and side[n + i] == _SOFT:
                b, slack = qp.wanted[i], 1.0 / qp.weight[0]
        end, scaled, line = last[row], all_scaled[size], system[size]
        for i in range(end):
            scaled[i] = own[i] * root[i] if side[i] == 0 else 0.0
        active[size] = row
        y[size] = dot(own, kept, end) - b + dot(scaled, x, end)
        for other in range(size + 1):
            shared = min(end, last[active[other]])
            line[other] = dot(scaled, all_scaled[other], shared)
        line[size] += slack
        size += 1
    return size


@inner
def _recover(qp: QpArrays, size: int) -> bool:  # noqa: C901, one pass
    """Write x and the multipliers from the solution of the small system.

    Make inactive what has a multiplier of the wrong sign; return if there is any.
    """
    n, m, changed = qp.x.shape[0], qp.e.shape[0], False
    lower, upper, wanted, weight = qp.lower, qp.upper, qp.wanted, qp.weight[0]
    root, kept, diagonal, mu = qp.root, qp.kept, qp.diagonal, qp.mu[0]
    x, multipliers, side, last = qp.x, qp.multipliers, qp.side, qp.last
    W, rows, all_scaled = qp.W, qp.rows, qp.scaled
    multipliers[:] = 0.0
    for k in range(size):
        row, y, scaled = qp.active[k], qp.y[k], all_scaled[k]
        if row >= m:
            multipliers[n + row - m] = y
        own = W[row] if row < m else rows[row - m]
        for i in range(last[row]):
            x[i] -= scaled[i] * y
            multipliers[i] -= own[i] * y
    for i in range(n):
        if side[i] == 0:
            x[i] *= root[i]
            multipliers[i] = 0.0
        else:
            x[i] = kept[i]
            multipliers[i] += diagonal[1, i] - (diagonal[0, i] + mu) * x[i]
            if multipliers[i] * side[i] < 0.0 and lower[i] < upper[i]:
                side[i], changed = 0, True
    for row in range(qp.counts[0]):
        force, state = multipliers[n + row], side[n + row]
        if state != 0 and force < 0.0:
            side[n + row], changed = 0, True
        elif state == _HARD and wanted[row] < upper[n + row]:
            slack = upper[n + row] - wanted[row]
            if force < weight * slack:
                side[n + row], changed = _SOFT, True
    return changed


@inner
def _activate(qp: QpArrays, only_one: bool) -> bool:
    """Make active what is violated, or the worst of it; return if there is any.

    Clips what is violated by rounding.
    """
    n, found, worst, state = qp.x.shape[0], -1, 0.0, 0
    x, side, lower, upper = qp.x, qp.side, qp.lower, qp.upper
    wanted, rows = qp.wanted, qp.rows
    for i in range(n + qp.counts[0]):
        if i < n:
            over, under = x[i] - upper[i], lower[i] - x[i]
            violation, new = (over, 1) if over > under else (under, -1)
            if violation <= _TOLERANCE:  # False for what is not a number
                x[i] = min(max(x[i], lower[i]), upper[i])
                continue
        else:
            soft = wanted[i - n] < upper[i] and side[i] == 0
            bound, new = (wanted[i - n], _SOFT) if soft else (upper[i], _HARD)
            if side[i] == _HARD:
                continue
            violation = dot(rows[i - n], x, n) - bound
            if violation <= _ROW_TOLERANCE:
                continue
        if not only_one:
            side[i] = new
        if found < 0 or violation > worst:
            found, worst, state = i, violation, new
    if only_one and found >= 0:
        side[found] = state
    return found >= 0
