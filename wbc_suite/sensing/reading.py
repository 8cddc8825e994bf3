"""Readings: which numbers of the simulation an observation consists of.

An observation is a `Reading`, made by one of the functions below; `computed` takes any
other function. All readings of an environment are filled in by one compiled call
(`fill`), so that looking costs a few microseconds a step.

A new kind of reading is a number, a branch in `fill` and a function that makes it.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike

from wbc_suite.compiling import compiled, inlined
from wbc_suite.kinematics.array_table import matrix, vector
from wbc_suite.typing import Indices, Vector

__all__ = [
    "Reading",
    "SeenField",
    "actuator_forces",
    "body_position",
    "body_quat",
    "chosen",
    "computed",
    "computed_apart",
    "constant",
    "fill",
    "joint_cosines",
    "joint_positions",
    "joint_sines",
    "joint_velocities",
    "offset",
    "seen_position",
    "seen_quat",
    "sensor_values",
    "site_position",
    "site_quat",
    "user_values",
]

POSITION, COSINE, SINE, VELOCITY = 0, 1, 2, 3
BODY_POSITION, BODY_QUAT, SITE_POSITION, SITE_QUAT = 4, 5, 6, 7
LESS_BODY_POSITION, LESS_SITE_POSITION = 8, 9
SENSOR, LESS_SENSOR, ACTUATOR_FORCE = 10, 11, 12
USER, CONSTANT, TURNED_POSITION, TURNED_QUAT = 13, 14, 15, 16
BOUNDED = 17  # what is there already, within plus and minus the index

LARGEST = 1e4
"""Bound of sensors and forces, SI units: a blow may exceed it, an observation not."""

_NEGATED = {BODY_POSITION: LESS_BODY_POSITION, SITE_POSITION: LESS_SITE_POSITION}


@dataclass(frozen=True, kw_only=True, slots=True)
class Reading:
    """Some numbers of the simulation.

    Attributes:
        size: How many.
        rows: What `fill` does for them: (kind, index in MuJoCo's array, place among
            these numbers).
        function: What else computes them, from the simulation as it stands.
        part: Which of the function's numbers it is, where it is one of them.
        choose: Returns the rows in their place, where each episode has its own.
    """

    size: int
    rows: tuple[tuple[int, int, int], ...] = ()
    function: Callable[[], ArrayLike] | None = None
    part: int | None = None
    choose: Callable[[], tuple[tuple[int, int, int], ...]] | None = None


def joint_positions(addresses: Iterable[int]) -> Reading:
    """Read entries of qpos, rad or m."""
    return _each(POSITION, addresses)


def joint_cosines(addresses: Iterable[int]) -> Reading:
    """Read cosines of entries of qpos."""
    return _each(COSINE, addresses)


def joint_sines(addresses: Iterable[int]) -> Reading:
    """Read sines of entries of qpos."""
    return _each(SINE, addresses)


def joint_velocities(addresses: Iterable[int]) -> Reading:
    """Read entries of qvel, rad/s or m/s."""
    return _each(VELOCITY, addresses)


def sensor_values(addresses: Iterable[int], *, negated: bool = False) -> Reading:
    """Read entries of sensordata, of MuJoCo's last step, or their negatives."""
    return _each(LESS_SENSOR if negated else SENSOR, addresses)


def actuator_forces(addresses: Iterable[int]) -> Reading:
    """Read what actuators exert along degrees of freedom, N m or N."""
    return _each(ACTUATOR_FORCE, addresses)


def body_position(body: int) -> Reading:
    """Read where a body is in the world, m."""
    return Reading(size=3, rows=((BODY_POSITION, body, 0),))


def body_quat(body: int) -> Reading:
    """Read a body's orientation in the world, x y z w."""
    return Reading(size=4, rows=((BODY_QUAT, body, 0),))


def site_position(site: int) -> Reading:
    """Read where a site is in the world, m."""
    return Reading(size=3, rows=((SITE_POSITION, site, 0),))


def site_quat(site: int) -> Reading:
    """Read a site's orientation in the world, x y z w, its largest entry positive."""
    return Reading(size=4, rows=((SITE_QUAT, site, 0),))


