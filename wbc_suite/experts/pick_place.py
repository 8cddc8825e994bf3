"""The expert of PickPlace and its variants."""

import math

import numpy as np
import pinocchio as pin

from wbc_suite.benchmark.pick_place import PickPlace
from wbc_suite.experts.scene import ExpertScene, Steps
from wbc_suite.experts.skills import UP, carry, pick, release, settle, shifted

TURNS = tuple(pin.exp3(k * math.pi / 2 * UP) for k in range(4))
ASIDE = 0.04  # m, from the middle of a quadrant
AWAY = 0.12  # m, to withdraw
TALLEST = 0.16  # m, of the objects, with some room for fingers
CLEAR = 0.03  # m, above the walls of the bins
LOW, LANDED = 0.004, 0.004  # m, above where an object comes to lie, when it is let go


def pick_place(scene: ExpertScene[PickPlace]) -> Steps[None]:
    """Put each object into its quadrant, as it lies, those in front first."""
    sorting = scene.benchmark.sorting
    for _ in range(2 * len(sorting.active)):
        left = [name for name in sorting.active if not sorting.is_placed(name)]
        if not left:
            return
        yield from settle(scene, left[0])
        name = max(left, key=lambda n: scene.object(n).position[1])
        yield from _place(scene, name)


def _place(scene: ExpertScene[PickPlace], name: str) -> Steps[None]:
    """Carry one object over the walls into its quadrant."""
    config = scene.benchmark.config
    x, y = scene.benchmark.goal(name)
    lying = scene.pose(name)
    height = lying.translation[2] - config.source.center[2]
    middle = np.array([x, y, config.target.center[2] + height + LOW])
    over = config.target.size[2] + CLEAR
    hands = [arm.home.translation - middle for arm in scene.arms]
    dx, dy, _ = ASIDE * np.sign(min(hands, key=np.linalg.norm))  # towards the nearest
    ways = [
        pin.SE3(R @ lying.rotation, middle + np.array([*aside, 0.0]))
        for aside in ((dx, dy), (0.0, 0.0), (dx, 0.0), (0.0, dy))
        for R in TURNS
    ]
    plans = [(shifted(way, over * UP), way) for way in ways]
    choice = yield from pick(
        scene,
        name,
        then=plans,
        raised=over,
        leave=AWAY,
        over=config.source.center[2] + TALLEST,
    )
    if choice is None:
        return
    above, at = choice.then
    arm = choice.arm
    yield from carry(scene, arm, name, above, tolerance=0.02, turn_tolerance=0.1)
    yield from carry(
        scene, arm, name, at, tolerance=LANDED, turn_tolerance=0.1, speed=0.15
    )
    yield from release(arm, back=AWAY)
