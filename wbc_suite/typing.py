"""Shared array types.

Shapes are told in docstrings: NumPy's types cannot carry them. Values are float64; the
aliases say `floating`, since NumPy's own stubs lose the width in ordinary arithmetic.
"""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.floating[Any]]
"""Float64 array of any number of dimensions."""

Vector: TypeAlias = NDArray[np.floating[Any]]
"""One-dimensional float64 array."""

Matrix: TypeAlias = NDArray[np.floating[Any]]
"""Two-dimensional float64 array."""

Indices: TypeAlias = NDArray[np.int64]
"""One-dimensional integer array that indexes another."""
