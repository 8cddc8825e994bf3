"""The expert of TwoArmLift."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from wbc_suite.benchmark.two_arm_lift import HANDLES, POT, TwoArmLift
from wbc_suite.experts.arm import Arm
from wbc_suite.experts.grasp_choice import Approach, choose_pair
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
from wbc_suite.experts.workcell import Steps, Workcell, together, wait_until

TRIES = 5
RISE = 0.15  # m
SLOW = 0.15  # m/s, of hands that come to the handles: thumbs have little room there
AWAY = 0.11  # m, from where fingers are clear of the pot's rim


def two_arm_lift(cell: Workcell[TwoArmLift]) -> Steps[None]:
    """Grasp a handle with each arm, and raise the pot level."""
    goal = shifted(cell.pose(POT), RISE * UP)
    arms = cell.arms[:2]
    yield from drive_before(cell, POT, arms, HANDLES)
    for _ in range(TRIES):
        between = cell.point(HANDLES[1]) - cell.point(HANDLES[0])  # hands may turn it
        crossed = between @ (arms[1].home.translation - arms[0].home.translation) < 0.0
        handles = HANDLES[::-1] if crossed else HANDLES
        places = [handle.removeprefix(f"{POT}_") for handle in handles]
        ways = [Approach(raised=0.0, away=AWAY, place=place) for place in places]
        choices = choose_pair(cell, POT, arms=arms, approaches=ways, then=[goal])
        if choices is None:
            return
        yield from together(*(come_before(cell, choice) for choice in choices))
        held = []
        for choice in choices:  # one after the other: two hands at once turn the pot
            yield from close_in(cell, POT, choice, speed=SLOW)
            held.append((yield from grip(cell, choice.arm, POT)))
        if all(held) and (yield from _raise(cell, arms, goal)):
            return
        for arm in arms:
            arm.open()
        yield from together(
            *(move(a, shifted(a.pose, 0.08 * UP), most=15) for a in arms)
        )


def _raise(
    cell: Workcell[TwoArmLift], arms: Sequence[Arm], goal: pin.SE3
) -> Steps[bool]:
    """Raise the pot level to a goal's height; without success put it down again."""
    now = cell.pose(POT)
    up = pin.SE3(_upright(now.rotation), goal.translation)
    yield from carry_together(cell, arms, POT, up)
    if (yield from wait_until(cell.benchmark.success, most=20)):
        return True
    down = at_height(cell.pose(POT), now.translation.item(2))
    yield from carry_together(cell, arms, POT, down)
    return False


def _upright(R: np.ndarray) -> np.ndarray:
    """Return the rotation nearest to another whose z axis points up."""
    return pin.exp3(np.cross(R[:, 2], UP)) @ R
