"""The expert of TwoArmPegInHole."""

import itertools
import math

import numpy as np
import pinocchio as pin

from wbc_suite.benchmark.two_arm_peg_in_hole import PEG, PLATE, TwoArmPegInHole
from wbc_suite.experts.arm import Arm
from wbc_suite.experts.scene import ExpertScene, Steps, together
from wbc_suite.experts.skills import carry, move, shifted
from wbc_suite.typing import Vector

BEFORE, INSIDE = 0.20, 0.02  # m, of the plate beyond the peg's middle
ASIDE = 0.12  # m, by which both arms first part
ROLLS = np.linspace(0.0, 2.0 * math.pi, 8, endpoint=False)
ELEVATIONS = (-0.8, -0.4, 0.0)  # rad, of the peg's axis
HEADINGS = (-0.5, 0.0, 0.5)  # rad, from the direction to the other arm


def two_arm_peg_in_hole(scene: ExpertScene[TwoArmPegInHole]) -> Steps[None]:
    """Hold the plate where both arms reach, and put the peg through."""
    peg_arm, plate_arm = scene.arms
    peg, plate = scene.pose(PEG), scene.pose(PLATE)
    middle = (peg.translation + plate.translation) / 2
    before, target = _meeting(scene, middle)
    apart = peg_arm.pose.translation - plate_arm.pose.translation
    away = ASIDE * apart / max(float(np.linalg.norm(apart)), 1e-6)
    yield from together(
        move(peg_arm, shifted(peg_arm.pose, away), tolerance=0.03, most=12),
        move(plate_arm, shifted(plate_arm.pose, -away), tolerance=0.03, most=12),
    )
    yield from together(
        carry(scene, peg_arm, PEG, before, tolerance=0.01),
        carry(scene, plate_arm, PLATE, target, tolerance=0.01),
    )
    relative = target.actInv(before)
    for depth in (BEFORE, INSIDE):
        goal = scene.pose(PLATE) * relative
        axis = goal.rotation[:, 2]
        hole = scene.pose(PLATE).translation
        inside = pin.SE3(goal.rotation, hole - depth * axis)
        yield from carry(scene, peg_arm, PEG, inside, tolerance=0.005, speed=0.3)


def _meeting(
    scene: ExpertScene[TwoArmPegInHole], middle: Vector
) -> tuple[pin.SE3, pin.SE3]:
    """Return poses of the peg, before the hole, and of the plate, that suit both."""
    peg_arm, plate_arm = scene.arms
    across = plate_arm.pose.translation - peg_arm.pose.translation
    heading = math.atan2(across[1], across[0])
    best, found = math.inf, None
    for turn, rise in itertools.product(HEADINGS, ELEVATIONS):
        c, s = math.cos(heading + turn), math.sin(heading + turn)
        axis = np.array([c * math.cos(rise), s * math.cos(rise), math.sin(rise)])
        pegs = [pin.SE3(_along(axis, roll), middle) for roll in ROLLS]
        plates = [pin.SE3(_along(-axis, roll), middle) for roll in ROLLS]
        cost, peg = _easiest(scene, peg_arm, PEG, pegs, (-BEFORE * axis, 0.0 * axis))
        other, plate = _easiest(scene, plate_arm, PLATE, plates, (0.0 * axis,))
        if cost + other < best:
            best, found = cost + other, (shifted(peg, -BEFORE * axis), plate)
    assert found is not None
    return found


def _easiest(
    scene: ExpertScene[TwoArmPegInHole],
    arm: Arm,
    name: str,
    poses: list[pin.SE3],
    offsets: tuple[Vector, ...],
) -> tuple[float, pin.SE3]:
    """Return the pose of a fixed object that its arm reaches best, with its cost."""
    held = scene.pose(name).actInv(arm.pose)
    costs = [
        arm.look_ahead([shifted(pose, o) * held for o in offsets]).cost
        for pose in poses
    ]
    k = int(np.argmin(costs))
    return costs[k], poses[k]


def _along(axis: Vector, roll: float) -> np.ndarray:
    """Return a rotation whose z axis is along a unit vector, rolled by an angle."""
    x = np.cross((0.0, 0.0, 1.0) if abs(axis[2]) < 0.9 else (1.0, 0.0, 0.0), axis)
    x /= np.linalg.norm(x)
    R = np.column_stack([x, np.cross(axis, x), axis])
    return R @ pin.exp3(np.array([0.0, 0.0, roll]))
