"""Experts of robots on their feet: Stand, Reach and WalkTo, and how they walk."""

import math

import numpy as np

from wbc_suite.benchmark import Reach, Stand, WalkTo
from wbc_suite.benchmark.walk_to import GOAL
from wbc_suite.experts.skills import shifted
from wbc_suite.experts.walker import walking_velocity
from wbc_suite.experts.workcell import Steps, Workcell, wait_until

NEAR = 0.05  # m and rad
MOST = 800  # control periods of one walk
SETTLE = 40  # control periods to come to rest
REACHING = 0.3  # m/s


def walk(
    cell: Workcell, x: float, y: float, heading: float, *, near: float = NEAR
) -> Steps[bool]:
    """Walk to a place in the world, m and rad, and come to rest; return success.

    It is reached where less is left than `near`, m and rad.
    Hands that were moved keep their poses relative to the trunk.
    """
    walker = cell.walker
    if walker is None:
        return False
    held = [(a, walker.ground.actInv(a.goal)) for a in cell.arms if a.goal is not None]
    try:
        for _ in range(MOST):
            walker.velocity = walking_velocity(walker.way_to(x, y, heading), near)
            if not walker.velocity.any():
                return (yield from wait_until(lambda: walker.rests, most=SETTLE))
            for arm, pose in held:
                arm.aim(walker.ground * pose)
            yield
    finally:
        walker.velocity = np.zeros(3)
    return False


def walk_to(cell: Workcell[WalkTo]) -> Steps[None]:
    """Walk to the mark, and turn as its arrow points."""
    pose = cell.pose(GOAL)
    x, y, _ = pose.translation.tolist()
    R = pose.rotation
    yield from walk(cell, x, y, math.atan2(R[1, 0], R[0, 0]))


def stand(cell: Workcell[Stand]) -> Steps[None]:
    """Withstand the pushes, and return to where the robot stood."""
    walker = cell.walker
    if walker is None:
        return
    start, last = walker.place, max(push.stop for push in cell.benchmark.pushes)
    while cell.data.time < last:
        yield
    while True:
        if not cell.benchmark.is_back:
            yield from walk(cell, *start)
        yield


def reach(cell: Workcell[Reach]) -> Steps[None]:
    """Bring each hand to its target, turned as it was."""
    targets = dict(zip(cell.benchmark.hands, cell.benchmark.targets, strict=True))
    for arm in cell.arms:
        way = targets[arm.hand].position - arm.hand.position
        arm.aim(shifted(arm.pose, way), speed=REACHING)
    yield
