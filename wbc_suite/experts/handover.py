"""Handing an object over from one arm to another."""

import itertools
import math
from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from wbc_suite.experts.arm import Arm
from wbc_suite.experts.grasp_choice import Approach, choose_grasp
from wbc_suite.experts.scene import ExpertScene, Steps
from wbc_suite.experts.skills import UP, carry, grip, move, pick, release, shifted
from wbc_suite.typing import Vector

ROLLS = tuple(np.linspace(0.0, 2.0 * math.pi, 8, endpoint=False))
FACING = 0.9  # rad, of the receiving hand's approach to the direction between the arms
SHARES = (0.5, 0.4, 0.6)  # of the way from the giving to the receiving arm


def hand_over(
    scene: ExpertScene,
    name: str,
    *,
    giver: Arm,
    taker: Arm,
    places: tuple[str, str],
    height: float,
    raised: float = 0.1,
    over: float | None = None,
    tries: int = 3,
) -> Steps[bool]:
    """Pick an object up with one arm and give it to another.

    Args:
        scene: The scene.
        name: The object, long along its z axis.
        giver: The arm that picks it up.
        taker: The arm that has it in the end.
        places: Names of the places that either arm grasps.
        height: Of the meeting point in the world, m.
        raised: How far the giver raises it first, m.
        over: Height at which the giver comes, see `pick`, m.
        tries: How often.

    Returns:
        Whether the taker alone holds it.
    """
    for _ in range(tries):
        if not scene.holds(giver, name):
            meetings = _meetings(scene, name, giver, taker, places[1], height)
            choice = yield from pick(
                scene,
                name,
                then=[(pose,) for pose in meetings],
                arms=[giver],
                place=places[0],
                raised=raised,
                over=over,
            )
            if choice is None:
                return False
            (goal,) = choice.then
            yield from carry(
                scene, giver, name, goal, tolerance=0.02, turn_tolerance=0.1
            )
        if (yield from _receive(scene, name, giver, taker, places[1])):
            return True
        taker.open()
        yield from move(taker, taker.home, tolerance=0.05, most=40)
    return False


def _receive(
    scene: ExpertScene, name: str, giver: Arm, taker: Arm, place: str
) -> Steps[bool]:
    """Grasp with the taker what the giver holds, and let the giver go."""
    towards = giver.pose.translation - taker.pose.translation
    direction = towards / np.linalg.norm(towards)
    approach = Approach(
        raised=0.0, away=0.1, upright=FACING, direction=direction, place=place
    )
    choice = choose_grasp(scene, name, arms=[taker], approach=approach)
    if choice is None:
        return False
    taker.open(choice.site.grasp)
    if not (yield from move(taker, choice.before, tolerance=0.02, turn_tolerance=0.2)):
        return False
    yield from move(taker, lambda: choice.hand_at(scene.pose(name)), speed=0.3)
    if not (yield from grip(scene, taker, name)):
        return False
    for _ in range(3):
        yield
    yield from release(giver, back=0.12)
    return scene.holds(taker, name)


def _meetings(
    scene: ExpertScene, name: str, giver: Arm, taker: Arm, place: str, height: float
) -> Sequence[pin.SE3]:
    """Return poses of the object that the taker reaches well, across both arms."""
    a, b = giver.pose.translation, taker.pose.translation
    way = np.array([b[0] - a[0], b[1] - a[1], 0.0])
    way /= np.linalg.norm(way)
    across = np.cross(UP, way)
    found: list[tuple[float, list[pin.SE3]]] = []
    for sign, share in itertools.product((1.0, -1.0), SHARES):
        at = (1.0 - share) * a + share * b
        at[2] = height
        poses = [pin.SE3(_along(sign * across, roll), at) for roll in ROLLS]
        cost = _cost_of_taking(scene, name, taker, place, poses[0], -way)
        found.append((cost, poses))
    found.sort(key=lambda one: one[0])
    return [pose for _, poses in found[:3] for pose in poses]


def _cost_of_taking(
    scene: ExpertScene,
    name: str,
    taker: Arm,
    place: str,
    pose: pin.SE3,
    direction: Vector,
) -> float:
    """Return the cost of the easiest grasp of the taker at a pose of the object."""
    least = math.inf
    for site in scene.grasps(name):
        at = pose * site.pose
        if site.name != place or at.rotation[:, 2] @ direction < math.cos(FACING):
            continue
        before = shifted(at, -0.1 * at.rotation[:, 2])
        least = min(least, taker.look_ahead([before, at], most=least).cost)
    return least


def _along(axis: Vector, roll: float) -> np.ndarray:
    """Return a rotation whose z axis is a horizontal unit vector, rolled about it."""
    R = np.column_stack([UP, np.cross(axis, UP), axis])
    return R @ pin.exp3(np.array([0.0, 0.0, roll]))
