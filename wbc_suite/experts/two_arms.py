"""Skills of two arms at one object."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from wbc_suite.experts.arm import Arm
from wbc_suite.experts.workcell import Steps, Workcell


def carry_together(
    cell: Workcell,
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
    start = cell.pose(name)
    grips = [start.actInv(arm.pose) for arm in arms]
    shift = goal.translation - start.translation
    angle = pin.log3(goal.rotation @ start.rotation.T)
    far = max(float(np.linalg.norm(shift)) / speed, float(np.linalg.norm(angle)) / turn)
    periods = max(1, round(far / cell.period))
    for k in range(periods + 20):
        share = min(1.0, (k + 1) / periods)
        R = pin.exp3(share * angle) @ start.rotation
        wanted = pin.SE3(R, start.translation + share * shift)
        for arm, grip in zip(arms, grips, strict=True):
            arm.aim(wanted * grip)
        yield
        left = goal.translation - cell.pose(name).translation
        if np.linalg.norm(left) < tolerance:
            return True
    return False
