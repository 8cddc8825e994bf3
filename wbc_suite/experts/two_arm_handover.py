"""The expert of TwoArmHandover."""

from wbc_suite.benchmark.two_arm_handover import HAMMER, TwoArmHandover
from wbc_suite.experts.handover import hand_over
from wbc_suite.experts.scene import ExpertScene, Steps

HEIGHT = 0.35  # m, of the meeting point above the table


def two_arm_handover(scene: ExpertScene[TwoArmHandover]) -> Steps[None]:
    """Pick the hammer up next to its head, and give its handle's end to arm 1."""
    giver, taker = scene.arms
    yield from hand_over(
        scene,
        HAMMER,
        giver=giver,
        taker=taker,
        places=("neck", "end"),
        height=scene.benchmark.config.table.center[2] + HEIGHT,
    )