def offset(to: Reading, start: Reading) -> Reading:
    """Read the way from one position to another in world axes, m."""
    minus = tuple((_NEGATED[kind], index, at) for kind, index, at in start.rows)
    return Reading(size=to.size, rows=to.rows + minus)


def seen_position(body: int, site: int) -> Reading:
    """Read where a body is in the frame of a site, R_ws^T (p_wb - p_ws), m."""
    way = offset(body_position(body), site_position(site))
    return Reading(size=3, rows=(*way.rows, (TURNED_POSITION, site, 0)))


def seen_quat(body: int, site: int) -> Reading:
    """Read a body's orientation in the frame of a site, x y z w.

    Its largest entry is positive.
    """
    return Reading(size=4, rows=((BODY_QUAT, body, 0), (TURNED_QUAT, site, 0)))


def user_values(addresses: Iterable[int]) -> Reading:
    """Read entries of userdata, what a benchmark notes there."""
    return _each(USER, addresses)


def constant(number: int) -> Reading:
    """Read always the same whole number."""
    return _each(CONSTANT, [number])


def chosen(options: Sequence[Reading], number: Callable[[], int]) -> Reading:
    """Read one of several, the same throughout an episode.

    Args:
        options: Equally many numbers each, none of them `computed`.
        number: Says which one; it is asked when an episode starts.
    """
    return Reading(size=options[0].size, choose=lambda: options[number()].rows)


def computed(size: int, function: Callable[[], ArrayLike]) -> Reading:
    """Let a function compute the numbers, shape (size,), after every step."""
    return Reading(size=size, function=function)


def computed_apart(
    count: int, function: Callable[[], Sequence[float]]
) -> tuple[Reading, ...]:
    """Let a function compute several readings of one number each, called once."""
    return tuple(Reading(size=1, function=function, part=k) for k in range(count))


def _each(kind: int, addresses: Iterable[int]) -> Reading:
    rows = tuple((kind, int(index), at) for at, index in enumerate(addresses))
    return Reading(size=len(rows), rows=rows)


class SeenField(IntEnum):
    """Places of MuJoCo's arrays in the table of `fill`."""

    QPOS = 0
    QVEL = 1
    XPOS = 2
    XQUAT = 3
    SITE_XPOS = 4
    SITE_XMAT = 5
    SENSORDATA = 6
    QFRC_ACTUATOR = 7
    USERDATA = 8


@compiled
def fill(rows: Indices, table: Indices, out: Vector) -> None:  # noqa: C901 - a branch for each kind of reading
    """Do what rows say, in their order, each from its place in `out` on.

    It keeps Python's lock: to hand it to another thread and back takes longer.

    Args:
        rows: (kind, index, place), shape (n, 3).
        table: An `ArrayTable` of `SeenField`.
        out: All readings, one after the other.
    """
    qpos, qvel, xpos = vector(table, 0), vector(table, 1), matrix(table, 2)
    xquat, site_xpos, site_xmat = matrix(table, 3), matrix(table, 4), matrix(table, 5)
    sensordata, qfrc_actuator = vector(table, 6), vector(table, 7)
    userdata = vector(table, 8)
    for row in range(rows.shape[0]):
        kind, i, at = rows[row, 0], rows[row, 1], rows[row, 2]
        if kind == POSITION:
            out[at] = qpos[i]
        elif kind == COSINE:
            out[at] = np.cos(qpos[i])
        elif kind == SINE:
            out[at] = np.sin(qpos[i])
        elif kind == VELOCITY:
            out[at] = qvel[i]
        elif kind == BODY_POSITION:
            _add(out, at, xpos[i], 1.0)
        elif kind == LESS_BODY_POSITION:
            _add(out, at, xpos[i], -1.0)
        elif kind == SITE_POSITION:
            _add(out, at, site_xpos[i], 1.0)
        elif kind == LESS_SITE_POSITION:
            _add(out, at, site_xpos[i], -1.0)
        elif kind == BODY_QUAT:
            for k in range(4):
                out[at + k] = min(max(xquat[i, (k + 1) % 4], -1.0), 1.0)
        elif kind == SITE_QUAT:
            _quat_xyzw(site_xmat[i], out[at : at + 4])
        elif kind == SENSOR:
            out[at] = min(max(sensordata[i], -LARGEST), LARGEST)
        elif kind == LESS_SENSOR:
            out[at] = min(max(-sensordata[i], -LARGEST), LARGEST)
        elif kind == ACTUATOR_FORCE:
            out[at] = min(max(qfrc_actuator[i], -LARGEST), LARGEST)
        elif kind == USER:
            out[at] = min(max(userdata[i], -LARGEST), LARGEST)
        elif kind == CONSTANT:
            out[at] = i
        elif kind == TURNED_POSITION:
            _turn_back(site_xmat[i], out[at : at + 3])
        elif kind == TURNED_QUAT:
            _turn_quat_back(site_xmat[i], out[at : at + 4])
        elif kind == BOUNDED:
            out[at] = min(max(out[at], -float(i)), float(i))


