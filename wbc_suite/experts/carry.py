"""The expert of Carry."""

import math

import numpy as np

from wbc_suite.benchmark import Carry
from wbc_suite.benchmark.two_arm_lift import HANDLES, POT
from wbc_suite.experts.arm import Arm
from wbc_suite.experts.on_feet import walk
from wbc_suite.experts.scene import ExpertScene, Steps, together, wait_until
from wbc_suite.experts.skills import UP, move, shifted
from wbc_suite.experts.walker import Walker
from wbc_suite.typing import Vector

TRIES = 3
AHEAD, BEFORE = 0.42, 0.5  # m, of the pot and of the other table's middle
WAY = (  # of a hand from its handle: outwards and up, m
    (0.09, 0.02),
    (0.09, -0.075),
    (-0.05, -0.075),  # near the pot, which slides on the hands in turns
)
BEHIND = 0.03  # m, of a hand from its handle, towards the robot
REACHING, RAISING, LOWERING = 0.3, 0.15, 0.1  # m/s
RISE = 0.14  # m
FREE, APART = 0.05, 0.08  # m, down and outwards, of hands that leave the handles
BACK = 0.3  # m, that the robot steps back
SLOWLY = 0.5  # of the velocity of a walk, with the pot on the hands


def carry(scene: ExpertScene[Carry]) -> Steps[None]:
    """Raise the pot by its handles from below, and carry it to the other table."""
    walker, goal = scene.walker, scene.benchmark.config.other
    if walker is None:
        return
    for _ in range(TRIES):
        yield from _raise(scene)
        if not scene.benchmark.supports():
            break
    yield from walk(scene, *_behind(walker), share=SLOWLY)
    x, y, _ = walker.place
    heading = math.atan2(goal[1] - y, goal[0] - x)
    yield from walk(scene, x, y, heading, share=SLOWLY)
    yield from walk(scene, *_before(goal, heading, BEFORE), share=SLOWLY)
    yield from _put_down(scene)
    yield from walk(scene, *_behind(walker))


def _behind(walker: Walker) -> tuple[float, float, float]:
    """Return a place away from a table, whose edge a thigh meets in a turn, m, rad."""
    x, y, heading = walker.place
    return _before((x, y, 0.0), heading, BACK)


def _before(
    place: tuple[float, float, float], heading: float, distance: float
) -> tuple[float, float, float]:
    """Return where a robot stands before a place, m, with its heading, rad."""
    x, y, _ = place
    return x - distance * math.cos(heading), y - distance * math.sin(heading), heading


def _raise(scene: ExpertScene[Carry]) -> Steps[None]:
    """Walk before the pot, bring the hands under its handles, and raise it."""
    across, (x, y, _) = _across(scene), scene.pose(POT).translation.tolist()
    heading = math.atan2(-across[0], across[1])
    yield from walk(scene, *_before((x, y, 0.0), heading, AHEAD))
    for outwards, up in WAY:
        yield from together(*(_reach(scene, arm, outwards, up) for arm in scene.arms))
    up = [shifted(arm.pose, RISE * UP) for arm in scene.arms]
    yield from together(
        *(
            move(arm, goal, speed=RAISING, most=40)
            for arm, goal in zip(scene.arms, up, strict=True)
        )
    )


def _reach(
    scene: ExpertScene[Carry], arm: Arm, outwards: float, up: float
) -> Steps[bool]:
    """Bring a hand beside the handle on its side, turned as it is."""
    across, points = _across(scene), [scene.point(name) for name in HANDLES]
    side = 1.0 if arm.hand.name == "left" else -1.0
    handle = max(points, key=lambda point: float(side * across @ point))
    back = np.array([across[1], -across[0], 0.0])
    point = handle + side * outwards * across - BEHIND * back + up * UP
    goal = shifted(arm.pose, point - arm.hand.position)
    return (
        yield from move(
            arm, goal, speed=REACHING, tolerance=0.01, turn_tolerance=0.2, most=50
        )
    )


def _across(scene: ExpertScene[Carry]) -> Vector:
    """Return the level unit vector along the handles, to the left of the robot."""
    along = scene.point(HANDLES[0]) - scene.point(HANDLES[1])
    hands = {arm.hand.name: arm.hand.position for arm in scene.arms}
    left = hands["left"] - hands["right"]
    along = np.array([*along[:2], 0.0]) * np.sign(along @ left)
    return along / np.linalg.norm(along)


def _put_down(scene: ExpertScene[Carry]) -> Steps[None]:
    """Lower the hands until the pot stands, and take them from its handles."""
    pot = scene.benchmark
    _lower(scene, 2 * RISE)
    yield from wait_until(lambda: bool(pot.supports()), most=80)
    _lower(scene, FREE, apart=APART)
    yield from wait_until(lambda: pot.hands_at_pot() == 0, most=40)
    yield from wait_until(lambda: False, most=10)


def _lower(scene: ExpertScene[Carry], way: float, apart: float = 0.0) -> None:
    """Lower the hands by a way and move them apart by another, m."""
    across = _across(scene)
    for arm in scene.arms:
        side = 1.0 if arm.hand.name == "left" else -1.0
        goal = shifted(arm.pose, apart * side * across - way * UP)
        arm.aim(goal, speed=LOWERING, exact=False)
