"""What motors can do: feasible accelerations, and leads of commands."""

from collections.abc import Collection

import numpy as np
import pinocchio as pin

from wbc_suite import logs
from wbc_suite.errors import join_first
from wbc_suite.kinematics.configuration import random_configuration
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Vector

LOG = logs.logger(__name__)

LOAD_SAMPLES = 50
WEIGHT_SHARE = 0.9  # of the effort of a motor that cannot hold every posture
LEAST_ACCELERATION = 0.2
"""rad/s^2 or m/s^2, where holding the load takes nearly the whole effort: 1 rad from
rest to rest in 4.5 s. With 2 the torso of Galaxea R1 could not brake, and fell."""
LEAD = 2.0
"""Inertia is less than its greatest in most postures; with 1, TIAGo's arms give up
early where a pot jams them."""


def feasible_accelerations(
    robot: RobotDescription, *, most: float, effort_share: float
) -> dict[str, float]:
    """Return the feasible acceleration of each joint, rad/s^2 or m/s^2.

    The least of a common limit, the robot's own, and a share of the motor's effort,
    less the greatest gravity torque, over the greatest inertia M_ii of random
    configurations. It is at least `LEAST_ACCELERATION`.
    """
    of_motors, found = _accelerations_of_motors(robot), dict[str, float]()
    for joint in robot.joints:
        limit = most if joint.acceleration is None else min(most, joint.acceleration)
        if joint.name in of_motors:
            feasible = effort_share * of_motors[joint.name]
            limit = min(limit, max(feasible, LEAST_ACCELERATION))
        found[joint.name] = limit
    return found


def greatest_leads(robot: RobotDescription, stiffness: float) -> dict[str, float]:
    """Return by how much a command may lead its joint, rad or m, by joint.

    It is `LEAD` times the error at which feedback of a stiffness, 1/s^2, takes all that
    weight leaves of the motor's effort, at the greatest inertia. With more the joint
    gains no force, and its neighbours compensate for an acceleration that does not
    happen. Joints whose effort is unknown are left out.
    """
    of_motors = _accelerations_of_motors(robot)
    return {joint: LEAD * a / stiffness for joint, a in of_motors.items()}


def _accelerations_of_motors(robot: RobotDescription) -> dict[str, float]:
    """Return what weight leaves of each effort, a fifth at least, over the inertia."""
    model = robot.to_pinocchio()
    inertia, weight = greatest_loads(model)
    found: dict[str, float] = {}
    for joint in robot.joints:
        if joint.effort is not None:
            v = model.joints[model.getJointId(joint.name)].idx_v
            left = max(joint.effort - float(weight[v]), 0.2 * joint.effort)
            found[joint.name] = left / float(inertia[v])
    return found


def weight_shares(
    robot: RobotDescription, *, without: Collection[str] = ()
) -> dict[str, float]:
    """Return the share of its effort that holding still may take, by joint.

    Joints are listed whose gravity torque is greater than their motor's effort in some
    of 50 random configurations, but those of some groups.
    """
    left_out = {j for group in without for j in robot.groups.get(group, ())}
    model = robot.to_pinocchio()
    _, weight = greatest_loads(model)
    weak = [
        joint.name
        for joint in robot.joints
        if joint.effort and joint.independent and joint.name not in left_out
        if weight[model.joints[model.getJointId(joint.name)].idx_v] > joint.effort
    ]
    if weak:
        names = join_first([f"'{name}'" for name in weak])
        LOG.warning("%s: motors cannot hold every posture: %s.", robot.name, names)
    return dict.fromkeys(weak, WEIGHT_SHARE)


def greatest_loads(model: pin.Model) -> tuple[Vector, Vector]:
    """Return the greatest inertia and gravity torque of each joint, over postures."""
    data = model.createData()
    inertia, weight = np.zeros(model.nv), np.zeros(model.nv)
    rng = np.random.default_rng(0)
    for _ in range(LOAD_SAMPLES):
        q = random_configuration(model, pin.neutral(model), rng)
        np.maximum(inertia, np.diag(pin.crba(model, data, q)), out=inertia)
        gravity = pin.computeGeneralizedGravity(model, data, q)
        np.maximum(weight, np.abs(gravity), out=weight)
    return inertia, weight
