"""Factors of small matrices, in compiled code.

Triangular factors hold the inverses of their diagonals there: they are what is used.
"""

import numpy as np

from wbc_suite.compiling import inlined
from wbc_suite.typing import Matrix, Vector

__all__ = ["cholesky", "least_eigenvalue", "orthonormalise", "shortest"]
__all__ += ["solve_lower", "solve_upper"]

SMALLEST = 1e-30
"""Square of a length that counts as zero."""


@inlined
def cholesky(A: Matrix, n: int) -> None:
    """Write L of `A = L L^T` over the lower triangle of A, shape (n, n)."""
    for i in range(n):
        for j in range(i + 1):
            total = A[i, j]
            for k in range(j):
                total -= A[i, k] * A[j, k]
            A[i, j] = 1.0 / np.sqrt(total) if i == j else total * A[j, j]


@inlined
def orthonormalise(Q: Matrix, n: int, C: Matrix) -> None:
    """Write C of `A = C Q`, and Q over A, shape (m, n): modified Gram-Schmidt.

    Rows of Q are orthonormal, C is lower triangular, shape (m, m).
    """
    for i in range(Q.shape[0]):
        for k in range(i + 1):
            total = 0.0
            for j in range(n):
                total += Q[k, j] * Q[i, j]
            if k < i:
                C[i, k] = total
                for j in range(n):
                    Q[i, j] -= total * Q[k, j]
            else:
                C[i, i] = 1.0 / np.sqrt(max(total, SMALLEST))
                for j in range(n):
                    Q[i, j] *= C[i, i]


@inlined
def shortest(Q: Matrix, n: int, b: Vector, z: Vector) -> None:
    """Write the shortest z with `Q z = b`, where Q is from `orthonormalise`.

    Of ill-conditioned rows that leaves some that are not quite orthogonal, and `Q^T b`
    is off by as much; row by row from the last, z is as exact as what they came from.

    Args:
        Q: Orthonormal rows, shape (m, n or more).
        n: Length of the rows.
        b: Shape (m,).
        z: Output, shape (n,) or longer.

    Source: Björck, Paige (1992), "Loss and recapture of orthogonality in the modified
    Gram-Schmidt algorithm", SIAM J. Matrix Anal. Appl. 13(1).
    """
    for j in range(n):
        z[j] = 0.0
    for i in range(Q.shape[0] - 1, -1, -1):
        missing = b[i]
        for j in range(n):
            missing -= Q[i, j] * z[j]
        for j in range(n):
            z[j] += Q[i, j] * missing


@inlined
def least_eigenvalue(C: Matrix, column: Vector) -> float:
    """Return `1 / trace((C C^T)^-1)`, between least eigenvalue and its m-th part.

    Args:
        C: Lower triangular, shape (m, m).
        column: Scratch, shape (m,).
    """
    total, m = 0.0, C.shape[0]
    for j in range(m):
        for i in range(j, m):
            value = 1.0 if i == j else 0.0
            for k in range(j, i):
                value -= C[i, k] * column[k]
            column[i] = value * C[i, i]
            total += column[i] * column[i]
    return 1.0 / total


@inlined
def solve_lower(C: Matrix, x: Vector, n: int) -> None:
    """Solve `C x = b` in place, C lower triangular, shape (n, n)."""
    for i in range(n):
        for k in range(i):
            x[i] -= C[i, k] * x[k]
        x[i] *= C[i, i]


@inlined
def solve_upper(C: Matrix, x: Vector, n: int) -> None:
    """Solve `C^T x = b` in place, C lower triangular, shape (n, n)."""
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            x[i] -= C[k, i] * x[k]
        x[i] *= C[i, i]
