"""Compiled search for the nearest pairs of capsules, and their distance's Jacobian."""

from typing import NamedTuple

import numpy as np

from wbc_suite.compiling import compiled, struct
from wbc_suite.kinematics.forward import RobotArrays
from wbc_suite.typing import Array, Indices, Matrix, Vector

SKIN = 0.1
"""m; a list holds pairs within the influence and this distance, and is made again when
a capsule has moved by half of it: the neighbour lists of Verlet (1967)."""

_POINT = 1e-12  # m^2; a shorter segment is a point
_PARALLEL = 1e-12  # squared sine of the angle between parallel segments
_TOUCHING = 1e-9  # m; nearer segments have no direction between them


@struct
class CapsuleArrays(NamedTuple):
    """n capsules of which p pairs are kept apart by k rows.

    Attributes:
        joint: Joint of each capsule, shape (n,).
        ends: Both ends of its segment in the joint, m, shape (n, 6).
        radius: Radii, m, shape (n,).
        pairs: Capsules of each pair, one after another, shape (2 p,).
        moves: 1 where a velocity moves a joint, else 0, shape (njoints, nv).
        influence: Pairs further apart are left out, m.
        world: Scratch, ends in the world, shape (n, 2, 3).
        middle: Scratch, middles of the segments, shape (n, 3).
        reach: Scratch, radii of balls around the capsules, m, shape (n,).
        listed: Pairs near enough to be measured, shape (p,).
        listed_count: How many they are, shape (1,); -1 before the first search.
        listed_middle: Where the middles were when the list was made, shape (n, 3).
        found: Output, pair of each row, nearest first, -1 where there is none, (k,).
        distance: Output, distance of each row's pair, m; inf where there is none, (k,).
    """

    joint: Indices
    ends: Matrix
    radius: Vector
    pairs: Indices
    moves: Matrix
    influence: float
    world: Array
    middle: Matrix
    reach: Vector
    listed: Indices
    listed_count: Indices
    listed_middle: Matrix
    found: Indices
    distance: Vector


@compiled
def nearest_pairs(robot: RobotArrays, capsules: CapsuleArrays, G: Matrix) -> int:
    """Find the nearest pairs and write the negative derivative of their distance.

    Args:
        robot: The robot; joint poses are current.
        capsules: The capsules.
        G: Output, `-d(distance)/dq` of each row, shape (k, nv); 0 where there is none.

    Returns:
        The number of rows with a pair within the influence.
    """
    _place_capsules(robot, capsules)
    _update_list(capsules)
    found, distance, world = capsules.found, capsules.distance, capsules.world
    rows, total = found.shape[0], 0
    for row in range(rows):
        found[row], distance[row] = -1, np.inf
    for k in range(capsules.listed_count[0]):
        pair = capsules.listed[k]
        a, b = capsules.pairs[2 * pair], capsules.pairs[2 * pair + 1]
        limit = min(capsules.influence, distance[rows - 1])
        far = capsules.reach[a] + capsules.reach[b] + limit
        if _square_distance(capsules.middle[a], capsules.middle[b]) > far * far:
            continue
        s, t = segment_parameters(world[a, 0], world[a, 1], world[b, 0], world[b, 1])
        square = 0.0
        for i in range(3):
            x = world[a, 0, i] + s * (world[a, 1, i] - world[a, 0, i])
            x -= world[b, 0, i] + t * (world[b, 1, i] - world[b, 0, i])
            square += x * x
        d = np.sqrt(square) - capsules.radius[a] - capsules.radius[b]
        if d < limit:
            row = min(total, rows - 1)
            while row > 0 and distance[row - 1] > d:
                distance[row], found[row] = distance[row - 1], found[row - 1]
                row -= 1
            distance[row], found[row] = d, pair
            total = min(total + 1, rows)
    for row in range(rows):
        _write_row(robot, capsules, row, G[row])
    return total


