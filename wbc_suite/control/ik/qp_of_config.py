"""QP tasks, equality rows and limits out of a whole-body config."""

from collections.abc import Mapping

import numpy as np
import pinocchio as pin

from wbc_suite.control.ground.feasible_acceleration import (
    feasible_accelerations,
    greatest_loads,
)
from wbc_suite.control.ik.config import (
    HeldFrame,
    WholeBodyIKConfig,
)
from wbc_suite.control.ik.reduced_robot import joint_indices, planar_joints
from wbc_suite.control.part.stance_controller import soles_of
from wbc_suite.errors import UnknownNameError
from wbc_suite.kinematics import Configuration
from wbc_suite.planning import LimitChecker
from wbc_suite.qp import (
    AccelerationLimit,
    FloorLimit,
    FrameEquality,
    Limit,
    PositionLimit,
    SelfCollisionLimit,
    SupportLimit,
    VelocityLimit,
    WeightLimit,
)
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.collision_capsules import (
    collision_pairs,
    collision_spheres,
    enclosing_capsules,
)
from wbc_suite.typing import Vector

TRACKING_COST = 10.0
"""[cost]/s of tracking a joint-space motion; far above the solver's damping."""


MAX_NEIGHBOUR_JOINTS = 1
"""Links with at most this many joints between them are kept apart by joint limits."""


def held_equality(held: HeldFrame) -> FrameEquality:
    """Return the rows that hold a frame."""
    if held.contact == "surface":
        return FrameEquality(held.frame)
    turning = ("pitch", "yaw") if held.contact == "line" else ()
    return FrameEquality(held.frame, directions=("x", "y", "z", *turning))


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
    made += [*distance_limits(robot, config), *weight_limits(robot, config)]
    soles = soles_of(config.held)
    if soles:
        margin = limits.balance_margin
        made.append(SupportLimit(soles, margin=margin, pressure_margin=0.5 * margin))
    return made


def weight_limits(
    robot: RobotDescription, config: WholeBodyIKConfig
) -> list[WeightLimit]:
    """Return the limit of what some motors hold, if the config has one."""
    shares, rate = config.limits.weight_shares, config.limits.weight_rate
    return [WeightLimit(_greatest_weights(robot, shares), rate)] if shares else []


def limit_checker(
    robot: RobotDescription, config: WholeBodyIKConfig, model: pin.Model
) -> LimitChecker:
    """Return what checks the limits of distances and weights along a path."""
    distances = distance_limits(robot, config)
    return LimitChecker(model, distances, weight_limits(robot, config))


def _greatest_weights(
    robot: RobotDescription, shares: Mapping[str, float]
) -> dict[str, float]:
    efforts = {j.name: j.effort for j in robot.joints if j.effort is not None}
    for name in shares:
        if name not in efforts:
            raise UnknownNameError("joint with a known effort", name, efforts)
    return {name: share * efforts[name] for name, share in shares.items()}


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
    joints = joint_accelerations(robot, config)
    _, v = joint_indices(configuration.model, tuple(joints))
    limits[v] = list(joints.values())
    return limits


def travel_costs(robot: RobotDescription, cost: float) -> dict[str, float]:
    """Return costs that measure joint distances in seconds at full speed, [cost]/s."""
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


def distance_limits(
    robot: RobotDescription, config: WholeBodyIKConfig
) -> list[SelfCollisionLimit | FloorLimit]:
    """Return the limits that keep a robot's links apart and off the floor."""
    limits: list[SelfCollisionLimit | FloorLimit] = []
    if config.limits.self_collision:
        limits.append(_self_collision_limit(robot, config))
    if config.held:
        limits.append(_floor_limit(robot, config))
    return limits


def _floor_limit(robot: RobotDescription, config: WholeBodyIKConfig) -> FloorLimit:
    """Return the limit that keeps all links but the legs off the floor.

    Another contact with the floor would take load off the feet, which then slip. Links
    below a held one, such as the wheel of a leg, are part of the foot.
    """
    spheres = collision_spheres(robot)
    feet = {robot.link_of(held.frame) for held in config.held}
    for link in robot.links:
        if link.parent in feet:
            feet.add(link.name)
    for foot in feet:
        link = robot.link(foot)
        while link.parent is not None:
            spheres.pop(link.name, None)
            link = robot.link(link.parent)
    return FloorLimit(
        spheres,
        height=config.limits.floor,
        nearest=config.limits.collision_pairs,
        margin=config.limits.collision_distance,
    )


def _self_collision_limit(
    robot: RobotDescription, config: WholeBodyIKConfig
) -> SelfCollisionLimit:
    """Return the limit that keeps a robot's links apart.

    Capsules that overlap at the posture are left out.
    """
    configuration = Configuration(robot.to_pinocchio())
    support = configuration.support
    pairs = [
        (first, second)
        for first, second in sorted(tuple(sorted(p)) for p in collision_pairs(robot))
        if len(np.setxor1d(support(first), support(second))) > MAX_NEIGHBOUR_JOINTS
    ]
    limit = SelfCollisionLimit(
        enclosing_capsules(robot),
        pairs,
        nearest=config.limits.collision_pairs,
        margin=config.limits.collision_distance,
    )
    limit.bind(configuration)
    name = config.posture.keyframe
    if name in robot.keyframes:
        configuration.update(configuration.model.referenceConfigurations[name])
    limit.drop_touching(configuration)
    return limit
