"""How fast one can go back where one came."""

import numpy as np

from wbc_suite.compiling import compiled
from wbc_suite.typing import Matrix, Vector

__all__ = ["paces_back"]

MOST = 50.0  # times as fast as the robot came
RATIOS = 60  # paces that are tried between two places


def paces_back(v: Matrix, steps: Vector, *, speed: Vector, rate: Vector) -> Vector:
    """Return how many times faster a trail can be followed than it was made.

    Robots creep up to what is in their way, and need not creep back. Velocities keep
    their directions. Paces s are as great as speeds and accelerations allow,

        |s_k v_k| <= speed,  |s_{k+1} v_{k+1} - s_k v_k| (s_k + s_{k+1}) / 2 <= rate dt,

    going forwards and then backwards over the trail; none is below 1, for what the
    robot did before it can do again. The first is 1.

    Args:
        v: Velocities at the places, shape (n, nv).
        steps: Times between them as they were made, s, shape (n - 1,).
        speed: Greatest speeds, shape (nv,).
        rate: Accelerations, shape (nv,).

    Source: Bobrow, Dubowsky and Gibson (1985), "Time-Optimal Control of Robotic
    Manipulators Along Specified Paths", IJRR 4(3); here on a grid of places.
    """
    paces: Vector = np.ones(len(v))
    _pace(v, steps, speed, rate, paces)
    return paces


@compiled
def _pace(v: Matrix, steps: Vector, speed: Vector, rate: Vector, out: Vector) -> None:
    count = v.shape[0]
    for k in range(1, count):
        most = MOST
        for i in range(v.shape[1]):
            if abs(v[k, i]) * most > speed[i]:
                most = speed[i] / abs(v[k, i])
        out[k] = _greatest(v[k - 1], v[k], out[k - 1], most, steps[k - 1], rate)
    for k in range(count - 2, 0, -1):
        out[k] = _greatest(v[k + 1], v[k], out[k + 1], out[k], steps[k], rate)


@compiled
def _greatest(
    v0: Vector, v1: Vector, pace: float, most: float, step: float, rate: Vector
) -> float:
    """Return the greatest pace at v1, from 1 to `most`, next to a pace at v0."""
    ratio = max(most, 1.0) ** (1.0 / RATIOS)
    tried = max(most, 1.0)
    for _ in range(RATIOS):
        able = True
        for i in range(v0.shape[0]):
            change = abs(tried * v1[i] - pace * v0[i]) * 0.5 * (tried + pace)
            able = able and change <= rate[i] * step
        if able:
            return tried
        tried /= ratio
    return 1.0
