"""Which bodies may touch in the next steps: the others need not be looked at.

MuJoCo bounds every body anew in each step, sorts the bounds, and finds that most have
nothing near them. As molecular dynamics does with its lists of neighbours (Verlet,
1967), bodies without anything nearer than `SKIN` are hidden from it until something
could have moved so far; then all are looked at again. Two geoms come nearer to each
other by no more than the sum, over all degrees of freedom, of the way times the longest
lever. So no contact is missed, and the same ones are found in the same order.
"""

import math

import mujoco
import numpy as np

from wbc_suite.compiling import compiled, inlined
from wbc_suite.control.loop.haste import Haste
from wbc_suite.kinematics.array_table import indices, matrix, short_indices, vector
from wbc_suite.typing import Indices, Matrix

__all__ = ["SKIN", "hide_far_bodies", "way"]

SKIN = 0.05
"""m; what moves slowly takes many actions of 20 Hz for it, a fast arm a few steps."""

FEW, PAUSE = 2, 100
"""Where less than a third of all geoms can be hidden, to look takes longer than it
saves: it is done once in so many actions."""

_PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)
_FREE = int(mujoco.mjtJoint.mjJNT_FREE)
_HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)
_SLIDE = int(mujoco.mjtJoint.mjJNT_SLIDE)


@compiled
def hide_far_bodies(table: Indices) -> None:
    """Hide bodies, and geoms at either end of others', that have nothing near them.

    Poses of geoms are those of the present positions: what `mj_step1` leaves.
    """
    kind = short_indices(table, Haste.BODY_CONTYPE)
    affinity = short_indices(table, Haste.BODY_CONAFFINITY)
    first = short_indices(table, Haste.BODY_GEOMADR)
    count = short_indices(table, Haste.BODY_GEOMNUM)
    near = short_indices(table, Haste.NEAR)
    find_near(table)
    measure_levers(table)
    hidden, shown = 0, 0
    for body in range(kind.shape[0]):
        if kind[body] == 0 and affinity[body] == 0:
            continue
        geom, end = first[body], first[body] + count[body]
        while geom < end and not near[geom]:
            geom += 1
        while geom < end and not near[end - 1]:
            end -= 1
        hidden, shown = hidden + count[body] - (end - geom), shown + (end - geom)
        if geom < end:
            first[body], count[body] = geom, end - geom
        else:
            kind[body] = affinity[body] = 0
    if FEW * hidden < shown:
        indices(table, Haste.PAUSE)[0] = PAUSE


@compiled
def find_near(table: Indices) -> None:
    """Note which geoms may have something nearer to them than `SKIN`."""
    kind = short_indices(table, Haste.BODY_CONTYPE)
    affinity = short_indices(table, Haste.BODY_CONAFFINITY)
    low, high = matrix(table, Haste.LOW), matrix(table, Haste.HIGH)
    near = short_indices(table, Haste.NEAR)
    for geom in range(near.shape[0]):
        near[geom] = 0
    for body in range(kind.shape[0]):
        if kind[body] != 0 or affinity[body] != 0:
            enclose(table, body, low, high)
    pairs = indices(table, Haste.PAIRS)
    for k in range(0, pairs.shape[0], 2):
        a, b = pairs[k], pairs[k + 1]
        meet = kind[a] & affinity[b] != 0 or kind[b] & affinity[a] != 0
        if meet and not are_apart(low, high, a, b):
            note_near(table, a, b)


@inlined
def are_apart(low: Matrix, high: Matrix, a: int, b: int) -> bool:
    """Tell whether two boxes are further than `SKIN` from each other along an axis."""
    for i in range(3):
        if low[a, i] > high[b, i] + SKIN or low[b, i] > high[a, i] + SKIN:
            return True
    return False


@inlined
def enclose(table: Indices, body: int, low: Matrix, high: Matrix) -> None:
    """Write the corners of a box around a body's geoms."""
    first = short_indices(table, Haste.BODY_GEOMADR)[body]
    count = short_indices(table, Haste.BODY_GEOMNUM)[body]
    xpos = matrix(table, Haste.GEOM_XPOS)
    for i in range(3):
        low[body, i], high[body, i] = np.inf, -np.inf
    kind = short_indices(table, Haste.GEOM_CONTYPE)
    affinity = short_indices(table, Haste.GEOM_CONAFFINITY)
    for geom in range(first, first + count):
        if kind[geom] == 0 and affinity[geom] == 0:
            continue
        radius = radius_of(table, geom)
        for i in range(3):
            low[body, i] = min(low[body, i], xpos[geom, i] - radius)
            high[body, i] = max(high[body, i], xpos[geom, i] + radius)


@inlined
def radius_of(table: Indices, geom: int) -> float:
    """Return the radius of a ball around a geom and its margin; planes have none."""
    radius = vector(table, Haste.GEOM_RBOUND)[geom]
    return radius + margin_of(table, geom) if radius > 0.0 else np.inf


@inlined
def margin_of(table: Indices, geom: int) -> float:
    """Return how far from a geom contacts are found."""
    return vector(table, Haste.GEOM_MARGIN)[geom] + vector(table, Haste.GEOM_GAP)[geom]


