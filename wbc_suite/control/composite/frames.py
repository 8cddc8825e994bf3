"""Where controlled frames are, how far from their goals, and what to ask for next."""

from collections.abc import Sequence
from enum import IntEnum

import numpy as np
import pinocchio as pin

from wbc_suite.compiling import compiled
from wbc_suite.control.composite.config import WholeBodyIKConfig
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.array_table import ArrayTable, indices, matrix, vector
from wbc_suite.kinematics.forward import RobotField, place_joints, weigh_joints
from wbc_suite.qp.lie import exp3, log3
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["ControlledFrames", "JointField", "approach_joints"]

_COM = -1
"""Stands for the joint of the centre of mass, which has none."""

_COUNTED = {
    "pose": (1, 1, 1, 1, 1, 1),
    "position": (1, 1, 1, 0, 0, 0),
    "orientation": (0, 0, 0, 1, 1, 1),
    "com": (1, 1, 1, 0, 0, 0),
    "base": (1, 1, 0, 0, 0, 1),
}
"""Which components of its error count for a frame's kind."""


class FrameField(IntEnum):
    """Arrays of the controlled frames, a row for each; see `ControlledFrames`.

    Joint, and the frame's place in it; counted components; what `approach_speed` is
    told (gain, greatest speeds, decelerations); level; present pose, goal and target;
    error in position and rotation vector; distances that count; tolerances of all.
    """

    JOINT = 0
    OFFSET = 1
    COUNTED = 2
    LAW = 3
    LEVEL = 4
    POSE = 5
    GOAL = 6
    TARGET = 7
    ERROR = 8
    DISTANCE = 9
    TOLERANCE = 10


class JointField(IntEnum):
    """Arrays of joints on their way to a posture, shape (nv,); see `approach_joints`.

    How far they are from it, greatest speeds, decelerations; the step to take.
    """

    DIFFERENCE = 0
    SPEED = 1
    BRAKING = 2
    STEP = 3


class ControlledFrames:
    """The controlled frames of a whole-body controller on one configuration.

    Args:
        config: Controlled frames.
        configuration: The robot; read.

    Attributes:
        off: How far the frames of level 0 were from their goals at the last `measure`,
            as a multiple of the tolerances; the worst of them.
    """

    def __init__(self, config: WholeBodyIKConfig, configuration: Configuration) -> None:
        self._configuration, frames = configuration, config.frames
        count = len(frames)
        joint: Indices = np.full(count, _COM, dtype=np.int64)
        offset: Matrix = np.tile(_rows(pin.SE3.Identity()), (count, 1))
        for k, frame in enumerate(frames):
            if frame.frame is not None:
                found = configuration.model.frames[configuration.frame_id(frame.frame)]
                joint[k], offset[k] = found.parentJoint, _rows(found.placement)
        self._poses: Matrix = np.zeros((count, 12))
        self._goals: Matrix = np.zeros((count, 12))
        self._targets: Matrix = np.zeros((count, 12))
        self._distances: Matrix = np.zeros((count, 2))
        self._known: Sequence[pin.SE3] = ()
        self.off = 0.0
        law = [
            [
                *(frame.gain, frame.max_linear_speed, frame.max_angular_speed),
                *(frame.linear_braking, frame.angular_braking),
            ]
            for frame in frames
        ]
        f = FrameField
        self._arrays = ArrayTable(
            FrameField,
            {
                f.JOINT: joint,
                f.OFFSET: offset,
                f.COUNTED: np.array([_COUNTED[f.kind] for f in frames], dtype=float),
                f.LAW: np.array(law),
                f.LEVEL: np.array([f.level for f in frames], dtype=np.int64),
                f.POSE: self._poses,
                f.GOAL: self._goals,
                f.TARGET: self._targets,
                f.ERROR: np.zeros((count, 6)),
                f.DISTANCE: self._distances,
                f.TOLERANCE: np.array(config.tolerance, dtype=float),
            },
        )
        self._table = self._arrays.table

    def pose(self, k: int) -> pin.SE3:
        """Return the present pose of a frame."""
        _measure(self._configuration.table, self._table)
        T = self._poses[k].reshape(3, 4)
        return pin.SE3(T[:, :3], T[:, 3])

    def measure(self, goals: Sequence[pin.SE3]) -> Matrix:
        """Return distances from goals that count for each frame's kind.

        Args:
            goals: In the world. The same list is taken to hold the same goals.

        Returns:
            Distances, m and rad, shape (n, 2). A buffer.
        """
        self._know(goals)
        self.off = _measure(self._configuration.table, self._table)
        return self._distances

    def lead(
        self,
        goals: Sequence[pin.SE3],
        joints: Indices,
        dt: float,
        *,
        settling: float,
        stray: float,
        arrived: bool,
    ) -> Matrix:
        """Return the poses to ask for now, and write the steps of joints; measures too.

        Args:
            goals: See `measure`.
            joints: Table of `JointField`.
            dt: Step, s.
            settling: Time constant of the last part of the joints' way, s.
            stray: See `pace_below`.
            arrived: Whether level 0 has been at its goals before.

        Returns:
            Rows of [R p] of each frame, shape (n, 12), see `approach_pose`. A buffer.
        """
        self._know(goals)
        robot = self._configuration.table
        self.off = _lead(robot, self._table, joints, dt, settling, stray, arrived)
        return self._targets

    def _know(self, goals: Sequence[pin.SE3]) -> None:
        if goals is not self._known:
            for row, goal in zip(self._goals, goals, strict=True):
                row[:] = _rows(goal)
            self._known = goals


