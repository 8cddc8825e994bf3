"""Small dense linear algebra against NumPy, also where rows nearly depend."""

import numpy as np
import pytest

from wbc_suite.linear_algebra import (
    cholesky,
    copy_rows,
    copy_vector,
    inverse_trace,
    lq_factor,
    lq_solve,
    row_space,
    solve,
    solve_lower,
    solve_upper,
)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20)


def positive_definite(rng, n):
    W = rng.normal(size=(n + 2, n))
    return W.T @ W


def lower(L):
    """Return L with its diagonal as it is, not inverted."""
    return np.tril(L, -1) + np.diag(1.0 / np.diag(L))


def test_copies_leave_what_is_longer_and_may_shift_rows_up(rng):
    A, x = rng.normal(size=(4, 3)), rng.normal(size=4)
    rows, vector = A.copy(), np.ones(6)
    copy_rows(rows[1:], rows)
    np.testing.assert_array_equal(rows, A[[1, 2, 3, 3]])
    copy_vector(x, vector)
    np.testing.assert_array_equal(vector, [*x, 1.0, 1.0])


@pytest.mark.parametrize("n", [1, 4, 23])
def test_cholesky_and_triangular_solves_solve_a_definite_system(rng, n):
    A, b = positive_definite(rng, n), rng.normal(size=n)
    L, x = np.zeros((n + 1, n + 3)), b.copy()  # buffers may be larger
    L[:n, :n] = A
    assert cholesky(L, n, 0.0) == n
    factor = lower(L[:n, :n])
    np.testing.assert_allclose(factor @ factor.T, A, atol=1e-12)
    solve_lower(L, x, n)
    np.testing.assert_allclose(factor @ x, b, atol=1e-11)
    solve_upper(L, x, n)
    np.testing.assert_allclose(A @ x, b, atol=1e-9)


def test_cholesky_leaves_dependent_rows_out(rng):
    A = positive_definite(rng, 5)
    A[3], A[:, 3] = A[1], A[:, 1].copy()
    A[3, 3] = A[1, 1]
    b = rng.normal(size=5)
    L, x, kept = A.copy(), b.copy(), [0, 1, 2, 4]
    assert cholesky(L, 5, 1e-12) == 4
    solve_lower(L, x, 5)
    solve_upper(L, x, 5)
    assert x[3] == 0.0
    expected = np.linalg.solve(A[np.ix_(kept, kept)], b[kept])
    np.testing.assert_allclose(x[kept], expected, rtol=1e-9)


@pytest.mark.parametrize("value", [-1.0, 0.0, np.nan])
def test_cholesky_reports_what_is_not_definite(rng, value):
    A = positive_definite(rng, 4)
    A[2, 2] = value
    assert cholesky(A, 4, 1e-14) < 4


def test_elimination_solves_general_systems(rng):
    A, B = rng.normal(size=(6, 6)), rng.normal(size=(6, 3))
    A[0, 0] = 0.0  # needs a pivot
    X = B.copy()
    solve(A.copy(), X, 6)
    np.testing.assert_allclose(A @ X, B, atol=1e-12)


@pytest.mark.parametrize("apart", [1.0, 1e-4, 1e-8])
def test_least_norm_is_exact_where_rows_nearly_depend(rng, apart):
    """`Q^T y` alone misses b by 7e-8 of its size at 1e-8."""
    for _ in range(50):
        rows, b = rng.normal(size=(6, 9)), rng.normal(size=6)
        rows[5] = rows[4] + apart * rng.normal(size=9)
        Q, L, y, x = rows.copy(), np.zeros((6, 6)), b.copy(), np.empty(9)
        lq_factor(Q, 9, L)
        solve_lower(L, y, 6)
        lq_solve(Q, 9, y, x)
        size = np.linalg.norm(x)
        residual = np.linalg.norm(rows @ x - b) / (np.linalg.norm(rows) * size)
        assert residual < 1e-15
        least = np.linalg.norm(np.linalg.pinv(rows) @ b)
        assert size == pytest.approx(least, rel=1e-14 / apart)


def test_lq_factors_multiply_to_the_matrix(rng):
    A, L = rng.normal(size=(4, 7)), np.zeros((4, 4))
    Q = A.copy()
    lq_factor(Q, 7, L)
    np.testing.assert_allclose(Q @ Q.T, np.eye(4), atol=1e-14)
    np.testing.assert_allclose(lower(L) @ Q, A, atol=1e-13)


def test_inverse_trace_bounds_the_least_eigenvalue(rng):
    A = positive_definite(rng, 6)
    L = A.copy()
    cholesky(L, 6, 0.0)
    value = inverse_trace(L, np.empty(6))
    assert value == pytest.approx(1.0 / np.trace(np.linalg.inv(A)))
    least = np.linalg.eigvalsh(A)[0]
    assert least / 6 <= value <= least


def test_row_space_is_that_of_the_singular_value_decomposition(rng):
    for rows, rank in ((5, 5), (12, 7), (30, 20)):
        W = rng.normal(size=(rows, rank)) @ rng.normal(size=(rank, 20))
        V, lengths = np.zeros((20, 20)), np.zeros(20)
        assert row_space(W.copy(), 1e-9, V, lengths) == rank
        basis = V[:rank]
        np.testing.assert_allclose(basis @ basis.T, np.eye(rank), atol=1e-13)
        np.testing.assert_allclose(W @ basis.T @ basis, W, atol=1e-11)
        assert (np.diff(lengths[:rank]) <= 0).all()
