"""An orthonormal basis of rows, and of what the upper levels of a stack decide."""

import numpy as np

from wbc_suite.compiling import compiled
from wbc_suite.qp.sums import dot
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["decided_directions", "row_space"]

_LOST_DIRECTION = 0.05  # share of a unit vector outside the present basis
_SINGULAR = 2e-2  # shortest over longest row, under which a singularity is near
_RANK_TOLERANCE = 1e-6  # rows of an upper level shorter than this bind nothing


@compiled
def row_space(W: Matrix, tolerance: float, V: Matrix, lengths: Vector) -> int:
    """Write an orthonormal basis of the rows of W, largest first; return its size.

    Gram-Schmidt with pivoting, each vector orthogonalised twice ("twice is enough",
    Giraud et al. 2005). Rows that are left shorter than the tolerance are dropped.

    Args:
        W: Rows, shape (m, n); destroyed.
        tolerance: Absolute length under which a row counts as dependent.
        V: Output, shape (at least min(m, n), n).
        lengths: Output, what was left of each chosen row, descending.

    Returns:
        The rank r; V[:r] holds the basis.
    """
    m, n = W.shape
    rank = 0
    for _ in range(min(m, V.shape[0])):
        best, pivot = 0.0, -1
        for i in range(m):
            length = dot(W[i], W[i], n)
            if length > best:
                best, pivot = length, i
        if best <= tolerance * tolerance:
            break
        row, v = W[pivot], V[rank]
        lengths[rank] = np.sqrt(best)
        scale = 1.0 / np.sqrt(best)
        for j in range(n):
            v[j] = row[j] * scale
        _remove(V, rank, v)
        scale = 1.0 / np.sqrt(dot(v, v, n))
        for j in range(n):
            v[j] *= scale
            row[j] = 0.0
        rank += 1
        for i in range(m):
            along = dot(W[i], v, n)
            if along != 0.0:
                for j in range(n):
                    W[i, j] -= along * v[j]
    return rank


@compiled
def _remove(V: Matrix, count: int, v: Vector) -> None:
    """Take from v, in place, its components along the first rows of V."""
    for i in range(count):
        along = dot(V[i], v, v.shape[0])
        for j in range(v.shape[0]):
            v[j] -= along * V[i, j]


@compiled
def decided_directions(
    rows: Matrix, V: Matrix, lengths: Vector, kept: Matrix, counts: Indices
) -> int:
    """Write an orthonormal basis of what some levels decide; return its size.

    Near a singularity the direction that they are losing turns quickly. Were it handed
    over meanwhile, the lower level would bend a stretched arm and the upper stretch it
    again, at full acceleration. So until the singularity is left, what was theirs at
    the last tick stays theirs.

    Args:
        rows: Rows of all levels above and of the equalities, shape (m, nv); destroyed.
        V: Output, shape (nv, nv).
        lengths: Output of `row_space`, shape (nv,).
        kept: In and out, the basis of the last tick, shape (nv, nv).
        counts: In and out, its size, and the greatest number of independent rows since
            both were zero.
    """
    rank = row_space(rows, _RANK_TOLERANCE, V, lengths)
    counts[1] = max(counts[1], rank)
    clear = rank == counts[1]
    if rank > 0:
        clear = clear and lengths[rank - 1] > _SINGULAR * lengths[0]
    if not clear and counts[0] > 0:
        for i in range(counts[0]):
            _remove(V, rank, kept[i])
        rank += row_space(kept[: counts[0]], _LOST_DIRECTION, V[rank:], lengths)
    for i in range(rank):
        for j in range(V.shape[1]):
            kept[i, j] = V[i, j]
    counts[0] = rank
    return rank
