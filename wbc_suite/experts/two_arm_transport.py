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
from wbc_suite.experts.scene import ExpertScene, Steps, together
from wbc_suite.experts.skills import UP, pick, put_down, travel
from wbc_suite.typing import Vector

HEIGHT = 0.35  # m, of the meeting point above the tables
CLEAR = 0.08  # m, above the walls of the bins
DROP = 0.05  # m, above the floor of a bin


def two_arm_transport(scene: ExpertScene[TwoArmTransport]) -> Steps[None]:
    """Open the bin and clear the other one, then hand the hammer over and put it in."""
    giver, taker = scene.arms
    config = scene.benchmark.config
    clear = config.bin.size[2] + CLEAR
    yield from together(_open(scene, giver), _clear(scene, taker, clear))
    for _ in range(3):
        handed = yield from hand_over(
            scene,
            PAYLOAD,
            giver=giver,
            taker=taker,
            places=("neck", "end"),
            height=config.table.center[2] + HEIGHT,
            raised=clear + 0.05,
            over=_over(scene),
        )
        if not handed:
            return
        floor = _floor(scene, TARGET_BIN)
        yield from put_down(scene, taker, PAYLOAD, floor + DROP * UP, over=clear)
        if scene.benchmark.success():
            return


def _open(scene: ExpertScene[TwoArmTransport], arm: Arm) -> Steps[None]:
    """Put the lid on the table beside its bin."""
    choice = yield from pick(scene, LID, arms=[arm], raised=0.1)
    if choice is None:
        return
    at = scene.pose(START_BIN).translation
    at[0] -= 2 * scene.benchmark.config.bin.near
    at[2] = scene.benchmark.config.table.center[2] + 0.02
    yield from put_down(scene, arm, LID, at, over=0.15)
    yield from travel(arm, arm.home, height=_over(scene), tolerance=0.05, most=40)


def _clear(scene: ExpertScene[TwoArmTransport], arm: Arm, clear: float) -> Steps[None]:
    """Throw the trash into its bin."""
    for _ in range(3):
        choice = yield from pick(
            scene, TRASH, arms=[arm], raised=clear, over=_over(scene)
        )
        if choice is None:
            return
        floor = _floor(scene, TRASH_BIN)
        yield from put_down(scene, arm, TRASH, floor + DROP * UP, over=clear)
        if scene.benchmark.is_in(TRASH, TRASH_BIN):
            break
    yield from travel(arm, arm.home, height=_over(scene), tolerance=0.05, most=40)


def _over(scene: ExpertScene[TwoArmTransport]) -> float:
    """Return a height clear of the bins, m."""
    config = scene.benchmark.config
    return config.table.center[2] + config.bin.size[2] + CLEAR


def _floor(scene: ExpertScene[TwoArmTransport], name: str) -> Vector:
    """Return the middle of the upper face of a bin's floor, m."""
    wall = scene.benchmark.config.bin.wall
    return scene.pose(name).translation + np.array([0.0, 0.0, wall])
