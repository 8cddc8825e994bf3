"""Compiled search for the nearest pairs of capsules, and their distance's Jacobian."""

from enum import IntEnum

import numpy as np

from wbc_suite.compiling import compiled, compiled_inner, inlined
from wbc_suite.kinematics.array_table import indices, matrix, vector
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["CapsuleField", "nearest_pairs", "segment_parameters"]

SKIN = 0.1
"""m; pairs farther apart than the influence and this are looked at again when a capsule
has moved by half of it, as molecular dynamics does with its lists (Verlet, 1967)."""


class CapsuleField(IntEnum):
    """Arrays of capsules that are kept apart.

    Joint of each; both ends of each one's segment in its joint, shape (n, 6); radii;
    pairs of capsules, shape (p, 2); 1 where a velocity moves a joint, shape
    (njoints, nv).
    What is kept between ticks: pairs that were near, shape (p,); how many; the
    influence for which they were sought, NaN for none; where middles were then, shape
    (n, 3).
    """

    JOINTS = 0
    ENDS = 1
    RADII = 2
    PAIRS = 3
    MOVES = 4
    NEAR = 5
    NEAR_COUNT = 6
    NEAR_WITHIN = 7
    NEAR_MIDDLES = 8


@compiled
def segment_parameters(
    p0: Vector, p1: Vector, q0: Vector, q1: Vector
) -> tuple[float, float]:
    """Return where two segments are nearest, as parameters s, t in [0, 1].

    The points are `p0 + s (p1 - p0)` and `q0 + t (q1 - q0)`; segments may be points.

    Source: Ericson (2005), "Real-Time Collision Detection", section 5.1.9.
    """
    a = e = b = c = f = 0.0
    for i in range(3):
        u, v, w = p1[i] - p0[i], q1[i] - q0[i], p0[i] - q0[i]
        a += u * u
        e += v * v
        b += u * v
        c += u * w
        f += v * w
    if a < 1e-12:  # the first is a point
        return 0.0, (min(max(f / e, 0.0), 1.0) if e > 1e-12 else 0.0)
    if e < 1e-12:
        return min(max(-c / a, 0.0), 1.0), 0.0
    denominator = a * e - b * b
    s = 0.0
    if denominator > 1e-12 * a * e:
        s = min(max((b * f - c * e) / denominator, 0.0), 1.0)
    t = (b * s + f) / e
    if t < 0.0:
        return min(max(-c / a, 0.0), 1.0), 0.0
    if t > 1.0:
        return min(max((b - c) / a, 0.0), 1.0), 1.0
    return s, t


@compiled
def nearest_pairs(  # noqa: C901, one flat loop is what compiles well
    placements: Matrix,
    joint_jacobians: Matrix,
    capsules: Indices,
    influence: float,
    found: Indices,
    distances: Vector,
    G: Matrix,
) -> int:
    """Find the nearest pairs and write the negative derivative of their distance.

    Args:
        placements: Joint poses, shape (njoints, 12).
        joint_jacobians: Joint Jacobians, transposed, shape (nv, 6).
        capsules: Table of `CapsuleField`.
        influence: Pairs further apart are left out, m.
        found: Output, pair of each row, nearest first, -1 where there is none.
        distances: Output, distance of each row's pair, m; inf where there is none.
        G: Output, `-d(distance)/dq` of each row, shape (k, nv); 0 where there is none.

    Returns:
        The number of pairs within the influence among the rows.
    """
    joints, ends = (
        indices(capsules, CapsuleField.JOINTS),
        matrix(capsules, CapsuleField.ENDS),
    )
    radii, pairs = (
        vector(capsules, CapsuleField.RADII),
        indices(capsules, CapsuleField.PAIRS),
    )
    moves, count = matrix(capsules, CapsuleField.MOVES), joints.shape[0]
    world = np.empty((count, 2, 3))
    middle = np.empty((count, 3))
    reach = np.empty(count)
    for c in range(count):
        T = placements[joints[c]]
        length = 0.0
        for i in range(3):
            for end in range(2):
                x = ends[c, 3 * end : 3 * end + 3]
                world[c, end, i] = (
                    T[9 + i] + T[i] * x[0] + T[3 + i] * x[1] + T[6 + i] * x[2]
                )
            middle[c, i] = 0.5 * (world[c, 0, i] + world[c, 1, i])
            length += (world[c, 0, i] - world[c, 1, i]) ** 2
        reach[c] = radii[c] + 0.5 * np.sqrt(length)
    rows = found.shape[0]
    for row in range(rows):
        found[row], distances[row] = -1, np.inf
    total = 0
    near = indices(capsules, CapsuleField.NEAR)
    for k in range(_look_around(capsules, middle, reach, influence)):
        p = near[k]
        a, b = pairs[2 * p], pairs[2 * p + 1]
        limit = min(influence, distances[rows - 1])
        if _square(middle[a], middle[b]) > (reach[a] + reach[b] + limit) ** 2:
            continue
        s, t = segment_parameters(world[a, 0], world[a, 1], world[b, 0], world[b, 1])
        square = 0.0
        for i in range(3):
            x = world[a, 0, i] + s * (world[a, 1, i] - world[a, 0, i])
            x -= world[b, 0, i] + t * (world[b, 1, i] - world[b, 0, i])
            square += x * x
        distance = np.sqrt(square) - radii[a] - radii[b]
        if distance < limit:
            row = min(total, rows - 1)
            while row > 0 and distances[row - 1] > distance:
                distances[row], found[row] = distances[row - 1], found[row - 1]
                row -= 1
            distances[row], found[row] = distance, p
            total = min(total + 1, rows)
    scratch = np.empty((3, 3))
    for row in range(rows):
        if row < total:
            a, b = pairs[2 * found[row]], pairs[2 * found[row] + 1]
            _distance_row(
                world[a],
                world[b],
                joint_jacobians,
                moves[joints[a]],
                moves[joints[b]],
                scratch,
                G[row],
            )
        else:
            for col in range(G.shape[1]):
                G[row, col] = 0.0
    return total


