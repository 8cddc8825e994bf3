"""QP tasks, equality rows and limits out of a whole-body config."""

from collections.abc import Mapping

import numpy as np

from wbc_suite.control.composite.distance_limits import distance_limits
from wbc_suite.control.composite.whole_body_config import (
    HeldFrame,
    WholeBodyIKConfig,
)
from wbc_suite.control.part.feasible_acceleration import (
    feasible_accelerations,
    greatest_loads,
)
from wbc_suite.control.part.stance_controller import soles_of
from wbc_suite.errors import UnknownNameError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    AccelerationLimit,
    FrameEquality,
    Limit,
    PositionLimit,
    SupportLimit,
    VelocityLimit,
    WeightLimit,
)
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Vector

TRACKING_COST = 10.0
"""[cost]/s of tracking a joint-space motion; far above the solver's damping."""


def held_equality(held: HeldFrame) -> FrameEquality:
    """Return the rows that hold a frame."""
    if held.contact == "surface":
        return FrameEquality(held.frame)
    return FrameEquality(held.frame, directions=("x", "y", "z"))


def make_limits(robot: RobotDescription, config: WholeBodyIKConfig) -> list[Limit]:
    """Return the limits of the command."""
    limits = config.limits
    linear, angular = robot.root.velocity
    base_linear, base_angular = base_accelerations(robot, config)
    made: list[Limit] = [
        PositionLimit(margin=limits.position_margin, joints=limits.positions),
        VelocityLimit(
            base_linear=linear, base_angular=angular, scale=limits.velocity_scale
        ),
        AccelerationLimit(
            limits.acceleration,
            joints=joint_accelerations(robot, config),
            base_linear=base_linear,
            base_angular=base_angular,
        ),
    ]
    made += distance_limits(robot, config)
    if limits.weight_shares:
        made.append(WeightLimit(_greatest_weights(robot, limits.weight_shares)))
    soles = soles_of(config.held)
    if soles:
        margin = limits.balance_margin
        made.append(SupportLimit(soles, margin=margin, pressure_margin=0.5 * margin))
    return made


def _greatest_weights(
    robot: RobotDescription, shares: Mapping[str, float]
) -> dict[str, float]:
    efforts = {j.name: j.effort for j in robot.joints if j.effort is not None}
    for name in shares:
        if name not in efforts:
            raise UnknownNameError("joint with a known effort", name, efforts)
    return {name: share * efforts[name] for name, share in shares.items()}


def planar_joints(robot: RobotDescription) -> tuple[str, ...]:
    """Return the joints of a planar root."""
    return robot.root_joint_names if robot.root.kind == "planar" else ()


def joint_accelerations(
    robot: RobotDescription, config: WholeBodyIKConfig
) -> dict[str, float]:
    """Return what each joint can accelerate by a config's limits."""
    limits = config.limits
    return feasible_accelerations(
        robot, most=limits.acceleration, effort_share=limits.effort_share
    )


def base_accelerations(
    robot: RobotDescription, config: WholeBodyIKConfig
) -> tuple[float, float]:
    """Return what a moving root can accelerate, m/s^2 and rad/s^2.

    The config's limits, or what a part of a planar root's motors gives.
    """
    linear, angular = config.limits.base_acceleration
    root = robot.root
    if root.kind == "planar" and root.actuated:
        inertia, _ = greatest_loads(robot.to_pinocchio())
        force, torque = (config.limits.effort_share * effort for effort in root.effort)
        linear = min(linear, force / float(inertia[:2].max()))
        angular = min(angular, torque / float(inertia[2]))
    return linear, angular


def accelerations(
    robot: RobotDescription, config: WholeBodyIKConfig, configuration: Configuration
) -> Vector:
    """Return the acceleration limit of each velocity, shape (nv,)."""
    limits = np.full(configuration.nv, config.limits.acceleration)
    linear, angular = base_accelerations(robot, config)
    limits[configuration.root_linear] = linear
    limits[configuration.root_angular] = angular
    for name, value in joint_accelerations(robot, config).items():
        limits[configuration.model.joints[configuration.joint_id(name)].idx_v] = value
    return limits


def travel_costs(robot: RobotDescription, cost: float) -> dict[str, float]:
    """Return costs that measure joint distances in seconds at full speed.

    Args:
        robot: The reduced robot.
        cost: [cost]/s.
    """
    costs = {j.name: cost / (j.velocity or 10.0) for j in robot.joints}
    linear, angular = robot.root.velocity
    speeds = (linear, linear, angular)
    for name, speed in zip(planar_joints(robot), speeds, strict=False):
        costs[name] = cost / speed
    return costs


def joint_speeds(robot: RobotDescription, configuration: Configuration) -> Vector:
    """Return the speed limit of each velocity."""
    known = np.array(configuration.model.velocityLimit)
    speeds = np.where((known > 0.0) & (known < 1e10), known, 10.0)
    speeds[configuration.root_linear] = robot.root.velocity[0]
    speeds[configuration.root_angular] = robot.root.velocity[1]
    return speeds
