"""Experts of robots on their feet: Stand, Reach and WalkTo, and how they walk."""

import math

import numpy as np

from wbc_suite.benchmark import Reach, Stand, WalkTo
from wbc_suite.benchmark.walk_to import GOAL
from wbc_suite.experts.scene import ExpertScene, Steps, wait_until
from wbc_suite.experts.skills import shifted
from wbc_suite.experts.walker import walking_velocity

ARRIVED = 0.05  # m and rad
LONGEST_WALK = 800  # control periods of one walk
SETTLE = 40  # control periods to come to rest
REACHING = 0.3  # m/s


def walk(
    scene: ExpertScene, x: float, y: float, heading: float, *, near: float = ARRIVED
) -> Steps[bool]:
    """Walk to a place in the world, m and rad, and come to rest; return success.

    It is reached where less is left than `near`, m and rad.
    Hands that were moved keep their poses relative to the trunk.
    """
    walker = scene.walker
    if walker is None:
        return False
    held = [(a, walker.ground.actInv(a.goal)) for a in scene.arms if a.goal is not None]
    try:
        for _ in range(LONGEST_WALK):
            walker.velocity = walking_velocity(walker.way_to(x, y, heading), near)
            if not walker.velocity.any():
                return (yield from wait_until(lambda: walker.rests, most=SETTLE))
            for arm, pose in held:
                arm.aim(walker.ground * pose)
            yield
    finally:
        walker.velocity = np.zeros(3)
    return False


def walk_to(scene: ExpertScene[WalkTo]) -> Steps[None]:
    """Walk to the mark, and turn as its arrow points."""
    pose = scene.pose(GOAL)
    x, y, _ = pose.translation.tolist()
    R = pose.rotation
    yield from walk(scene, x, y, math.atan2(R[1, 0], R[0, 0]))


def stand(scene: ExpertScene[Stand]) -> Steps[None]:
    """Withstand the pushes, and return to where the robot stood."""
    walker = scene.walker
    if walker is None:
        return
    start, last = walker.place, max(push.stop for push in scene.benchmark.pushes)
    while scene.data.time < last:
        yield
    while True:
        if not scene.benchmark.is_back:
            yield from walk(scene, *start)
        yield


def reach(scene: ExpertScene[Reach]) -> Steps[None]:
    """Bring each hand to its target, turned as it was."""
    targets = dict(zip(scene.benchmark.hands, scene.benchmark.targets, strict=True))
    for arm in scene.arms:
        way = targets[arm.hand].position - arm.hand.position
        arm.aim(shifted(arm.pose, way), speed=REACHING)
    yield
