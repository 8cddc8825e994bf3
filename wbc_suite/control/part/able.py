"""What the motors of a robot can accelerate."""

import numpy as np
import pinocchio as pin

from wbc_suite.control.part.postures import random_posture
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Vector

__all__ = ["able_accelerations", "greatest_loads"]

LOAD_SAMPLES = 50
LEAST_ACCELERATION = 2.0
"""rad/s^2 or m/s^2; for motors that hardly carry their load."""


def able_accelerations(
    robot: RobotDescription, *, most: float, effort_share: float
) -> dict[str, float]:
    """Return what each joint can accelerate, rad/s^2 or m/s^2.

    The least of a limit, the robot's own, and what a part of the motor's effort gives
    where it has most to move: the greatest inertia M_ii of random configurations,
    after the greatest weight. Some acceleration is left in any case.

    Args:
        robot: The robot.
        most: The limit of all joints.
        effort_share: The part of the effort.
    """
    model = robot.to_pinocchio()
    inertia, weight = greatest_loads(model)
    found: dict[str, float] = {}
    for joint in robot.joints:
        limit = most
        if joint.acceleration is not None:
            limit = min(limit, joint.acceleration)
        if joint.effort is not None:
            v = model.joints[model.getJointId(joint.name)].idx_v
            left = max(joint.effort - float(weight[v]), 0.2 * joint.effort)
            able = effort_share * left / float(inertia[v])
            limit = min(limit, max(able, LEAST_ACCELERATION))
        found[joint.name] = limit
    return found


def greatest_loads(model: pin.Model) -> tuple[Vector, Vector]:
    """Return the greatest inertia and weight at each joint, over random postures."""
    data = model.createData()
    inertia, weight = np.zeros(model.nv), np.zeros(model.nv)
    rng = np.random.default_rng(0)
    for _ in range(LOAD_SAMPLES):
        q = random_posture(model, pin.neutral(model), rng)
        np.maximum(inertia, np.diag(pin.crba(model, data, q)), out=inertia)
        gravity = pin.computeGeneralizedGravity(model, data, q)
        np.maximum(weight, np.abs(gravity), out=weight)
    return inertia, weight
