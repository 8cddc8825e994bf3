"""The expert of TwoArmTransport."""

import numpy as np

from wbc_suite.benchmark.two_arm_transport import (
    LID,
    PAYLOAD,
    START_BIN,
    TARGET_BIN,
    TRASH,
    TRASH_BIN,
    TwoArmTransport,
)
from wbc_suite.experts.arm import Arm
from wbc_suite.experts.handover import hand_over
from wbc_suite.experts.skills import UP, pick, put_down, travel
from wbc_suite.experts.workcell import Steps, Workcell, together
from wbc_suite.typing import Vector

HEIGHT = 0.35  # m, of the meeting point above the tables
CLEAR = 0.08  # m, above the walls of the bins
DROP = 0.05  # m, above the floor of a bin


def two_arm_transport(cell: Workcell[TwoArmTransport]) -> Steps[None]:
    """Open the bin and clear the other one, then hand the hammer over and put it in."""
    giver, taker = cell.arms
    config = cell.benchmark.config
    clear = config.bin.size[2] + CLEAR
    yield from together(_open(cell, giver), _clear(cell, taker, clear))
    for _ in range(3):
        handed = yield from hand_over(
            cell,
            PAYLOAD,
            giver=giver,
            taker=taker,
            places=("neck", "end"),
            height=config.table.center[2] + HEIGHT,
            raised=clear + 0.05,
            over=_over(cell),
        )
        if not handed:
            return
        floor = _floor(cell, TARGET_BIN)
        yield from put_down(cell, taker, PAYLOAD, floor + DROP * UP, over=clear)
        if cell.benchmark.success():
            return


def _open(cell: Workcell[TwoArmTransport], arm: Arm) -> Steps[None]:
    """Put the lid on the table beside its bin."""
    choice = yield from pick(cell, LID, arms=[arm], raised=0.1)
    if choice is None:
        return
    at = cell.pose(START_BIN).translation
    at[0] -= 2 * cell.benchmark.config.bin.near
    at[2] = cell.benchmark.config.table.center[2] + 0.02
    yield from put_down(cell, arm, LID, at, over=0.15)
    yield from travel(arm, arm.home, height=_over(cell), tolerance=0.05, most=40)


def _clear(cell: Workcell[TwoArmTransport], arm: Arm, clear: float) -> Steps[None]:
    """Throw the trash into its bin."""
    for _ in range(3):
        choice = yield from pick(
            cell, TRASH, arms=[arm], raised=clear, over=_over(cell)
        )
        if choice is None:
            return
        floor = _floor(cell, TRASH_BIN)
        yield from put_down(cell, arm, TRASH, floor + DROP * UP, over=clear)
        if cell.benchmark.is_in(TRASH, TRASH_BIN):
            break
    yield from travel(arm, arm.home, height=_over(cell), tolerance=0.05, most=40)


def _over(cell: Workcell[TwoArmTransport]) -> float:
    """Return a height clear of the bins, m."""
    config = cell.benchmark.config
    return config.table.center[2] + config.bin.size[2] + CLEAR


def _floor(cell: Workcell[TwoArmTransport], name: str) -> Vector:
    """Return the middle of the upper face of a bin's floor, m."""
    wall = cell.benchmark.config.bin.wall
    return cell.pose(name).translation + np.array([0.0, 0.0, wall])