def _rows(T: pin.SE3) -> Vector:
    return T.homogeneous.ravel()[:12]


@compiled
def _lead(
    robot: Indices,
    frames: Indices,
    joints: Indices,
    dt: float,
    settling: float,
    stray: float,
    arrived: bool,
) -> float:
    """Do what `ControlledFrames.lead` does; return `ControlledFrames.off`."""
    off = _measure(robot, frames)
    pace = pace_below(off, stray) if arrived or off < 1.0 else 1.0
    _approach(frames, dt, pace)
    approach_joints(
        vector(joints, JointField.DIFFERENCE),
        settling,
        pace,
        vector(joints, JointField.SPEED),
        vector(joints, JointField.BRAKING),
        vector(joints, JointField.STEP),
    )
    return off


@compiled
def pace_below(off: float, stray: float) -> float:
    """Return how much of its speed a lower level may take, 0 to 1.

    Args:
        off: How far level 0 is from its goals, as a multiple of the tolerances.
        stray: So far off it has half its speed; 0: always all of it.
    """
    return 1.0 / (1.0 + (off / stray) ** 2) if stray > 0.0 else 1.0


@compiled
def _measure(robot: Indices, frames: Indices) -> float:
    """Write poses, errors and distances; poses and goals are [R p] row by row.

    Args:
        robot: Table of `RobotField`.
        frames: Table of `FrameField`.

    Returns:
        `ControlledFrames.off`.
    """
    place_joints(robot)
    joints, levels = (
        indices(frames, FrameField.JOINT),
        indices(frames, FrameField.LEVEL),
    )
    tolerance, off = vector(frames, FrameField.TOLERANCE), 0.0
    errors, distances = (
        matrix(frames, FrameField.ERROR),
        matrix(frames, FrameField.DISTANCE),
    )
    poses, goals = matrix(frames, FrameField.POSE), matrix(frames, FrameField.GOAL)
    offsets, counted = (
        matrix(frames, FrameField.OFFSET),
        matrix(frames, FrameField.COUNTED),
    )
    placements, E = matrix(robot, RobotField.PLACEMENT), np.empty((3, 3))
    for k in range(joints.shape[0]):
        X, goal, error = poses[k], goals[k], errors[k]
        if joints[k] == _COM:
            weigh_joints(robot)
            com = vector(robot, RobotField.COM)
            for i in range(3):
                for j in range(3):
                    X[4 * i + j] = 1.0 if i == j else 0.0
                X[4 * i + 3] = com[i]
        else:
            _place(placements[joints[k]], offsets[k], X)
        for i in range(3):
            error[i] = goal[4 * i + 3] - X[4 * i + 3]
            for j in range(3):
                E[i, j] = X[i] * goal[j]
                E[i, j] += X[4 + i] * goal[4 + j] + X[8 + i] * goal[8 + j]
        log3(E, error[3:])
        for part in range(2):
            square = 0.0
            for i in range(3 * part, 3 * part + 3):
                square += counted[k, i] * error[i] * error[i]
            distances[k, part] = np.sqrt(square)
            if levels[k] == 0:
                off = max(off, distances[k, part] / tolerance[part])
    return off


