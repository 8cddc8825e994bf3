"""The expert of NutAssembly and its variants."""

import math

import numpy as np
import pinocchio as pin

from wbc_suite.benchmark.nut_assembly import NutAssembly
from wbc_suite.experts.scene import ExpertScene, Steps
from wbc_suite.experts.skills import UP, carry, pick, release, settle

TURNS = {"SquareNut": 4, "RoundNut": 8}
"""Equivalent turns of a nut about its peg."""
TRIES = 3  # to lower a nut that meets the peg's rim, before it is let go
AWAY = 0.1  # m, to withdraw
ABOVE, DOWN_TO = 0.03, 0.03  # m, over the peg's end; over the table


def nut_assembly(scene: ExpertScene[NutAssembly]) -> Steps[None]:
    """Put each nut over its peg."""
    sorting = scene.benchmark.sorting
    yield from settle(scene, sorting.active[0])
    for _ in range(2 * len(sorting.active)):
        left = [name for name in sorting.active if not sorting.is_placed(name)]
        if not left:
            return
        yield from _put_over_peg(scene, left[0])


def _put_over_peg(scene: ExpertScene[NutAssembly], name: str) -> Steps[None]:
    """Carry one nut over its peg, lower it and let go."""
    config = scene.benchmark.config
    x, y = scene.benchmark.goal(name)
    foot = np.array([x, y, config.table.center[2]])
    turns = TURNS[name]
    flips = (np.eye(3), np.diag([1.0, -1.0, -1.0]))
    upward = flips[int(scene.object(name).rotation[2, 2] < 0.0)]
    plans = []
    for k in range(turns):
        R = pin.exp3(2.0 * math.pi * k / turns * UP) @ upward
        plans.append(
            [
                pin.SE3(R, foot + height * UP)
                for height in (config.pegs.height + ABOVE, DOWN_TO)
            ]
        )
    high = config.pegs.height + ABOVE - 0.02
    choice = yield from pick(scene, name, then=plans, raised=high, leave=AWAY)
    if choice is None:
        return
    arm, (above, down) = choice.arm, choice.then
    for _ in range(TRIES):
        yield from carry(scene, arm, name, above, tolerance=0.003)
        yield from carry(scene, arm, name, down, tolerance=0.006, speed=0.2)
        if scene.pose(name).translation[2] < foot[2] + config.height:
            break
    yield from release(arm, back=AWAY)
