"""Compiled search for the nearest pairs of capsules, and rows that keep them apart."""

import numpy as np

from wbc_suite.compiling import inner, record_type
from wbc_suite.kinematics.forward import RobotArrays
from wbc_suite.linear_algebra import copy_vector
from wbc_suite.qp.part import place_point
from wbc_suite.qp.problem import UNBOUNDED
from wbc_suite.typing import CompiledRecords, Indices, Matrix, Vector

SKIN = 0.1
"""m; a list holds pairs within the influence and this distance, and is made again when
a capsule has moved by half of it: the neighbour lists of Verlet (1967)."""

SEPARATION = 0.2  # m/s, greatest speed of separation of what is too near
_POINT = 1e-12  # m^2; a shorter segment is a point
_PARALLEL = 1e-12  # squared sine of the angle between parallel segments
_TOUCHING = 1e-9  # m; nearer segments have no direction between them


SETTINGS = record_type(
    ("capsules", "i8"),  # n
    ("pairs", "i8"),  # p
    ("margin", "f8"),  # distance that is kept
    ("influence", "f8"),  # pairs further apart are left out
    ("rate", "f8"),  # approach speed per distance left, 1/s
    ("listed", "i8"),  # number of listed pairs; -1 before the first search
)
"""Of a self-collision limit, in m."""

CAPSULE = record_type(
    ("joint", "i8"),
    ("ends", "f8", (2, 3)),  # of its segment, in the joint
    ("radius", "f8"),
    ("world", "f8", (2, 3)),  # scratch: ends in the world
    ("middle", "f8", (3,)),  # scratch: middle of the segment
    ("reach", "f8"),  # scratch: radius of a ball around it
    ("listed_middle", "f8", (3,)),  # where the middle was when the list was made
)
"""A capsule on a link, in m."""

PAIR = record_type(
    ("first", "i8"),  # its capsules
    ("second", "i8"),
    ("listed", "i8"),  # list of the pairs that are near enough to be measured
)

ROW = record_type(
    ("found", "i8"),  # output: pair of the row, nearest first, -1 for none
    ("distance", "f8"),  # output: its distance, m, inf for none
)

_SETTINGS, _CAPSULE, _PAIR = (x.itemsize // 8 for x in (SETTINGS, CAPSULE, PAIR))


@inner
def self_collision_rows(
    robot: RobotArrays, own: Vector, dt: float, rows: Matrix, values: Vector
) -> None:
    """Write the velocity dampers of the nearest pairs.

    Own are `SETTINGS`, n `CAPSULE`, p `PAIR` and k `ROW` records. Rows get
    `-d(distance)/dq`, 0 where there is none; values get how far each pair may approach
    in dt seconds, m.
    """
    settings = own[:_SETTINGS].view(SETTINGS)[0]
    end = _SETTINGS + _CAPSULE * settings.capsules
    capsules = own[_SETTINGS:end].view(CAPSULE)
    last = end + _PAIR * settings.pairs
    pairs, places = own[end:last].view(PAIR), own[last:].view(ROW)
    _place_capsules(robot, capsules)
    _update_list(settings, capsules, pairs)
    _find_nearest(settings, capsules, pairs, places)
    for row in range(values.shape[0]):
        _write_row(robot, capsules, pairs, places[row].found, rows[row])
        speed = settings.rate * (places[row].distance - settings.margin)
        values[row] = min(max(speed, -SEPARATION) * dt, UNBOUNDED)


@inner
def _find_nearest(
    settings: CompiledRecords,
    capsules: CompiledRecords,
    pairs: CompiledRecords,
    places: CompiledRecords,
) -> None:
    """Find the nearest pairs within the influence, and their distances."""
    found, distance = places["found"], places["distance"]
    count, total = found.shape[0], 0
    for k in range(count):
        found[k], distance[k] = -1, np.inf
    for k in range(settings.listed):
        pair = pairs[k].listed
        a, b = capsules[pairs[pair].first], capsules[pairs[pair].second]
        limit = min(settings.influence, distance[count - 1])
        far = a.reach + b.reach + limit
        if _square_distance(a.middle, b.middle) > far * far:
            continue
        A, B = a.world, b.world
        s, t = segment_parameters(A[0], A[1], B[0], B[1])
        square = 0.0
        for i in range(3):
            x = A[0, i] + s * (A[1, i] - A[0, i])
            x -= B[0, i] + t * (B[1, i] - B[0, i])
            square += x * x
        d = np.sqrt(square) - a.radius - b.radius
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
def _place_capsules(robot: RobotArrays, capsules: CompiledRecords) -> None:
    """Write ends, middles and bounding balls in the world."""
    poses = robot.pose
    for c in range(capsules.shape[0]):
        capsule, square = capsules[c], 0.0
        T, ends, world = poses[capsule.joint], capsule.ends, capsule.world
        for end in range(2):
            place_point(T, ends[end], world[end])
        for i in range(3):
            capsule.middle[i] = 0.5 * (world[0, i] + world[1, i])
            square += (world[0, i] - world[1, i]) ** 2
        capsule.reach = capsule.radius + 0.5 * np.sqrt(square)


@inner
def _update_list(
    settings: CompiledRecords, capsules: CompiledRecords, pairs: CompiledRecords
) -> None:
    """List the pairs that may be within the influence, if capsules have moved."""
    is_current = settings.listed >= 0
    for c in range(capsules.shape[0]):
        capsule = capsules[c]
        moved = _square_distance(capsule.middle, capsule.listed_middle)
        is_current = is_current and moved < (0.49 * SKIN) ** 2
    if is_current:
        return
    for c in range(capsules.shape[0]):
        copy_vector(capsules[c].middle, capsules[c].listed_middle)
    count = 0
    for pair in range(pairs.shape[0]):
        a, b = capsules[pairs[pair].first], capsules[pairs[pair].second]
        far = a.reach + b.reach + settings.influence + SKIN
        if not _square_distance(a.middle, b.middle) > far * far:
            pairs[count].listed = pair
            count += 1
    settings.listed = count


@inner
def _square_distance(a: Vector, b: Vector) -> float:
    """Return the squared distance of two points."""
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2


@inner
def _write_row(
    robot: RobotArrays,
    capsules: CompiledRecords,
    pairs: CompiledRecords,
    pair: int,
    out: Vector,
) -> None:
    """Write `-n . (J_a - J_b)` at the nearest points of a pair; 0 for the pair -1.

    Velocities that move both bodies turn them together and leave the distance as it
    is, so only those that move one of them count.
    """
    for col in range(out.shape[0]):
        out[col] = 0.0
    if pair < 0:
        return
    a, b = capsules[pairs[pair].first], capsules[pairs[pair].second]
    A, B = a.world, b.world
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
    joints, first, second = robot.joints, a.joint, b.joint
    while first != second:  # up to the joint that moves both
        if first > second:  # parents have smaller numbers
            write_approach(robot, first, x, n, -1.0, out)
            first = joints[first].parent
        else:
            write_approach(robot, second, y, n, 1.0, out)
            second = joints[second].parent


@inner
def write_approach(
    robot: RobotArrays, joint: int, x: Vector, n: Vector, sign: float, out: Vector
) -> None:
    """Write the speed of a point x along n, times a sign, per unit of a joint's v."""
    columns, own = robot.jacobian, robot.joints[joint]
    for col in range(own.v_start, own.v_start + own.v_count):
        out[col] = sign * speed_along(columns[col], n, x[0], x[1], x[2])


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


@inner
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