@compiled
def _place_capsules(robot: RobotArrays, capsules: CapsuleArrays) -> None:
    """Write ends, middles and bounding balls in the world."""
    for c in range(capsules.joint.shape[0]):
        T, square = robot.pose[capsules.joint[c]], 0.0
        world, middle = capsules.world[c], capsules.middle[c]
        for i in range(3):
            for end in range(2):
                x = capsules.ends[c, 3 * end : 3 * end + 3]
                world[end, i] = T[9 + i]
                world[end, i] += T[i] * x[0] + T[3 + i] * x[1] + T[6 + i] * x[2]
            middle[i] = 0.5 * (world[0, i] + world[1, i])
            square += (world[0, i] - world[1, i]) ** 2
        capsules.reach[c] = capsules.radius[c] + 0.5 * np.sqrt(square)


@compiled
def _update_list(capsules: CapsuleArrays) -> None:
    """List the pairs that may be within the influence, if capsules have moved."""
    middle, known = capsules.middle, capsules.listed_middle
    is_current = capsules.listed_count[0] >= 0
    for c in range(middle.shape[0]):
        moved = _square_distance(middle[c], known[c])
        is_current = is_current and moved < (0.49 * SKIN) ** 2
    if is_current:
        return
    for c in range(middle.shape[0]):
        for i in range(3):
            known[c, i] = middle[c, i]
    count = 0
    for pair in range(capsules.listed.shape[0]):
        a, b = capsules.pairs[2 * pair], capsules.pairs[2 * pair + 1]
        far = capsules.reach[a] + capsules.reach[b] + capsules.influence + SKIN
        if not _square_distance(middle[a], middle[b]) > far * far:
            capsules.listed[count] = pair
            count += 1
    capsules.listed_count[0] = count


@compiled
def _square_distance(a: Vector, b: Vector) -> float:
    """Return the squared distance of two points."""
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2


@compiled
def _write_row(
    robot: RobotArrays, capsules: CapsuleArrays, row: int, out: Vector
) -> None:
    """Write `-n . (J_a - J_b)` at the nearest points of a row's pair.

    Velocities that move both bodies turn them together and leave the distance as it
    is, so only those that move one of them count.
    """
    pair = capsules.found[row]
    if pair < 0:
        for col in range(out.shape[0]):
            out[col] = 0.0
        return
    a, b = capsules.pairs[2 * pair], capsules.pairs[2 * pair + 1]
    A, B = capsules.world[a], capsules.world[b]
    s, t = segment_parameters(A[0], A[1], B[0], B[1])
    x, y, n = np.empty(3), np.empty(3), np.empty(3)
    for i in range(3):
        x[i] = A[0, i] + s * (A[1, i] - A[0, i])
        y[i] = B[0, i] + t * (B[1, i] - B[0, i])
        n[i] = x[i] - y[i]
    norm = np.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2)
    if norm < _TOUCHING:  # segments meet: part along the line of their middles
        for i in range(3):
            n[i] = A[0, i] + A[1, i] - B[0, i] - B[1, i]
        norm = max(np.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2), _TOUCHING)
    for i in range(3):
        n[i] /= norm
    moves_a = capsules.moves[capsules.joint[a]]
    moves_b = capsules.moves[capsules.joint[b]]
    for col in range(out.shape[0]):
        side = moves_a[col] - moves_b[col]
        out[col] = 0.0
        if side != 0.0:
            J, z = robot.jacobian[col], x if side > 0.0 else y
            speed = n[0] * (J[0] + J[4] * z[2] - J[5] * z[1])
            speed += n[1] * (J[1] + J[5] * z[0] - J[3] * z[2])
            speed += n[2] * (J[2] + J[3] * z[1] - J[4] * z[0])
            out[col] = -side * speed


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
    if a < _POINT:
        return 0.0, (min(max(f / e, 0.0), 1.0) if e > _POINT else 0.0)
    if e < _POINT:
        return min(max(-c / a, 0.0), 1.0), 0.0
    denominator = a * e - b * b
    s = 0.0
    if denominator > _PARALLEL * a * e:
        s = min(max((b * f - c * e) / denominator, 0.0), 1.0)
    t = (b * s + f) / e
    if t < 0.0:
        return min(max(-c / a, 0.0), 1.0), 0.0
    if t > 1.0:
        return min(max((b - c) / a, 0.0), 1.0), 1.0
    return s, t
