"""Factors of small matrices: exact where rows nearly depend on each other."""

from typing import Any

import numpy as np
import pytest

from wbc_suite import linear_algebra
from wbc_suite.compiling import plain


def in_python(name: str) -> Any:
    """Return what a compiled function says in Python."""
    return plain(getattr(linear_algebra, name))


@pytest.mark.parametrize("apart", [1.0, 1e-4, 1e-8])
def test_shortest_solves_to_rounding_where_rows_nearly_depend(apart):
    """`Q^T C^-1 b` misses b by 7e-8 of its size at 1e-8."""
    rng = np.random.default_rng(0)
    for _ in range(50):
        rows, b = rng.normal(size=(6, 9)), rng.normal(size=6)
        rows[5] = rows[4] + apart * rng.normal(size=9)
        Q, C, solved, z = rows.copy(), np.zeros((6, 6)), b.copy(), np.empty(9)
        in_python("lq_factor")(Q, 9, C)
        in_python("solve_lower")(C, solved, 6)
        in_python("lq_solve")(Q, 9, solved, z)
        size = np.linalg.norm(z)
        missed = np.linalg.norm(rows @ z - b) / (np.linalg.norm(rows) * size)
        assert missed < 1e-15
        least = np.linalg.norm(np.linalg.pinv(rows) @ b)
        assert size == pytest.approx(least, rel=1e-14 / apart)
