"""QP tasks, equality rows and limits out of a whole-body config."""

from collections.abc import Mapping

import numpy as np
import pinocchio as pin

from wbc_suite.control.composite.clearance import self_collision_limit
from wbc_suite.control.composite.config import (
    ControlledFrame,
    HeldFrame,
    WholeBodyIKConfig,
)
from wbc_suite.control.composite.postures import random_posture
from wbc_suite.errors import UnknownNameError
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    AccelerationLimit,
    ComTask,
    FrameEquality,
    FrameTask,
    Limit,
    PositionLimit,
    Sole,
    SupportLimit,
    VelocityLimit,
    WeightLimit,
)
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Vector

__all__ = [
    "HURRY",
    "frame_costs",
    "held_equality",
    "joint_accelerations",
    "joint_speeds",
    "make_limits",
    "make_task",
    "planar_joints",
    "soles_of",
]

LOAD_SAMPLES = 50
LEAST_ACCELERATION = 2.0
"""rad/s^2 or m/s^2; for motors that hardly carry their load."""

HURRY = 1e3
"""Speed limit, m/s and rad/s, of tasks that something else slows."""


def frame_costs(frame: ControlledFrame) -> tuple[Vector, Vector]:
    """Return costs of position (world axes) and orientation (the frame's axes)."""
    position = np.full(3, frame.position_cost)
    orientation = np.full(3, frame.orientation_cost)
    match frame.kind:
        case "orientation":
            position[:] = 0.0
        case "position":
            orientation[:] = 0.0
        case "base":
            position[2] = orientation[0] = orientation[1] = 0.0
    return position, orientation


def make_task(frame: ControlledFrame, *, unhurried: bool = True) -> FrameTask | ComTask:
    """Return the QP task of a controlled frame.

    Args:
        frame: The frame.
        unhurried: False asks for the whole error in one step, all frames alike.
    """
    gain, level = frame.gain, frame.level
    if not unhurried:
        gain, level = 1.0, 0
        frame = frame.model_copy(update={"position_cost": 1.0, "orientation_cost": 1.0})
    if frame.frame is None:
        return ComTask(
            frame.position_cost,
            gain=gain,
            level=level,
            max_speed=HURRY,
            name=frame.name,
        )
    position, orientation = frame_costs(frame)
    return FrameTask(
        frame.frame,
        position_cost=position,
        orientation_cost=orientation,
        gain=gain,
        level=level,
        max_linear_speed=HURRY,
        max_angular_speed=HURRY,
        name=frame.name,
    )


def held_equality(held: HeldFrame) -> FrameEquality:
    """Return the rows that hold a frame."""
    if held.contact == "surface":
        return FrameEquality(held.frame)
    return FrameEquality(held.frame, directions=("x", "y", "z"))


def make_limits(robot: RobotDescription, config: WholeBodyIKConfig) -> list[Limit]:
    """Return the limits of the command."""
    limits = config.limits
    linear, angular = robot.root.velocity
    base_linear, base_angular = limits.base_acceleration
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
    if limits.self_collision:
        made.append(self_collision_limit(robot, config))
    if limits.weight_shares:
        made.append(WeightLimit(_greatest_weights(robot, limits.weight_shares)))
    soles = soles_of(config)
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


def soles_of(config: WholeBodyIKConfig) -> list[Sole]:
    """Return what the robot stands on; nothing unless all of it is known."""
    soles = [
        Sole(frame=held.frame, x=held.sole[:2], y=held.sole[2:])
        for held in config.held
        if held.sole is not None
    ]
    return soles if len(soles) == len(config.held) else []


def planar_joints(robot: RobotDescription) -> tuple[str, ...]:
    """Return the joints of a planar root."""
    return robot.root_joint_names if robot.root.kind == "planar" else ()


def joint_accelerations(
    robot: RobotDescription, config: WholeBodyIKConfig
) -> dict[str, float]:
    """Return what each joint can accelerate, rad/s^2 or m/s^2.

    The least of the config's limit, the robot's own, and what a part of the motor's
    effort gives where it has most to move: the greatest inertia M_ii of random
    configurations, after the greatest weight. Some acceleration is left in any case.
    """
    model = robot.to_pinocchio()
    inertia, weight = _greatest_loads(model)
    found: dict[str, float] = {}
    for joint in robot.joints:
        limit = config.limits.acceleration
        if joint.acceleration is not None:
            limit = min(limit, joint.acceleration)
        if joint.effort is not None:
            v = model.joints[model.getJointId(joint.name)].idx_v
            left = max(joint.effort - float(weight[v]), 0.2 * joint.effort)
            able = config.limits.effort_share * left / float(inertia[v])
            limit = min(limit, max(able, LEAST_ACCELERATION))
        found[joint.name] = limit
    return found


def _greatest_loads(model: pin.Model) -> tuple[Vector, Vector]:
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


def joint_speeds(robot: RobotDescription, configuration: Configuration) -> Vector:
    """Return the speed limit of each velocity."""
    known = np.array(configuration.model.velocityLimit)
    speeds = np.where((known > 0.0) & (known < 1e10), known, 10.0)
    speeds[configuration.root_linear] = robot.root.velocity[0]
    speeds[configuration.root_angular] = robot.root.velocity[1]
    return speeds
