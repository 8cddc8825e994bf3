"""Shared array types.

Shapes are told in docstrings: NumPy's types cannot carry them.
"""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Vector: TypeAlias = NDArray[np.float64]
"""One-dimensional float64 array."""

Matrix: TypeAlias = NDArray[np.float64]
"""Two-dimensional float64 array."""

Indices: TypeAlias = NDArray[np.int64]
"""One-dimensional integer array that indexes another."""
