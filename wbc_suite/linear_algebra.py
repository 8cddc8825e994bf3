"""Dense linear algebra on small matrices, for compiled code.

Triangular factors hold the inverses of their diagonals, because those are what the
solvers use. Functions take the size n of the system, so that buffers may be larger.
"""

import numba
import numpy as np

from wbc_suite.compiling import compiled, inner
from wbc_suite.typing import Matrix, Vector

_SMALLEST = 1e-30  # square of a length that counts as zero


# Sums may be reassociated, which makes them vector instructions. NaN stays NaN.
@numba.njit(nogil=True, fastmath={"reassoc", "contract"})
def dot(a: Vector, b: Vector, n: int) -> float:
    """Return the sum of `a[i] b[i]` over the first n entries."""
    total = 0.0
    for i in range(n):
        total += a[i] * b[i]
    return total


@inner
def copy_vector(source: Vector, target: Vector) -> None:
    """Write a vector to the first entries of another one, which may be longer."""
    # For `target[:n] = source` numba compiles much more: errors, arrays that overlap.
    for i in range(source.shape[0]):
        target[i] = source[i]


@inner
def copy_rows(source: Matrix, target: Matrix) -> None:
    """Write a matrix to the first rows of another one of as many columns."""
    for i in range(source.shape[0]):
        copy_vector(source[i], target[i])


@inner
def cross(a: Vector, b: Vector) -> Vector:
    """Return the cross product of two vectors, shape (3,)."""
    c = np.empty(3)
    c[0] = a[1] * b[2] - a[2] * b[1]
    c[1] = a[2] * b[0] - a[0] * b[2]
    c[2] = a[0] * b[1] - a[1] * b[0]
    return c


@inner
def cholesky(A: Matrix, n: int, tolerance: float) -> int:
    """Factorise `A = L L^T` in place; return the number of independent rows.

    L has an inverted diagonal. A row that depends on the rows above it gets a zero in
    place of its inverted diagonal entry: `solve_lower` and `solve_upper` then leave it
    out, with x = 0. That happens where A is singular or not finite.

    Args:
        A: Symmetric positive semidefinite, shape (n, n) or larger; only the lower
            triangle is read and written.
        n: Size of the system.
        tolerance: Part of a diagonal entry that the rows above must leave.
    """
    rank = 0
    for i in range(n):
        row = A[i]
        for j in range(i):
            row[j] = (row[j] - dot(row, A[j], j)) * A[j, j]
        pivot = row[i] - dot(row, row, i)
        if pivot > tolerance * row[i]:
            row[i] = 1.0 / np.sqrt(pivot)
            rank += 1
        else:
            row[i] = 0.0
    return rank


@inner
def solve_lower(L: Matrix, x: Vector, n: int) -> None:
    """Solve `L x = b` in place; the diagonal of L is inverted."""
    for i in range(n):
        x[i] = (x[i] - dot(L[i], x, i)) * L[i, i]


@inner
def solve_upper(L: Matrix, x: Vector, n: int) -> None:
    """Solve `L^T x = b` in place; the diagonal of L is inverted."""
    for i in range(n - 1, -1, -1):
        x[i] *= L[i, i]
        row, value = L[i], x[i]
        for j in range(i):
            x[j] -= row[j] * value


@inner
def solve(A: Matrix, B: Matrix, n: int) -> None:  # noqa: C901, one elimination
    """Solve `A X = B` in place by Gaussian elimination with partial pivoting.

    A, shape (n, n), must not be singular and is destroyed; B has shape (n, k).
    """
    for i in range(n):
        pivot = i
        for k in range(i + 1, n):
            if abs(A[k, i]) > abs(A[pivot, i]):
                pivot = k
        for j in range(n):
            A[i, j], A[pivot, j] = A[pivot, j], A[i, j]
        for j in range(B.shape[1]):
            B[i, j], B[pivot, j] = B[pivot, j], B[i, j]
        for k in range(i + 1, n):
            part = A[k, i] / A[i, i]
            for j in range(i, n):
                A[k, j] -= part * A[i, j]
            for j in range(B.shape[1]):
                B[k, j] -= part * B[i, j]
    for i in range(n - 1, -1, -1):
        for j in range(B.shape[1]):
            for k in range(i + 1, n):
                B[i, j] -= A[i, k] * B[k, j]
            B[i, j] /= A[i, i]


