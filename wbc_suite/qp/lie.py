"""Rotation vectors, compiled; Pinocchio's `log3` and `Jlog3` are the reference."""

import numba
import numpy as np

from wbc_suite.typing import Matrix, Vector

__all__ = ["FAR", "inverse_left_jacobian", "is_usable", "log3", "saturate"]

FAR = 1e9
"""m or rad; a target beyond it counts as not finite, since squares of errors may
overflow."""

_SMALL_ANGLE = 1e-4  # below it series are exact to 1e-16


@numba.njit(cache=True, nogil=True)
def log3(R: Matrix, out: Vector) -> float:
    """Write the rotation vector of R, shape (3,), and return its angle in [0, pi].

    Goes through the quaternion (largest component first), which stays accurate near
    pi. Source: Shepperd (1978), "Quaternion from Rotation Matrix", JGC 1(3).
    """
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    if trace > R[0, 0] and trace > R[1, 1] and trace > R[2, 2]:
        w = 0.5 * np.sqrt(max(1.0 + trace, 0.0))
        scale = 0.25 / w
        x = (R[2, 1] - R[1, 2]) * scale
        y = (R[0, 2] - R[2, 0]) * scale
        z = (R[1, 0] - R[0, 1]) * scale
    else:
        i = 0
        if R[1, 1] > R[0, 0]:
            i = 1
        if R[2, 2] > R[i, i]:
            i = 2
        j, k = (i + 1) % 3, (i + 2) % 3
        largest = 0.5 * np.sqrt(max(1.0 + R[i, i] - R[j, j] - R[k, k], 0.0))
        scale = 0.25 / largest
        out[i] = largest
        out[j] = (R[j, i] + R[i, j]) * scale
        out[k] = (R[k, i] + R[i, k]) * scale
        w = (R[k, j] - R[j, k]) * scale
        x, y, z = out[0], out[1], out[2]
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    sine = np.sqrt(x * x + y * y + z * z)
    angle = 2.0 * np.arctan2(sine, w)
    factor = angle / sine if sine > 1e-9 else 2.0
    out[0], out[1], out[2] = factor * x, factor * y, factor * z
    return angle


def is_usable(target: Vector) -> bool:
    """Return whether all values are finite and nearer than FAR."""
    return bool((np.abs(target) < FAR).all())  # NaN compares false


@numba.njit(cache=True, nogil=True)
def saturate(step: Vector, limit: float) -> None:
    """Shorten a step in place to the given length, keeping its direction."""
    norm = 0.0
    for i in range(step.shape[0]):
        norm += step[i] * step[i]
    norm = np.sqrt(norm)
    if norm > limit:
        for i in range(step.shape[0]):
            step[i] *= limit / norm


@numba.njit(cache=True, nogil=True)
def inverse_left_jacobian(r: Vector, angle: float, out: Matrix) -> None:
    """Write `Jl^-1(r)`, the inverse left Jacobian of SO(3) at rotation vector r."""
    if angle < _SMALL_ANGLE:
        b = 1.0 / 12.0
    else:
        b = 1.0 / angle**2 - 0.5 / (angle * np.tan(0.5 * angle))
    x, y, z = r[0], r[1], r[2]
    out[0, 0] = 1.0 - b * (y * y + z * z)
    out[1, 1] = 1.0 - b * (x * x + z * z)
    out[2, 2] = 1.0 - b * (x * x + y * y)
    out[0, 1], out[1, 0] = 0.5 * z + b * x * y, -0.5 * z + b * x * y
    out[0, 2], out[2, 0] = -0.5 * y + b * x * z, 0.5 * y + b * x * z
    out[1, 2], out[2, 1] = 0.5 * x + b * y * z, -0.5 * x + b * y * z
