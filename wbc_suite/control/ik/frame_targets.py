"""Controlled frames and the posture: from goals to the targets of one tick.

Targets are near enough that the robot can brake for them; the QP solves for them. Poses
are rows [R p] of 3 by 4 numbers, shape (12,).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.compiling import as_argument, compiled, compiled_inline, inner, struct
from wbc_suite.control.ik.config import WholeBodyIKConfig
from wbc_suite.control.law.approach import approach_pose, approach_speed
from wbc_suite.control.poses import pose_of, row_of, write_frame_pose, write_turn
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.forward import (
    JointKind,
    RobotArrays,
    compute_com,
    compute_joint_poses,
)
from wbc_suite.linear_algebra import copy_vector
from wbc_suite.qp.lie import log3
from wbc_suite.typing import Indices, Matrix, Vector

CENTRE_OF_MASS = -1
"""Stands for the joint of the centre of mass, which has none."""


@struct
class FrameArrays(NamedTuple):
    """The controlled frames, a row for each.

    Attributes:
        joint: Joint that carries the frame, or `CENTRE_OF_MASS`.
        offset: Pose in the joint, shape (n, 12).
        counted: Components of the error that count, 0 or 1, shape (n, 6).
        gain: Fraction of the error that one solve removes.
        max_speed: Greatest speeds towards the goal, m/s and rad/s, shape (n, 2).
        braking: Decelerations towards the goal, m/s^2 and rad/s^2, shape (n, 2).
        level: Strict priority.
        tolerance: Errors that count as none, m and rad, shape (2,).
        pose: Present poses in the world, shape (n, 12).
        goal: Goals in the world, shape (n, 12).
        target: Targets of this tick in the world, shape (n, 12).
        error: Position error (world axes) and rotation vector (own axes), (n, 6).
        distance: Lengths of the components that count, m and rad, shape (n, 2).
    """

    joint: Indices
    offset: Matrix
    counted: Matrix
    gain: Vector
    max_speed: Matrix
    braking: Matrix
    level: Indices
    tolerance: Vector
    pose: Matrix
    goal: Matrix
    target: Matrix
    error: Matrix
    distance: Matrix


@struct
class PostureArrays(NamedTuple):
    """The preferred posture.

    Attributes:
        goal: The posture, shape (nq,).
        target: Target of this tick, shape (nq,); a free root stays.
        max_speed: Greatest speeds, shape (nv,).
        braking: Decelerations towards the posture, shape (nv,).
    """

    goal: Vector
    target: Vector
    max_speed: Vector
    braking: Vector


@compiled_inline
def write_targets(
    robot: RobotArrays,
    frames: FrameArrays,
    posture: PostureArrays,
    dt: float,
    settling: float,
    half_speed_error: float,
    has_arrived: bool,
) -> float:
    """Write the targets of frames and posture, on straight lines to their goals.

    Poses and errors of the frames are written too. `settling` is the time constant of
    the end of the posture's motion, s; `has_arrived` says whether level 0 has been at
    its goals before. See `lower_level_rate` for `half_speed_error`.

    Returns:
        The greatest error of level 0, as a multiple of the tolerance.
    """
    error = measure_frames(robot, frames)
    rate = 1.0
    if has_arrived or error < 1.0:
        rate = lower_level_rate(error, half_speed_error)
    _write_frame_targets(frames, dt, rate)
    _write_posture_target(robot, posture, settling, rate)
    return error


@inner
def lower_level_rate(error: float, half_speed_error: float) -> float:
    """Return the fraction of its speed that a lower level may use, 0 to 1.

    It is a half where the greatest error of level 0, as a multiple of the tolerance, is
    `half_speed_error`; where that is 0, it is always 1.
    """
    if half_speed_error <= 0.0:
        return 1.0
    return 1.0 / (1.0 + (error / half_speed_error) ** 2)


@compiled
def measure_frames(robot: RobotArrays, frames: FrameArrays) -> float:
    """Write poses, errors and distances; return what `write_targets` does."""
    compute_joint_poses(robot)
    worst, turn = 0.0, np.empty((3, 3))
    for k in range(frames.joint.shape[0]):
        pose, goal, error = frames.pose[k], frames.goal[k], frames.error[k]
        if frames.joint[k] == CENTRE_OF_MASS:
            compute_com(robot)
            for i in range(3):
                pose[4 * i + 3] = robot.com[i]
        else:
            write_frame_pose(robot.pose[frames.joint[k]], frames.offset[k], pose)
        for i in range(3):
            error[i] = goal[4 * i + 3] - pose[4 * i + 3]
        write_turn(pose, goal, turn)
        log3(turn, error[3:])
        for part in range(2):
            square = 0.0
            for i in range(3 * part, 3 * part + 3):
                square += frames.counted[k, i] * error[i] * error[i]
            frames.distance[k, part] = np.sqrt(square)
            if frames.level[k] == 0:
                worst = max(worst, frames.distance[k, part] / frames.tolerance[part])
    return worst


@inner
def _write_frame_targets(frames: FrameArrays, dt: float, rate: float) -> None:
    """Write targets on the way to the goals.

    The rate is the fraction of its speed that a frame below level 0 may use.
    """
    for k in range(frames.joint.shape[0]):
        share = rate if frames.level[k] > 0 else 1.0
        approach_pose(
            frames.pose[k],
            frames.error[k],
            dt,
            frames.gain[k],
            share,
            frames.max_speed[k],
            frames.braking[k],
            frames.target[k],
        )


@inner
def _write_posture_target(
    robot: RobotArrays, posture: PostureArrays, settling: float, rate: float
) -> None:
    """Write the next posture; every joint moves by itself."""
    copy_vector(robot.q, posture.target)
    for j in range(1, robot.joints.shape[0]):
        joint = robot.joints[j]
        if joint.kind == JointKind.FREE:
            continue
        q, v = joint.q_start, joint.v_start
        difference = float(posture.goal[q] - robot.q[q])
        max_speed = float(rate * posture.max_speed[v])
        braking = float(posture.braking[v])
        posture.target[q] += posture_step(difference, settling, max_speed, braking)


@compiled
def posture_step(
    difference: float, settling: float, max_speed: float, braking: float
) -> float:
    """Return the step of one joint towards its goal, rad or m.

    It is that of `settling` seconds, the time constant of the end of the motion.
    """
    speed = min(approach_speed(abs(difference), settling, braking), max_speed)
    return settling * speed if difference > 0.0 else -settling * speed


class ControlledFrames:
    """Owner of the arrays of controlled frames on one configuration, which it reads.

    Acceleration limits have shape (nv,).

    Attributes:
        arrays: Arrays of the frames.
        posture: Arrays of the preferred posture.
        argument: The argument of kernels that stands for `arrays`.
        posture_argument: That for `posture`.
    """

    def __init__(
        self,
        config: WholeBodyIKConfig,
        configuration: Configuration,
        accelerations: Vector | None = None,
    ) -> None:
        self._configuration = configuration
        self.arrays = _frame_arrays(config, configuration)
        braking = np.ones(configuration.nv) if accelerations is None else accelerations
        self.posture = PostureArrays(
            goal=configuration.q.copy(),
            target=configuration.q.copy(),
            max_speed=np.full(configuration.nv, config.posture.speed),
            braking=config.posture.braking * braking,
        )
        self.argument = as_argument(self.arrays)
        self.posture_argument = as_argument(self.posture)

    def pose(self, k: int) -> pin.SE3:
        """Return the present pose of a frame."""
        measure_frames(self._configuration.robot, self.argument)
        return pose_of(self.arrays.pose[k])

    def measure(self, goals: Sequence[pin.SE3]) -> Matrix:
        """Set the goals in the world, and return distances from them.

        They are those that count for each frame's kind, m and rad, shape (n, 2): a
        buffer.
        """
        self.arrays.goal[:] = [row_of(goal) for goal in goals]
        measure_frames(self._configuration.robot, self.argument)
        return self.arrays.distance


def _frame_arrays(
    config: WholeBodyIKConfig, configuration: Configuration
) -> FrameArrays:
    frames, n = config.frames, len(config.frames)
    joint = np.full(n, CENTRE_OF_MASS, dtype=np.int64)
    offset = np.tile(row_of(pin.SE3.Identity()), (n, 1))
    for k, frame in enumerate(frames):
        if frame.frame is not None:
            found = configuration.model.frames[configuration.frame_id(frame.frame)]
            joint[k], offset[k] = found.parentJoint, row_of(found.placement)
    return FrameArrays(
        joint=joint,
        offset=offset,
        counted=np.array([f.behaviour.counted for f in frames], dtype=float),
        gain=np.array([f.gain for f in frames]),
        max_speed=np.array([(f.max_linear_speed, f.max_angular_speed) for f in frames]),
        braking=np.array([(f.linear_braking, f.angular_braking) for f in frames]),
        level=np.array([f.level for f in frames], dtype=np.int64),
        tolerance=np.array(config.tolerance, dtype=float),
        pose=offset.copy(),
        goal=np.zeros((n, 12)),
        target=np.zeros((n, 12)),
        error=np.zeros((n, 6)),
        distance=np.zeros((n, 2)),
    )
