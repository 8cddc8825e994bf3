"""Goals of controlled frames: from slices of an action to poses in the world."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from wbc_suite.compiling import as_argument, compiled, inner, struct
from wbc_suite.control.action import ActionLayout
from wbc_suite.control.ik.config import GoalsConfig
from wbc_suite.control.ik.frame_targets import FrameArrays
from wbc_suite.control.memory import Parts
from wbc_suite.control.poses import (
    multiply,
    pose_of,
    row_of,
    write_frame_pose,
    write_turn,
)
from wbc_suite.kinematics import Configuration
from wbc_suite.kinematics.forward import RobotArrays, compute_joint_poses
from wbc_suite.linear_algebra import copy_vector
from wbc_suite.qp.lie import exp3, log3
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Matrix, Vector

SAME_GOAL = 1e-9
"""m and rad; changes below are rounding."""


@struct
class GoalArrays(NamedTuple):
    """Goals of controlled frames; poses are rows [R p] of 3 by 4 numbers.

    Attributes:
        goal: Goals in the reference frame of the input, shape (n, 12).
        home: Poses in the world that ranges are measured from, shape (n, 12).
        range: Greatest distances from home, m and rad, shape (n, 2).
        base: Pose of the robot's base, as commanded, shape (12,).
        base_joint: Joint that carries the base.
        base_offset: Pose of the base in that joint, shape (12,).
        is_in_base: Whether goals are relative to the base.
        follows_base: Whether the base moves as commanded.
        root: Index of a free root in qpos, -1 without one.
        correction: Pose of measured in commanded axes, shape (12,).
    """

    goal: Matrix
    home: Matrix
    range: Matrix
    base: Vector
    base_joint: int
    base_offset: Vector
    is_in_base: bool
    follows_base: bool
    root: int
    correction: Vector


@compiled
def place_goals(
    goals: GoalArrays, robot: RobotArrays, frames: FrameArrays, qpos: Vector
) -> None:
    """Write the goals of the frames in the world of the commanded robot.

    They are within the frames' ranges. With a free root they are corrected by how far
    the measured root is from the commanded one, so that hands arrive although legs
    yield. `qpos` are the measured positions of the simulation.
    """
    correction, pose = goals.correction, np.empty(12)
    if goals.follows_base:
        compute_joint_poses(robot)
        write_frame_pose(robot.pose[goals.base_joint], goals.base_offset, goals.base)
    if goals.root >= 0:
        _write_inverse_root(qpos[goals.root :], pose)
        multiply(goals.base, pose, correction)
    for k in range(goals.goal.shape[0]):
        out = frames.goal[k]
        if goals.is_in_base:
            multiply(goals.base, goals.goal[k], out)
        else:
            copy_vector(goals.goal[k], out)
        if np.isfinite(goals.range[k, 0]):
            _bound(out, goals.home[k], goals.range[k])
        if goals.root >= 0:
            copy_vector(out, pose)
            multiply(correction, pose, out)


@inner
def _write_inverse_root(root: Vector, out: Vector) -> None:
    """Write the inverse of a pose that is given as position and quaternion w x y z."""
    w, x, y, z = root[3], root[4], root[5], root[6]
    scale = 2.0 / (w * w + x * x + y * y + z * z)
    out[0] = 1.0 - scale * (y * y + z * z)
    out[5] = 1.0 - scale * (x * x + z * z)
    out[10] = 1.0 - scale * (x * x + y * y)
    out[1], out[4] = scale * (x * y + w * z), scale * (x * y - w * z)
    out[2], out[8] = scale * (x * z - w * y), scale * (x * z + w * y)
    out[6], out[9] = scale * (y * z + w * x), scale * (y * z - w * x)
    for row in range(0, 12, 4):
        out[row + 3] = 0.0
        for k in range(3):
            out[row + 3] -= out[row + k] * root[k]


@inner
def _bound(goal: Vector, home: Vector, limits: Vector) -> None:
    """Move a goal towards home until it is within limits, m and rad."""
    turn, vector, R = np.empty((3, 3)), np.empty(3), np.empty((3, 3))
    square = 0.0
    for i in range(3):
        square += (goal[4 * i + 3] - home[4 * i + 3]) ** 2
    write_turn(home, goal, turn)
    share = min(1.0, limits[0] / max(np.sqrt(square), 1e-12))
    share_of_turn = min(1.0, limits[1] / max(log3(turn, vector), 1e-12))
    vector *= share_of_turn
    exp3(vector[0], vector[1], vector[2], R)
    for i in range(3):
        goal[4 * i + 3] = home[4 * i + 3] + share * (goal[4 * i + 3] - home[4 * i + 3])
        for j in range(3):
            goal[4 * i + j] = 0.0
            for k in range(3):
                goal[4 * i + j] += home[4 * i + k] * R[k, j]


class FrameGoals:
    """Goals in the reference frame of the input: the world, or the robot's base.

    Args:
        config: Controlled frames, and how their actions are given.
        layout: Layout whose first slices are those of the frames.
        robot: The reduced robot.
        configuration: Its commanded configuration.
        root: See `GoalArrays`.

    Attributes:
        poses: Goal of each frame, in the reference frame.
        argument: The argument of kernels that stands for the goals.
    """

    def __init__(
        self,
        config: GoalsConfig,
        layout: ActionLayout,
        robot: RobotDescription,
        configuration: Configuration,
        root: int,
    ) -> None:
        self._config = config
        count = len(config.frames)
        self._slices = [slice(part.start, part.stop) for part in layout.slices[:count]]
        self.poses: list[pin.SE3] = []
        in_base, kind = config.input_ref_frame == "base", robot.root.kind
        base_id = configuration.frame_id(robot.links[0].name)
        base = configuration.model.frames[base_id]
        ranges = [frame.range or (np.inf, np.inf) for frame in config.frames]
        self._arrays = GoalArrays(
            goal=np.zeros((count, 12)),
            home=np.zeros((count, 12)),
            range=np.array(ranges, dtype=np.float64).reshape(-1, 2),
            base=np.zeros(12),
            base_joint=int(base.parentJoint),
            base_offset=row_of(base.placement),
            is_in_base=in_base,
            follows_base=kind == "free" or (kind == "planar" and in_base),
            root=root,
            correction=np.eye(3, 4).ravel(),
        )
        self.argument = as_argument(self._arrays)

    @property
    def rows(self) -> Matrix:
        """Goals in the reference frame as rows [R p], shape (n, 12); a view."""
        return self._arrays.goal

    @property
    def correction(self) -> Vector:
        """Pose of measured in commanded axes, [R p], shape (12,); a view."""
        return self._arrays.correction

    @property
    def base(self) -> pin.SE3:
        """Pose of the robot's base, as commanded."""
        return pose_of(self._arrays.base)

    @property
    def memory(self) -> Parts:
        """Goals, homes and base; views."""
        return self._arrays.goal, self._arrays.home, self._arrays.base

    def resume(self) -> None:
        """Take the goals that were written into `memory`."""
        self.poses = [pose_of(row) for row in self._arrays.goal]

    def reset(self, poses: Sequence[pin.SE3], base: pin.SE3) -> None:
        """Take the present poses of the frames in the world as goals."""
        arrays, in_base = self._arrays, self._arrays.is_in_base
        arrays.base[:] = row_of(base)
        for row, pose in zip(arrays.home, poses, strict=True):
            row[:] = row_of(pose)
        self.poses = [base.actInv(p) if in_base else p.copy() for p in poses]
        self._write_rows()

    def set(self, action: Vector) -> bool:
        """Read an action; return whether a goal has changed."""
        before, config = self.poses, self._config
        self.poses = []
        for frame, own, goal in zip(config.frames, self._slices, before, strict=True):
            if config.input_type == "absolute":
                new = frame.behaviour.pose(action[own], goal)
            else:
                is_own = config.input_ref_frame == "eef"
                axes = goal.rotation if is_own else np.eye(3)
                new = frame.behaviour.moved(action[own], goal, axes)
            self.poses.append(new)
        self._write_rows()
        pairs = zip(before, self.poses, strict=True)
        return not all(a.isApprox(b, SAME_GOAL) for a, b in pairs)

    def _write_rows(self) -> None:
        for row, pose in zip(self._arrays.goal, self.poses, strict=True):
            row[:] = row_of(pose)

    def hold(self, action: Vector) -> None:
        """Write the slices that keep the goals."""
        for frame, own, goal in zip(
            self._config.frames, self._slices, self.poses, strict=True
        ):
            absolute = self._config.input_type == "absolute"
            action[own] = frame.behaviour.values(goal) if absolute else 0.0

    def in_world(self) -> list[pin.SE3]:
        """Return the goals in the world."""
        base = self.base
        return [base * p if self._arrays.is_in_base else p for p in self.poses]
