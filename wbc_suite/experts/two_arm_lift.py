"""The expert of TwoArmLift."""

import numpy as np
import pinocchio as pin

from wbc_suite.benchmark.two_arm_lift import HANDLES, POT, TwoArmLift
from wbc_suite.experts.grasp_choice import Approach, Choice, choose_grasp
from wbc_suite.experts.skills import UP, move, shifted, take
from wbc_suite.experts.two_arms import carry_together
from wbc_suite.experts.workcell import Steps, Workcell, together

RISE = 0.15  # m


def two_arm_lift(cell: Workcell[TwoArmLift]) -> Steps[None]:
    """Grasp a handle with each arm, and raise the pot level."""
    goal = shifted(cell.pose(POT), RISE * UP)
    for _ in range(3):
        choices = [_choose(cell, k, goal) for k in range(2)]
        held = yield from together(*(take(cell, POT, choice) for choice in choices))
        arms = [choice.arm for choice in choices]
        if all(held):
            now = cell.pose(POT)
            level = pin.SE3(_upright(now.rotation), goal.translation)
            yield from carry_together(cell, arms, POT, level)
            if cell.benchmark.success():
                return
        for arm in arms:
            arm.open()
        yield from together(
            *(move(a, shifted(a.pose, 0.08 * UP), most=15) for a in arms)
        )


def _choose(cell: Workcell[TwoArmLift], k: int, goal: pin.SE3) -> Choice:
    """Choose how arm k grasps its handle."""
    handle = HANDLES[k].removeprefix(f"{POT}_")
    approach = Approach(raised=0.0, place=handle)
    choice = choose_grasp(
        cell, POT, arms=[cell.arms[k]], approach=approach, then=[(goal,)]
    )
    assert choice is not None, "a bar has grasps from all around"
    return choice


def _upright(R: np.ndarray) -> np.ndarray:
    """Return the rotation nearest to another whose z axis points up."""
    return pin.exp3(np.cross(R[:, 2], UP)) @ R
