"""Rotation vectors, compiled; Pinocchio's `log3` and `Jlog3` are the reference."""

import numpy as np

from wbc_suite.compiling import inner
from wbc_suite.linear_algebra import dot
from wbc_suite.typing import Matrix, Vector

LARGEST_FINITE = (
    1e9  # m or rad; a target beyond it counts as not finite: squares may overflow
)
_SMALL_ANGLE = 1e-4  # below it series are exact to 1e-16


@inner
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


@inner
def exp3(x: float, y: float, z: float, out: Matrix) -> None:
    """Write the rotation of a rotation vector r, `I + a [r] + b [r]^2`, shape (3, 3).

    Source: Rodrigues' formula; b from half the angle, which keeps its digits.
    """
    square = x * x + y * y + z * z
    angle = np.sqrt(square)
    if angle < _SMALL_ANGLE:
        a, b = 1.0 - square / 6.0, 0.5 - square / 24.0
    else:
        half = np.sin(0.5 * angle) / angle
        a, b = np.sin(angle) / angle, 2.0 * half * half
    _write_series(x, y, z, a, b, out)


@inner
def _write_series(
    x: float, y: float, z: float, a: float, b: float, out: Matrix
) -> None:
    """Write `I + a [r] + b [r]^2`, shape (3, 3)."""
    out[0, 0] = 1.0 - b * (y * y + z * z)
    out[1, 1] = 1.0 - b * (x * x + z * z)
    out[2, 2] = 1.0 - b * (x * x + y * y)
    out[0, 1], out[1, 0] = b * x * y - a * z, b * x * y + a * z
    out[0, 2], out[2, 0] = b * x * z + a * y, b * x * z - a * y
    out[1, 2], out[2, 1] = b * y * z - a * x, b * y * z + a * x


def is_usable(target: Vector) -> bool:
    """Return whether all values are finite and nearer than LARGEST_FINITE."""
    values = target.ravel().tolist()  # a dozen: three times as fast as NumPy's calls
    return all(
        -LARGEST_FINITE < value < LARGEST_FINITE for value in values
    )  # NaN compares false


@inner
def saturate(step: Vector, limit: float) -> None:
    """Shorten a step in place to the given length, keeping its direction."""
    norm = np.sqrt(dot(step, step, step.shape[0]))
    if norm > limit:
        for i in range(step.shape[0]):
            step[i] *= limit / norm


@inner
def inverse_left_jacobian(r: Vector, angle: float, out: Matrix) -> None:
    """Write `Jl^-1(r) = I - [r] / 2 + b [r]^2`, the inverse left Jacobian of SO(3)."""
    if angle < _SMALL_ANGLE:
        b = 1.0 / 12.0
    else:
        b = 1.0 / angle**2 - 0.5 / (angle * np.tan(0.5 * angle))
    _write_series(r[0], r[1], r[2], -0.5, b, out)
