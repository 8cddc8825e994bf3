"""Small systems of equations in compiled code."""

import numpy as np

from wbc_suite.compiling import compiled
from wbc_suite.typing import Matrix, Vector

__all__ = ["factorise", "pseudo_inverse", "solve", "solve_lower", "solve_upper"]

SWEEPS = 12
"""Of Jacobi's method at most; 6 make a matrix of 6 rows diagonal."""


@compiled
def factorise(A: Matrix) -> None:
    """Write the factor R of `A = R R^T` over the lower triangle of A."""
    for i in range(A.shape[0]):
        for j in range(i + 1):
            total = A[i, j]
            for k in range(j):
                total -= A[i, k] * A[j, k]
            A[i, j] = np.sqrt(total) if i == j else total / A[j, j]


@compiled
def solve_lower(R: Matrix, x: Vector) -> None:
    """Solve `R x = b` in place."""
    for i in range(x.shape[0]):
        total = x[i]
        for k in range(i):
            total -= R[i, k] * x[k]
        x[i] = total / R[i, i]


@compiled
def solve_upper(R: Matrix, x: Vector) -> None:
    """Solve `R^T x = b` in place."""
    for i in range(x.shape[0] - 1, -1, -1):
        total = x[i]
        for k in range(i + 1, x.shape[0]):
            total -= R[k, i] * x[k]
        x[i] = total / R[i, i]


@compiled
def solve(A: Matrix, B: Matrix) -> None:  # noqa: C901, one elimination
    """Solve `A X = B` in place by elimination with pivots; A is used up."""
    n, count = A.shape[0], B.shape[1]
    for i in range(n):
        pivot = i
        for k in range(i + 1, n):
            if abs(A[k, i]) > abs(A[pivot, i]):
                pivot = k
        for j in range(n):
            A[i, j], A[pivot, j] = A[pivot, j], A[i, j]
        for j in range(count):
            B[i, j], B[pivot, j] = B[pivot, j], B[i, j]
        for k in range(i + 1, n):
            part = A[k, i] / A[i, i]
            for j in range(i, n):
                A[k, j] -= part * A[i, j]
            for j in range(count):
                B[k, j] -= part * B[i, j]
    for i in range(n - 1, -1, -1):
        for j in range(count):
            total = B[i, j]
            for k in range(i + 1, n):
                total -= A[i, k] * B[k, j]
            B[i, j] = total / A[i, i]


@compiled
def pseudo_inverse(A: Matrix, least: float, out: Matrix) -> None:
    """Write the pseudo-inverse of a symmetric matrix, by Jacobi's method.

    Args:
        A: Shape (n, n), positive semidefinite; it is used up.
        least: Part of the largest eigenvalue below which others count as zero.
        out: Shape (n, n).

    Source: Golub and Van Loan (2013), "Matrix Computations", section 8.5.
    """
    n = A.shape[0]
    V = np.eye(n)
    for _ in range(SWEEPS):
        if not sweep(A, V):
            break
    largest = 0.0
    for i in range(n):
        largest = max(largest, A[i, i])
    for i in range(n):
        for j in range(n):
            out[i, j] = 0.0
            for k in range(n):
                if A[k, k] > least * largest:
                    out[i, j] += V[i, k] * V[j, k] / A[k, k]


@compiled
def sweep(A: Matrix, V: Matrix) -> bool:
    """Turn away all that is off the diagonal once; tell whether there was any."""
    n, turned, size = A.shape[0], False, 0.0
    for i in range(n):
        size = max(size, abs(A[i, i]))
    for i in range(n):
        for j in range(i + 1, n):
            if abs(A[i, j]) <= 1e-15 * size:
                continue
            turned = True
            ratio = 0.5 * (A[j, j] - A[i, i]) / A[i, j]
            t = 1.0 / (abs(ratio) + np.sqrt(1.0 + ratio * ratio))
            if ratio < 0.0:
                t = -t
            c = 1.0 / np.sqrt(1.0 + t * t)
            s = c * t
            for k in range(n):
                x, y = A[k, i], A[k, j]
                A[k, i], A[k, j] = c * x - s * y, s * x + c * y
            for k in range(n):
                x, y = A[i, k], A[j, k]
                A[i, k], A[j, k] = c * x - s * y, s * x + c * y
                x, y = V[k, i], V[k, j]
                V[k, i], V[k, j] = c * x - s * y, s * x + c * y
    return turned
