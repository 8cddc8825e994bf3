"""The quadratic program of one tick."""

import numpy as np

from wbc_suite.compiling import compiled
from wbc_suite.linear_algebra import dot
from wbc_suite.typing import Indices, Matrix, Vector

UNBOUNDED = 1e30  # a bound at or beyond it binds nothing, as in most solvers


class Problem:
    """Minimise `0.5 x^T H x + c^T x` subject to `G x <= h`, `A x = b`, `lb <= x <= ub`.

    Rows of G may be soft: where `wanted < h`, the cost has the term `0.5 weight s^2`,
    s >= 0 being the violation of `G x <= wanted`.

    Owns its arrays, and keeps all bounds in two vectors. All others are views: write
    into them.

    Args:
        nv: Number of variables.
        inequalities: Rows of G.
        equalities: Rows of A.

    Attributes:
        wanted: Soft upper bounds of G x; not below h, rows are hard.
        weight: Cost of what is missing from that, [cost]^2/m^2.
        rows: G above A.
        lower: Lower bounds of x, G x, A x in this order.
        upper: Upper bounds of the same.
    """

    def __init__(self, nv: int, inequalities: int = 0, equalities: int = 0) -> None:
        rows = inequalities + equalities
        self.H: Matrix = np.eye(nv)
        self.c: Vector = np.zeros(nv)
        self.rows: Matrix = np.zeros((rows, nv))
        self.lower: Vector = np.full(nv + rows, -UNBOUNDED)
        self.upper: Vector = np.full(nv + rows, UNBOUNDED)
        self.lb, self.ub = self.lower[:nv], self.upper[:nv]
        self.G, self.A = self.rows[:inequalities], self.rows[inequalities:]
        self.h = self.upper[nv : nv + inequalities]
        self.wanted: Vector = np.full(inequalities, UNBOUNDED)
        self.weight = 0.0
        self.set_equalities(np.zeros(equalities))

    @property
    def nv(self) -> int:
        """Number of variables."""
        return len(self.c)

    @property
    def equalities(self) -> int:
        """Number of equality rows."""
        return len(self.A)

    @property
    def b(self) -> Vector:
        """Right-hand side of `A x = b`; write it with `set_equalities`."""
        return self.upper[len(self.upper) - len(self.A) :]

    def set_equalities(self, b: Vector) -> None:
        """Set b, shape (equalities,), in both bound vectors."""
        self.b[:] = self.lower[len(self.lower) - len(b) :] = b

    def copy(self, *, equalities: bool = True) -> "Problem":
        """Return a copy, with or without its equality rows."""
        kept = len(self.G) + (self.equalities if equalities else 0)
        out = Problem(self.nv, len(self.G), kept - len(self.G))
        out.H[:], out.c[:], out.rows[:] = self.H, self.c, self.rows[:kept]
        out.lower[:] = self.lower[: self.nv + kept]
        out.upper[:] = self.upper[: self.nv + kept]
        out.wanted[:], out.weight = self.wanted, self.weight
        return out

    def soft(self) -> Indices:
        """Return the soft rows of G."""
        return (self.wanted < self.h).nonzero()[0]

    def with_slack(self, soft: Indices) -> "Problem":
        """Return the problem over (x, s) that states the soft rows with slack s."""
        nv, n = self.nv, self.nv + len(soft)
        out = Problem(n, len(self.G), self.equalities)
        out.H[:nv, :nv], out.c[:nv] = self.H, self.c
        out.H[nv:, nv:] *= self.weight
        out.lower[:nv], out.upper[:nv] = self.lb, self.ub
        out.lower[n:], out.upper[n:] = self.lower[nv:], self.upper[nv:]
        out.rows[:, :nv] = self.rows
        out.lb[nv:] = 0.0
        out.ub[nv:] = np.minimum(self.h[soft] - self.wanted[soft], UNBOUNDED)
        out.G[soft, nv + np.arange(len(soft))] = -1.0
        out.h[soft] = self.wanted[soft]
        return out

    def violation(self, x: Vector) -> float:
        """Return by how much x breaks its worst bound, in the bound's unit."""
        return worst_violation(x, self.rows, self.lower, self.upper)


@compiled
def worst_violation(x: Vector, rows: Matrix, lower: Vector, upper: Vector) -> float:
    """Return the largest of 0, `lower - y` and `y - upper`, where y is (x, rows x).

    A value that is not finite makes the result infinite.
    """
    n, worst = x.shape[0], 0.0
    for i in range(lower.shape[0]):
        y = x[i] if i < n else dot(rows[i - n], x, n)
        if not np.isfinite(y):
            return np.inf
        worst = max(worst, lower[i] - y, y - upper[i])
    return worst


@compiled
def clip_step(
    x: Vector, rows: Matrix, lower: Vector, upper: Vector, tolerance: float
) -> bool:
    """Clip x to its bounds; return whether it broke nothing by more, before and after.

    Long rows feel what clipping has moved.
    """
    if not worst_violation(x, rows, lower, upper) <= tolerance:
        return False
    for i in range(x.shape[0]):
        x[i] = max(min(x[i], upper[i]), lower[i])
    return rows.shape[0] == 0 or worst_violation(x, rows, lower, upper) <= tolerance
