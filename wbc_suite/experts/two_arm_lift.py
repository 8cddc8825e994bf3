"""The expert of TwoArmLift."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from wbc_suite.benchmark.two_arm_lift import HANDLES, POT, TwoArmLift
from wbc_suite.experts.arm import Arm
from wbc_suite.experts.grasp_choice import Approach, choose_pair
from wbc_suite.experts.scene import ExpertScene, Steps, together, wait_until
from wbc_suite.experts.skills import (
    UP,
    at_height,
    close_in,
    come_before,
    grip,
    move,
    shifted,
)
from wbc_suite.experts.two_arms import carry_together, drive_before

TRIES = 5
RISE = 0.15  # m
SLOW = 0.15  # m/s, of hands that come to the handles: thumbs have little room there
AWAY = 0.11  # m, from where fingers are clear of the pot's rim


def two_arm_lift(scene: ExpertScene[TwoArmLift]) -> Steps[None]:
    """Grasp a handle with each arm, and raise the pot level."""
    goal = shifted(scene.pose(POT), RISE * UP)
    arms = scene.arms[:2]
    yield from drive_before(scene, POT, arms, HANDLES)
    for _ in range(TRIES):
        between = scene.point(HANDLES[1]) - scene.point(HANDLES[0])  # hands may turn it
        crossed = between @ (arms[1].home.translation - arms[0].home.translation) < 0.0
        handles = HANDLES[::-1] if crossed else HANDLES
        places = [handle.removeprefix(f"{POT}_") for handle in handles]
        ways = [Approach(raised=0.0, away=AWAY, place=place) for place in places]
        choices = choose_pair(scene, POT, arms=arms, approaches=ways, then=[goal])
        if choices is None:
            return
        yield from together(*(come_before(scene, choice) for choice in choices))
        held = []
        for choice in choices:  # one after the other: two hands at once turn the pot
            yield from close_in(scene, POT, choice, speed=SLOW)
            held.append((yield from grip(scene, choice.arm, POT)))
        if all(held) and (yield from _raise(scene, arms, goal)):
            return
        for arm in arms:
            arm.open()
        yield from together(
            *(move(a, shifted(a.pose, 0.08 * UP), most=15) for a in arms)
        )


def _raise(
    scene: ExpertScene[TwoArmLift], arms: Sequence[Arm], goal: pin.SE3
) -> Steps[bool]:
    """Raise the pot level to a goal's height; without success put it down again."""
    now = scene.pose(POT)
    up = pin.SE3(_upright(now.rotation), goal.translation)
    yield from carry_together(scene, arms, POT, up)
    if (yield from wait_until(scene.benchmark.success, most=20)):
        return True
    down = at_height(scene.pose(POT), now.translation.item(2))
    yield from carry_together(scene, arms, POT, down)
    return False


def _upright(R: np.ndarray) -> np.ndarray:
    """Return the rotation nearest to another whose z axis points up."""
    return pin.exp3(np.cross(R[:, 2], UP)) @ R
