"""The least change within bounds against quadprog and its KKT conditions."""

import numpy as np
import quadprog

from wbc_suite.qp.least_change import least_change


def unit_rows(rng, m, n):
    rows = rng.normal(size=(m, n))
    return rows / np.linalg.norm(rows, axis=1)[:, None]


def solve(rows, low, high):
    n = rows.shape[1]
    x = np.empty(n)
    return least_change(rows, low, high, x, np.empty((3 * n + 4, n))), x


def test_optimum_is_that_of_quadprog(rng):
    for _ in range(100):
        n, m = int(rng.integers(1, 12)), int(rng.integers(1, 30))
        rows = unit_rows(rng, m, n)
        middle = rows @ rng.normal(size=n)
        low, high = middle - rng.random(m), middle + rng.random(m)
        ok, x = solve(rows, low, high)
        assert ok
        both = np.vstack([rows, -rows]).T
        bounds = np.concatenate([low, -high])
        expected = quadprog.solve_qp(np.eye(n), np.zeros(n), both, bounds)[0]
        np.testing.assert_allclose(x, expected, atol=1e-9)


def test_zero_is_the_answer_where_it_is_feasible(rng):
    rows = unit_rows(rng, 5, 3)
    ok, x = solve(rows, -np.ones(5), np.ones(5))
    assert ok
    np.testing.assert_array_equal(x, 0.0)


def test_rows_of_zeros_and_repeated_rows_do_no_harm(rng):
    rows = unit_rows(rng, 4, 3)
    rows[1], rows[2] = rows[0], 0.0
    low = np.array([0.5, 0.5, -np.inf, -np.inf])
    ok, x = solve(rows, low, np.full(4, np.inf))
    assert ok
    np.testing.assert_allclose(x, 0.5 * rows[0], atol=1e-12)


def test_bounds_that_exclude_each_other_are_reported(rng):
    rows = unit_rows(rng, 2, 4)
    rows[1] = rows[0]
    ok, _ = solve(rows, np.array([1.0, -2.0]), np.array([2.0, 0.0]))
    assert not ok


def test_nearly_dependent_rows_cost_no_digits(rng):
    """The point at the bounds of three rows that are 1e-5 from a plane."""
    for _ in range(20):
        rows = unit_rows(rng, 3, 5)
        rows[2] = rows[0] + rows[1] + 1e-5 * rows[2]
        rows[2] /= np.linalg.norm(rows[2])
        bounds = np.array([1.0, 1.0, 3.0])
        ok, x = solve(rows, bounds, bounds)
        assert ok
        size = np.abs(x).max()
        np.testing.assert_allclose(rows @ x, bounds, rtol=0.0, atol=1e-15 * size)
