"""The expert of TwoArmHandover."""

from wbc_suite.benchmark.two_arm_handover import HAMMER, TwoArmHandover
from wbc_suite.experts.handover import hand_over
from wbc_suite.experts.workcell import Steps, Workcell

HEIGHT = 0.35  # m, of the meeting point above the table


def two_arm_handover(cell: Workcell[TwoArmHandover]) -> Steps[None]:
    """Pick the hammer up next to its head, and give its handle's end to arm 1."""
    giver, taker = cell.arms
    yield from hand_over(
        cell,
        HAMMER,
        giver=giver,
        taker=taker,
        places=("neck", "end"),
        height=cell.benchmark.config.table.center[2] + HEIGHT,
    )
