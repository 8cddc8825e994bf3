"""Types of the package: arrays, and names of the catalogue.

NumPy's types cannot express shapes; docstrings give them. Values are float64. The
aliases use `floating`, because NumPy's stubs lose the width in ordinary arithmetic.
"""

from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.floating[Any]]
"""Float64 array of any number of dimensions."""

Vector: TypeAlias = NDArray[np.floating[Any]]
"""One-dimensional float64 array."""

Matrix: TypeAlias = NDArray[np.floating[Any]]
"""Two-dimensional float64 array."""

Indices: TypeAlias = NDArray[np.int64]
"""Integer array of indices."""

Records: TypeAlias = NDArray[np.void]
"""Structured array, such as of `LAW` or `DRIVE` records."""

CompiledRecords: TypeAlias = Any
"""Such an array, or one of its records, in a kernel: fields are attributes."""

RobotName: TypeAlias = Literal[
    "Aloha",
    "Arx5",
    "Baxter",
    "G1",
    "G1ArmsOnly",
    "G1FixedLowerBody",
    "G1FloatingBody",
    "G1FreeBody",
    "Go2",
    "GR1",
    "GR1ArmsOnly",
    "GR1FixedLowerBody",
    "GR1FloatingBody",
    "GR1FreeBody",
    "IIWA",
    "IIWA14",
    "Jaco",
    "Kinova3",
    "Kinova3Omron",
    "Panda",
    "PandaDexLH",
    "PandaDexRH",
    "PandaDexRHOmron",
    "PandaOmron",
    "PR2",
    "Sawyer",
    "SawyerOmron",
    "Spot",
    "SpotWithArm",
    "SpotWithArmFloating",
    "Tiago",
    "TiagoDifferential",
    "UR5e",
    "UR5eDexRH",
    "UR5eDexRHOmron",
    "UR5eOmron",
    "VX300S",
    "VX300SMobile",
    "XArm7",
    "Yumi",
    "Z1",
]
"""Robots of the catalogue, as editors complete them; case is ignored."""
