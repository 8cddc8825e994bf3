"""What a robot stands on: the box about its soles."""

import numpy as np

from wbc_suite.compiling import compiled, inner
from wbc_suite.locomotion.gait import Gait, Measured, heading_axes
from wbc_suite.typing import Matrix, Vector


@compiled
def keep_in_soles(
    gait: Gait, measured: Measured, point: Vector, foot: int, out: Vector
) -> float:
    """Write the nearest point within the box about a sole, or both with foot -1.

    Returns:
        How far the point is inside, m; negative outside.
    """
    first = 0 if foot < 0 else foot
    last = 1 if foot < 0 else foot
    R = heading_axes(measured.foot_yaw[first])
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for k in range(first, last + 1):
        own = heading_axes(measured.foot_yaw[k])
        for corner in range(4):
            x, y = gait.sole[k, corner % 2], gait.sole[k, 2 + corner // 2]
            _extend_box(
                R, own, measured.foot[k] - measured.foot[first], x, y, low, high
            )
    margin, inset = np.inf, gait.settings[0].margin
    for i in range(2):
        out[i] = measured.foot[first, i]
    for i in range(2):
        at = 0.0
        for j in range(2):
            at += R[j, i] * (point[j] - measured.foot[first, j])
        margin = min(margin, at - low[i] - inset, high[i] - inset - at)
        kept = min(max(at, low[i] + inset), high[i] - inset)
        for j in range(2):
            out[j] += R[j, i] * kept
    return margin


@inner
def _extend_box(
    R: Matrix, own: Matrix, place: Vector, x: float, y: float, low: Vector, high: Vector
) -> None:
    """Extend a box in axes R by a point (x, y) of a foot."""
    for i in range(2):
        at = 0.0
        for j in range(2):
            at += R[j, i] * (place[j] + own[j, 0] * x + own[j, 1] * y)
        low[i], high[i] = min(low[i], at), max(high[i], at)