@compiled
def lq_factor(Q: Matrix, n: int, L: Matrix) -> None:
    """Factorise `A = L Q` by modified Gram-Schmidt; Q overwrites A.

    Q has shape (m, n) or wider, m <= n. L, shape (m, m), is lower triangular with an
    inverted diagonal.
    """
    for i in range(Q.shape[0]):
        row = Q[i]
        for k in range(i):
            other = Q[k]
            part = dot(other, row, n)
            L[i, k] = part
            for j in range(n):
                row[j] -= part * other[j]
        L[i, i] = 1.0 / np.sqrt(max(dot(row, row, n), _SMALLEST))
        for j in range(n):
            row[j] *= L[i, i]


@inner
def lq_solve(Q: Matrix, n: int, y: Vector, x: Vector) -> None:
    """Write the shortest x with `Q x = y`: the least squares solution of `A x = b`.

    With `A = L Q` from `lq_factor`, y solves `L y = b`. Where rows of A are nearly
    dependent, Q is not quite orthonormal, and `Q^T y` loses digits. Row by row from
    the last, x is as exact as A. Q, shape (m, n), may be wider and x longer.

    Source: Björck, Paige (1992), "Loss and recapture of orthogonality in the modified
    Gram-Schmidt algorithm", SIAM J. Matrix Anal. Appl. 13(1).
    """
    x[:n] = 0.0
    for i in range(Q.shape[0] - 1, -1, -1):
        row = Q[i]
        missing = y[i] - dot(row, x, n)
        for j in range(n):
            x[j] += row[j] * missing


@inner
def inverse_trace(L: Matrix, column: Vector) -> float:
    """Return `1 / trace((L L^T)^-1)`, a lower bound of the least eigenvalue.

    L, shape (m, m), is lower triangular with an inverted diagonal; `column`, shape
    (m,), is scratch.
    """
    total, m = 0.0, L.shape[0]
    for j in range(m):
        for i in range(j, m):
            value = 1.0 if i == j else 0.0
            for k in range(j, i):
                value -= L[i, k] * column[k]
            column[i] = value * L[i, i]
            total += column[i] * column[i]
    return 1.0 / total


@inner
def row_space(W: Matrix, tolerance: float, V: Matrix, lengths: Vector) -> int:
    """Write an orthonormal basis of the rows of W, longest first; return the rank.

    Gram-Schmidt with pivoting; each vector is orthogonalised twice ("twice is enough",
    Giraud et al. 2005). Rows of W, shape (m, n), are destroyed. Those that are left
    shorter than the tolerance are dropped; V, shape (min(m, n), n) or more, gets the
    others, and `lengths` what was left of each, descending.
    """
    m, n = W.shape
    rank = 0
    for _ in range(min(m, V.shape[0])):
        best, pivot = 0.0, -1
        for i in range(m):
            square = dot(W[i], W[i], n)
            if square > best:
                best, pivot = square, i
        if best <= tolerance * tolerance:
            break
        row, v = W[pivot], V[rank]
        lengths[rank] = np.sqrt(best)
        for j in range(n):
            v[j] = row[j] / lengths[rank]
        subtract_projection(V, rank, v)
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


@inner
def subtract_projection(V: Matrix, count: int, v: Vector) -> None:
    """Subtract from v, in place, its projection onto the first rows of V."""
    n = v.shape[0]
    for i in range(count):
        along = dot(V[i], v, n)
        for j in range(n):
            v[j] -= along * V[i, j]