@compiled
def note_near(table: Indices, a: int, b: int) -> None:
    """Note which geoms of two bodies may be nearer than `SKIN` to each other."""
    first = short_indices(table, Haste.BODY_GEOMADR)
    count = short_indices(table, Haste.BODY_GEOMNUM)
    kind = short_indices(table, Haste.GEOM_CONTYPE)
    affinity = short_indices(table, Haste.GEOM_CONAFFINITY)
    weld = short_indices(table, Haste.BODY_WELDID)
    near = short_indices(table, Haste.NEAR)
    for g in range(first[a], first[a] + count[a]):
        for h in range(first[b], first[b] + count[b]):
            known = near[g] and near[h]
            if known or (kind[g] & affinity[h] == 0 and kind[h] & affinity[g] == 0):
                continue
            distance = max(
                between_balls(table, g, h),
                from_fixed(table, g, h) if weld[a] == 0 else -np.inf,
                from_fixed(table, h, g) if weld[b] == 0 else -np.inf,
            )
            if distance < SKIN:
                near[g] = near[h] = 1


@compiled
def between_balls(table: Indices, g: int, h: int) -> float:
    """Return the distance of the balls around two geoms, -inf of planes, m."""
    xpos = matrix(table, Haste.GEOM_XPOS)
    squares = 0.0
    for i in range(3):
        squares += (xpos[g, i] - xpos[h, i]) ** 2
    return math.sqrt(squares) - radius_of(table, g) - radius_of(table, h)


@compiled
def from_fixed(table: Indices, g: int, h: int) -> float:
    """Return how far the ball around geom h is from the box, or plane, of a fixed g."""
    xpos, xmat = matrix(table, Haste.GEOM_XPOS), matrix(table, Haste.GEOM_XMAT)
    aabb = matrix(table, Haste.GEOM_AABB)
    is_plane = short_indices(table, Haste.GEOM_TYPE)[g] == _PLANE
    squares, along = 0.0, 0.0
    for i in range(3):
        along = 0.0
        for j in range(3):
            along += xmat[g, 3 * j + i] * (xpos[h, j] - xpos[g, j])
        outside = max(abs(along - aabb[g, i]) - aabb[g, 3 + i], 0.0)
        squares += outside * outside
    distance = along if is_plane else math.sqrt(squares)  # z is a plane's normal
    return distance - margin_of(table, g) - radius_of(table, h)


@compiled
def measure_levers(table: Indices) -> None:
    """Write how far a unit of each degree of freedom moves the middle of any geom.

    The way from a joint to what hangs on it is at most the sum of the ways between the
    bodies' origins, whatever the angles; slides may go on by `SKIN`.
    """
    parent = short_indices(table, Haste.BODY_PARENTID)
    first = short_indices(table, Haste.BODY_GEOMADR)
    count = short_indices(table, Haste.BODY_GEOMNUM)
    geom_pos, body_pos = matrix(table, Haste.GEOM_POS), matrix(table, Haste.BODY_POS)
    reach = vector(table, Haste.REACH)
    for body in range(reach.shape[0]):
        reach[body] = 0.0
        for geom in range(first[body], first[body] + count[body]):
            reach[body] = max(reach[body], length(geom_pos, geom))
    for body in range(reach.shape[0] - 1, 0, -1):
        further = reach[body] + write_levers(table, body)
        above = parent[body]
        reach[above] = max(reach[above], length(body_pos, body) + further)


@compiled
def write_levers(table: Indices, body: int) -> float:
    """Write the levers of a body's joints; return how far these move its origin."""
    first = short_indices(table, Haste.BODY_JNTADR)[body]
    joints = range(first, first + short_indices(table, Haste.BODY_JNTNUM)[body])
    kinds = short_indices(table, Haste.JNT_TYPE)
    anchors = matrix(table, Haste.JNT_POS)
    further = 0.0
    for joint in joints:
        if kinds[joint] == _SLIDE:
            q = short_indices(table, Haste.JNT_QPOSADR)[joint]
            qpos, qpos0 = vector(table, Haste.QPOS), vector(table, Haste.QPOS0)
            further += abs(float(qpos[q] - qpos0[q])) + SKIN
        elif kinds[joint] != _FREE:
            further += 2.0 * length(anchors, joint)
    levers = vector(table, Haste.LEVERS)
    for joint in joints:
        dof = short_indices(table, Haste.JNT_DOFADR)[joint]
        lever = length(anchors, joint) + further + vector(table, Haste.REACH)[body]
        if kinds[joint] == _FREE or kinds[joint] == _SLIDE:
            for k in range(3 if kinds[joint] == _FREE else 1):
                levers[dof + k] = 1.0
            dof += 3
        if kinds[joint] != _SLIDE:
            for k in range(1 if kinds[joint] == _HINGE else 3):
                levers[dof + k] = lever
    return further


@compiled
def way(table: Indices, timestep: float) -> float:
    """Return by how much two geoms may have come nearer in the last step, m."""
    levers, qvel = vector(table, Haste.LEVERS), vector(table, Haste.QVEL)
    speed = 0.0
    for dof in range(levers.shape[0]):
        speed += abs(qvel[dof]) * levers[dof]
    return timestep * speed


@inlined
def length(points: Matrix, k: int) -> float:
    """Return the distance of a point from the origin."""
    return math.sqrt(points[k, 0] ** 2 + points[k, 1] ** 2 + points[k, 2] ** 2)
