"""Experts of robots on their feet: Stand, Reach and WalkTo, and how they walk."""

import itertools
import math

import numpy as np
import pinocchio as pin

from wbc_suite.benchmark import Reach, Stand, WalkTo
from wbc_suite.benchmark.walk_to import GOAL
from wbc_suite.experts.arm import Arm
from wbc_suite.experts.scene import ExpertScene, Steps, wait_until
from wbc_suite.experts.skills import UP
from wbc_suite.experts.walker import walking_velocity
from wbc_suite.typing import Vector

ARRIVED = 0.05  # m and rad
LONGEST_WALK = 800  # control periods of one walk
SETTLE = 40  # control periods to come to rest
REACHING = 0.3  # m/s
ANGLES = (0.0, 0.4, -0.4, 0.8, -0.8, 1.2, -1.2)  # rad
LEFT = np.array([0.0, 1.0, 0.0])
STEPS = (0.0, 0.1, 0.2)  # m, ahead
STEPPED = 0.02  # m and rad


def walk(
    scene: ExpertScene,
    x: float,
    y: float,
    heading: float,
    *,
    near: float = ARRIVED,
    share: float = 1.0,
) -> Steps[bool]:
    """Walk to a place in the world, m and rad, and come to rest; return success.

    It is reached where less is left than `near`, m and rad. `share` is how much of the
    usual velocity the robot walks with at most. Hands that were moved keep their poses
    relative to the trunk.
    """
    walker = scene.walker
    if walker is None:
        return False
    held = [(a, walker.ground.actInv(a.goal)) for a in scene.arms if a.goal is not None]
    try:
        for _ in range(LONGEST_WALK):
            way = walker.way_to(x, y, heading)
            walker.velocity = walking_velocity(way, near, share)
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
    """Bring each hand to its target, turned as is easiest; first step up to them."""
    targets = dict(zip(scene.benchmark.hands, scene.benchmark.targets, strict=True))
    points = [(arm, targets[arm.hand].position) for arm in scene.arms]
    walker = scene.walker
    if walker is not None:
        x, y, heading = walker.place
        ahead = np.array([math.cos(heading), math.sin(heading), 0.0])

        def cost(way: float) -> float:
            found = (_easiest(arm, at - way * ahead)[1] for arm, at in points)
            return sum(found) + way

        x, y, _ = np.array([x, y, 0.0]) + min(STEPS, key=cost) * ahead
        yield from walk(scene, x, y, heading, near=STEPPED)
    for arm, at in points:
        arm.aim(_easiest(arm, at)[0], speed=REACHING)
    yield


def _easiest(arm: Arm, point: Vector) -> tuple[pin.SE3, float]:
    """Return a pose with the hand at a point, turned and tilted, and its cost."""
    start = arm.pose
    offset = start.actInv(arm.hand.position)
    turns = (
        pin.exp3(yaw * UP) @ pin.exp3(pitch * LEFT)
        for yaw, pitch in itertools.product(ANGLES, repeat=2)
    )
    ends = [turn @ start.rotation for turn in turns]
    poses = [pin.SE3(R, point - R @ offset) for R in ends]
    costs = [arm.look_ahead([pose]).cost for pose in poses]
    best = int(np.argmin(costs))
    return poses[best], costs[best]