@inlined
def _add(out: Vector, at: int, position: Vector, sign: float) -> None:
    """Write a position where sign is 1, take it off what is there where it is -1."""
    for k in range(3):
        before = 0.0 if sign > 0.0 else out[at + k]
        out[at + k] = before + sign * position[k]


@inlined
def _quat_xyzw(R: Vector, out: Vector) -> None:
    """Write the quaternion of a rotation, (9,) row by row, into `out`, x y z w.

    The entry that is largest comes from the diagonal, `4 q_k^2 = 1 + R_kk - ...`, and
    the others from sums and differences across it, each `4 q_k q_j`.

    Source: Shepperd (1978), "Quaternion from rotation matrix", J. Guidance Control 1.
    """
    xx, yy, zz = R[0], R[4], R[8]
    if xx + yy + zz > 0.0:
        out[3] = 1.0 + xx + yy + zz
        out[0], out[1], out[2] = R[7] - R[5], R[2] - R[6], R[3] - R[1]
    elif xx > yy and xx > zz:
        out[0] = 1.0 + xx - yy - zz
        out[3], out[1], out[2] = R[7] - R[5], R[1] + R[3], R[2] + R[6]
    elif yy > zz:
        out[1] = 1.0 - xx + yy - zz
        out[3], out[0], out[2] = R[2] - R[6], R[1] + R[3], R[5] + R[7]
    else:
        out[2] = 1.0 - xx - yy + zz
        out[3], out[0], out[1] = R[3] - R[1], R[2] + R[6], R[5] + R[7]
    length = np.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2 + out[3] ** 2)
    for k in range(4):  # rounding may take it to 1 + 2e-16
        out[k] = min(max(out[k] / length, -1.0), 1.0)


@inlined
def _turn_back(R: Vector, way: Vector) -> None:
    """Put R^T way in the place of `way`, (3,); R is (9,) row by row."""
    x, y, z = way[0], way[1], way[2]
    for k in range(3):
        way[k] = R[k] * x + R[3 + k] * y + R[6 + k] * z


@inlined
def _turn_quat_back(R: Vector, quat: Vector) -> None:
    """Put the quaternion of R^T R(quat) in the place of `quat`, x y z w.

    With p that of R, it is conj(p) quat; the largest entry becomes positive.
    """
    x, y, z, w = quat[0], quat[1], quat[2], quat[3]
    p = np.empty(4)
    _quat_xyzw(R, p)
    quat[0] = p[3] * x - p[0] * w - p[1] * z + p[2] * y
    quat[1] = p[3] * y - p[1] * w - p[2] * x + p[0] * z
    quat[2] = p[3] * z - p[2] * w - p[0] * y + p[1] * x
    quat[3] = p[3] * w + p[0] * x + p[1] * y + p[2] * z
    largest = 0
    for k in range(1, 4):
        if abs(quat[k]) > abs(quat[largest]):
            largest = k
    sign = 1.0 if quat[largest] > 0.0 else -1.0
    for k in range(4):  # rounding may take it to 1 + 4e-16
        quat[k] = min(max(sign * quat[k], -1.0), 1.0)
