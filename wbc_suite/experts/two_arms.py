"""Skills of two arms at one object."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from wbc_suite.experts.arm import Arm
from wbc_suite.experts.scene import ExpertScene, Steps
from wbc_suite.experts.skills import UP, shifted
from wbc_suite.typing import Vector

RAISED = 0.08  # m, of hands while a base drives
LONGEST_WAIT = 100  # control periods


def carry_together(
    scene: ExpertScene,
    arms: Sequence[Arm],
    name: str,
    goal: pin.SE3,
    *,
    speed: float = 0.15,
    turn: float = 0.5,
    tolerance: float = 0.01,
) -> Steps[bool]:
    """Bring an object that arms hold to a pose; their hands keep their relative pose.

    Speeds in m/s and rad/s. Returns whether the object got within the tolerance, m.
    """
    start = scene.pose(name)
    grips = [start.actInv(arm.pose) for arm in arms]
    shift = goal.translation - start.translation
    angle = pin.log3(goal.rotation @ start.rotation.T)
    far = max(float(np.linalg.norm(shift)) / speed, float(np.linalg.norm(angle)) / turn)
    periods = max(1, round(far / scene.period))
    for k in range(periods + 20):
        share = min(1.0, (k + 1) / periods)
        R = pin.exp3(share * angle) @ start.rotation
        wanted = pin.SE3(R, start.translation + share * shift)
        for arm, grip in zip(arms, grips, strict=True):
            arm.aim(wanted * grip)
        yield
        left = goal.translation - scene.pose(name).translation
        if np.linalg.norm(left) < tolerance:
            return True
    return False


def drive_before(
    scene: ExpertScene, name: str, arms: Sequence[Arm], sites: Sequence[str]
) -> Steps[bool]:
    """Drive a base to where two hands reach an object; return whether it arrived.

    Does nothing for robots without. Hands keep their poses in the base, but raised.

    Args:
        scene: The scene.
        name: The object.
        arms: The right and the left arm.
        sites: Where each will grasp the object.
    """
    base = scene.base(arms[0].state)
    if base is None:
        return True
    right, left = map(scene.point, sites)

    def free(q: Vector) -> bool:
        return scene.overlap(arms[0], q, but=name) == 0.0

    base.go_before(scene.pose(name).translation, left - right, free)
    held = [base.pose.actInv(shifted(arm.pose, RAISED * UP)) for arm in arms]
    for arm in arms:
        arm.keep_base()
    for _ in range(LONGEST_WAIT):
        for arm, grip in zip(arms, held, strict=True):
            arm.aim(base.pose * grip)
        yield
        if base.arrived:
            return True
    return False
