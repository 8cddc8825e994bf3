"""The expert of LocoLift."""

from wbc_suite.benchmark import LocoLift
from wbc_suite.benchmark.lift import CUBE
from wbc_suite.experts.on_feet import walk
from wbc_suite.experts.scene import ExpertScene, Steps
from wbc_suite.experts.skills import pick

TRIES = 4
ASIDE = 0.7  # of the hand's distance to the side: the cube is before the hand
RAISED = 0.08  # m


def loco_lift(scene: ExpertScene[LocoLift]) -> Steps[None]:
    """Walk to where a hand reaches the cube, grasp it and raise it."""
    walker = scene.walker
    if walker is None:
        return
    arm = scene.arms[0]
    ahead, aside, _ = walker.ground.actInv(arm.home).translation
    for _ in range(TRIES):
        x, y, _ = scene.pose(CUBE).translation.tolist()
        yield from walk(scene, x - ahead, y - ASIDE * aside, 0.0)
        if (
            yield from pick(scene, CUBE, arms=[arm], raised=RAISED, tries=1)
        ) is not None:
            return