@compiled
def _place(T: Vector, offset: Vector, X: Vector) -> None:
    """Write the pose of a frame, [R p] row by row, from its joint's, by columns."""
    for i in range(3):
        for j in range(4):
            X[4 * i + j] = T[9 + i] if j == 3 else 0.0
            for n in range(3):
                X[4 * i + j] += T[3 * n + i] * offset[4 * n + j]


@compiled
def _approach(frames: Indices, dt: float, pace: float) -> None:
    """Write targets on the way to the goals; `approach_pose` is the readable form.

    Args:
        frames: Table of `FrameField`.
        dt: Step, s.
        pace: Part of its speed that a frame below level 0 may take.
    """
    levels, laws = indices(frames, FrameField.LEVEL), matrix(frames, FrameField.LAW)
    errors, poses = matrix(frames, FrameField.ERROR), matrix(frames, FrameField.POSE)
    targets, turn = matrix(frames, FrameField.TARGET), np.empty((3, 3))
    for k in range(levels.shape[0]):
        X, out, error, law = poses[k], targets[k], errors[k], laws[k]
        share = pace if levels[k] else 1.0
        step = _part(error[:3], dt, law[0], share * law[1], law[3])
        spin = _part(error[3:], dt, law[0], share * law[2], law[4])
        exp3(spin * error[3], spin * error[4], spin * error[5], turn)
        for i in range(3):
            out[4 * i + 3] = X[4 * i + 3] + step * error[i]
            for j in range(3):
                out[4 * i + j] = X[4 * i] * turn[0, j]
                out[4 * i + j] += X[4 * i + 1] * turn[1, j] + X[4 * i + 2] * turn[2, j]


@compiled
def _part(
    error: Vector, dt: float, gain: float, speed: float, acceleration: float
) -> float:
    """Return what part of an error to ask for; see `approach_speed`."""
    square = 0.0
    for i in range(3):
        square += error[i] * error[i]
    distance = np.sqrt(square)
    if not distance > 0.0:
        return 1.0
    corner = acceleration * dt / gain
    wanted = np.sqrt(2.0 * acceleration * distance + corner * corner) - corner
    return min(1.0, min(wanted, speed) * dt / (gain * distance))


@compiled
def approach_joints(
    difference: Vector,
    dt: float,
    pace: float,
    speed: Vector,
    acceleration: Vector,
    out: Vector,
) -> None:
    """Write the steps that take a joint difference away; see `approach_posture`.

    Args:
        difference: From here to there, shape (nv,).
        dt: Step, and the time constant of the last, exponential part, s.
        pace: Factor on the speeds.
        speed: Greatest speeds, shape (nv,).
        acceleration: Decelerations, shape (nv,).
        out: Output, dt times the velocities, shape (nv,).
    """
    for i in range(out.shape[0]):
        corner = acceleration[i] * dt
        distance = abs(difference[i])
        wanted = np.sqrt(2.0 * acceleration[i] * distance + corner * corner) - corner
        step = dt * min(wanted, pace * speed[i])
        out[i] = step if difference[i] > 0.0 else -step