@compiled_inner
def _look_around(
    capsules: Indices, middle: Matrix, reach: Vector, influence: float
) -> int:
    """Return how many pairs may be within the influence; list them anew if need be.

    Args:
        capsules: Table of `CapsuleField`.
        middle: Of each capsule, shape (n, 3).
        reach: Radii of balls around them, shape (n,).
        influence: Distance, m.
    """
    within = vector(capsules, CapsuleField.NEAR_WITHIN)
    known = matrix(capsules, CapsuleField.NEAR_MIDDLES)
    count = indices(capsules, CapsuleField.NEAR_COUNT)
    same = within[0] == influence
    for c in range(middle.shape[0]):
        same = same and _square(middle[c], known[c]) < (0.49 * SKIN) ** 2
    if same:
        return count[0]
    pairs = indices(capsules, CapsuleField.PAIRS)
    near = indices(capsules, CapsuleField.NEAR)
    count[0], within[0] = 0, influence
    for c in range(middle.shape[0]):
        for i in range(3):
            known[c, i] = middle[c, i]
    for p in range(near.shape[0]):
        a, b = pairs[2 * p], pairs[2 * p + 1]
        far = reach[a] + reach[b] + influence + SKIN
        if not _square(middle[a], middle[b]) > far * far:
            near[count[0]] = p
            count[0] += 1
    return count[0]


@inlined
def _square(a: Vector, b: Vector) -> float:
    """Return the squared distance of two points."""
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2


@compiled_inner
def _distance_row(
    A: Matrix,
    B: Matrix,
    joint_jacobians: Matrix,
    of_a: Vector,
    of_b: Vector,
    scratch: Matrix,
    row: Vector,
) -> None:
    """Write `-n . (J_a - J_b)` at the nearest points of two segments.

    Velocities that move both bodies turn them together and leave the distance as it
    is, so only those that move one of them count. The scratch has shape (3, 3).
    """
    s, t = segment_parameters(A[0], A[1], B[0], B[1])
    x, y, n = scratch[0], scratch[1], scratch[2]
    norm = 0.0
    for i in range(3):
        x[i] = A[0, i] + s * (A[1, i] - A[0, i])
        y[i] = B[0, i] + t * (B[1, i] - B[0, i])
        n[i] = x[i] - y[i]
        norm += n[i] * n[i]
    norm = np.sqrt(norm)
    if norm < 1e-9:  # segments meet: part along the line of their middles
        for i in range(3):
            n[i] = A[0, i] + A[1, i] - B[0, i] - B[1, i]
        norm = max(np.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2), 1e-9)
    for i in range(3):
        n[i] /= norm
    for col in range(row.shape[0]):
        side = of_a[col] - of_b[col]
        if side == 0.0:
            row[col] = 0.0
            continue
        J = joint_jacobians[col]
        z = x if side > 0.0 else y
        speed = n[0] * (J[0] + J[4] * z[2] - J[5] * z[1])
        speed += n[1] * (J[1] + J[5] * z[0] - J[3] * z[2])
        speed += n[2] * (J[2] + J[3] * z[1] - J[4] * z[0])
        row[col] = -side * speed
