"""Sums that compile to vector instructions."""

import numba

from wbc_suite.typing import Vector

__all__ = ["dot"]


# Reassociated: terms may be added in any order. NaN stays NaN. Not cached on disk: what
# calls it is cached with it inside.
@numba.njit(nogil=True, fastmath={"reassoc", "contract"})
def dot(a: Vector, b: Vector, size: int) -> float:
    """Return the sum of `a[i] b[i]` over the first entries."""
    total = 0.0
    for i in range(size):
        total += a[i] * b[i]
    return total
