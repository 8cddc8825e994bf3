"""Compiled search for the nearest pairs of capsules, and rows that keep them apart."""

from typing import NamedTuple

import numpy as np

from wbc_suite.compiling import compiled, compiled_inline, inner, struct
from wbc_suite.kinematics.forward import RobotArrays
from wbc_suite.linear_algebra import copy_rows
from wbc_suite.qp.problem import UNBOUNDED
from wbc_suite.typing import Array, Indices, Matrix, Vector

SKIN = 0.1
"""m; a list holds pairs within the influence and this distance, and is made again when
a capsule has moved by half of it: the neighbour lists of Verlet (1967)."""

SEPARATION = 0.2  # m/s, greatest speed of separation of what is too near
_POINT = 1e-12  # m^2; a shorter segment is a point
_PARALLEL = 1e-12  # squared sine of the angle between parallel segments
_TOUCHING = 1e-9  # m; nearer segments have no direction between them


@struct
class CapsuleArrays(NamedTuple):
    """n capsules of which p pairs are kept apart by k rows, in m."""

    joint: Indices  # (n,), joint of each capsule
    ends: Matrix  # (n, 6), both ends of its segment in the joint
    radius: Vector  # (n,)
    pairs: Indices  # (2 p,), capsules of each pair, one after another
    moves: Matrix  # (njoints, nv), 1 where a velocity moves a joint, else 0
    margin: float  # distance that is kept
    influence: float  # pairs further apart are left out
    rate: float  # approach speed per distance left, 1/s
    world: Array  # (n, 2, 3), scratch: ends in the world
    middle: Matrix  # (n, 3), scratch: middles of the segments
    reach: Vector  # (n,), scratch: radii of balls around the capsules
    listed: Indices  # (p,), pairs near enough to be measured
    listed_count: Indices  # (1,), how many they are; -1 before the first search
    listed_middle: Matrix  # (n, 3), where the middles were when the list was made
    found: Indices  # (k,), output: pair of each row, nearest first, -1 for none
    distance: Vector  # (k,), output: distance of each row's pair, inf for none


@inner
def self_collision_rows(
    robot: RobotArrays, capsules: CapsuleArrays, dt: float, G: Matrix, h: Vector
) -> None:
    """Write the velocity dampers of the nearest pairs; joint poses are current.

    G, shape (k, nv), gets `-d(distance)/dq` of each row, 0 where there is none; h gets
    how far each pair may approach in dt seconds, m.
    """
    _find_nearest(robot, capsules)
    for row in range(h.shape[0]):
        _write_row(robot, capsules, row, G[row])
        speed = capsules.rate * (capsules.distance[row] - capsules.margin)
        h[row] = min(max(speed, -SEPARATION) * dt, UNBOUNDED)


@compiled_inline
def _find_nearest(robot: RobotArrays, capsules: CapsuleArrays) -> None:
    """Find the nearest pairs within the influence, and their distances."""
    _place_capsules(robot, capsules)
    _update_list(capsules)
    found, distance, world = capsules.found, capsules.distance, capsules.world
    found[:], distance[:] = -1, np.inf
    rows, total = found.shape[0], 0
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
            insert_nearest(found, distance, total, pair, float(d))
            total += 1


@inner
def insert_nearest(
    found: Indices, distance: Vector, count: int, item: int, d: float
) -> None:
    """Insert an item, nearest first; where all rows are taken, the last drops out."""
    row = min(count, found.shape[0] - 1)
    while row > 0 and distance[row - 1] > d:
        distance[row], found[row] = distance[row - 1], found[row - 1]
        row -= 1
    distance[row], found[row] = d, item


@inner
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


@inner
def _update_list(capsules: CapsuleArrays) -> None:
    """List the pairs that may be within the influence, if capsules have moved."""
    middle, known = capsules.middle, capsules.listed_middle
    is_current = capsules.listed_count[0] >= 0
    for c in range(middle.shape[0]):
        moved = _square_distance(middle[c], known[c])
        is_current = is_current and moved < (0.49 * SKIN) ** 2
    if is_current:
        return
    copy_rows(middle, known)
    count = 0
    for pair in range(capsules.listed.shape[0]):
        a, b = capsules.pairs[2 * pair], capsules.pairs[2 * pair + 1]
        far = capsules.reach[a] + capsules.reach[b] + capsules.influence + SKIN
        if not _square_distance(middle[a], middle[b]) > far * far:
            capsules.listed[count] = pair
            count += 1
    capsules.listed_count[0] = count


@inner
def _square_distance(a: Vector, b: Vector) -> float:
    """Return the squared distance of two points."""
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2


@inner
def _write_row(
    robot: RobotArrays, capsules: CapsuleArrays, row: int, out: Vector
) -> None:
    """Write `-n . (J_a - J_b)` at the nearest points of a row's pair.

    Velocities that move both bodies turn them together and leave the distance as it
    is, so only those that move one of them count.
    """
    pair = capsules.found[row]
    out[:] = 0.0
    if pair < 0:
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
        if side != 0.0:
            z = x if side > 0.0 else y
            speed = speed_along(robot.jacobian[col], n, z[0], z[1], z[2])
            out[col] = -side * speed


@inner
def speed_along(J: Vector, n: Vector, x: float, y: float, z: float) -> float:
    """Return the speed of a point along n per unit of a column of the Jacobian."""
    speed = n[0] * (J[0] + J[4] * z - J[5] * y)
    speed += n[1] * (J[1] + J[5] * x - J[3] * z)
    speed += n[2] * (J[2] + J[3] * y - J[4] * x)
    return speed


@inner
def greatest_approach(left: float, rate: float, braking: float, dt: float) -> float:
    """Return how far a point may come nearer in dt seconds with so much left, m.

    The speed falls to zero at `rate` or by `braking`, whichever is slower; what is too
    near has to move away.
    """
    braked = np.sqrt(2.0 * braking * max(left, 0.0))
    speed = min(rate * left, braked)
    return min(max(speed, -SEPARATION) * dt, UNBOUNDED)


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
