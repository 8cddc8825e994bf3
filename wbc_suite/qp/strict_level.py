"""Strict priorities: what the levels above leave to a level."""

import numpy as np

from wbc_suite.compiling import inner
from wbc_suite.linear_algebra import copy_rows, dot, row_space, subtract_projection
from wbc_suite.qp.problem import UNBOUNDED
from wbc_suite.qp.task_rows import LevelArrays, PartArrays
from wbc_suite.typing import Matrix

_LOST_DIRECTION = 0.05  # share of a unit vector outside the present basis
_SINGULAR = 2e-2  # shortest over longest row, under which a singularity is near
_RANK_TOLERANCE = 1e-6  # rows of an upper level shorter than this bind nothing


@inner
def restrict_level(parts: PartArrays, k: int, dt: float) -> bool:
    """State that level k may move in ways that all levels above rate like their step.

    Those are `V dq = V x`, where V is an orthonormal basis of the equality rows and of
    all rows above. x, the step of the level above, is one of them, so the problem has a
    solution. Return True.
    """
    levels, x, nv = parts.levels, parts.x, parts.x.shape[0]
    level, first = levels[k], levels[0].qp
    qp, p, count = level.qp, first.counts[0], first.counts[1]
    above, rows = level.above, qp.rows
    copy_rows(first.rows[p : p + count], above)
    for j in range(k):
        W = levels[j].qp.W
        copy_rows(W, above[count:])
        count += W.shape[0]
    rank = _decided_directions(above, rows[p:], level)
    qp.counts[1] = rank
    for i in range(nv):
        qp.lower[i], qp.upper[i] = first.lower[i], first.upper[i]
    copy_rows(first.rows[:p], rows)
    for row in range(p + rank):
        y = dot(rows[row], x, nv)
        qp.upper[nv + row] = max(first.wanted[row], y) if row < p else y
        qp.lower[nv + row] = -UNBOUNDED if row < p else y
    return True


@inner
def _decided_directions(rows: Matrix, V: Matrix, level: LevelArrays) -> int:
    """Write an orthonormal basis of what the levels above decide; return its size.

    Near a singularity the direction that they are losing turns quickly. Were it handed
    over meanwhile, the lower level would bend a stretched arm and the upper stretch it
    again, at full acceleration. So until the singularity is left, what was theirs at
    the last tick stays theirs. Their rows are destroyed.
    """
    kept, counts, lengths = level.kept, level.kept_counts, np.empty(V.shape[1])
    rank = row_space(rows, _RANK_TOLERANCE, V, lengths)
    counts[1] = max(counts[1], rank)
    clear = rank == counts[1]
    if rank > 0:
        clear = clear and lengths[rank - 1] > _SINGULAR * lengths[0]
    if not clear and counts[0] > 0:
        for i in range(counts[0]):
            subtract_projection(V, rank, kept[i])
        rank += row_space(kept[: counts[0]], _LOST_DIRECTION, V[rank:], lengths)
    copy_rows(V[:rank], kept)
    counts[0] = rank
    return rank
