"""The expert of LocoLift."""

from wbc_suite.benchmark import LocoLift
from wbc_suite.benchmark.lift import CUBE
from wbc_suite.experts.on_feet import walk
from wbc_suite.experts.skills import pick
from wbc_suite.experts.workcell import Steps, Workcell

TRIES = 4
ASIDE = 0.7  # of the hand's distance to the side: the cube is before the hand
RAISED = 0.08  # m


def loco_lift(cell: Workcell[LocoLift]) -> Steps[None]:
    """Walk to where a hand reaches the cube, grasp it and raise it."""
    walker = cell.walker
    if walker is None:
        return
    arm = cell.arms[0]
    ahead, aside, _ = walker.ground.actInv(arm.home).translation
    for _ in range(TRIES):
        x, y, _ = cell.pose(CUBE).translation.tolist()
        yield from walk(cell, x - ahead, y - ASIDE * aside, 0.0)
        if (
            yield from pick(cell, CUBE, arms=[arm], raised=RAISED, tries=1)
        ) is not None:
            return
