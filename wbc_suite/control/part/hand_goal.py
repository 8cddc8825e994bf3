"""Goals of a hand: absolute poses, or steps from the hand or the last goal."""

from typing import Self

import numpy as np
import pinocchio as pin
from pydantic import model_validator

from wbc_suite.config_files import FrozenModel
from wbc_suite.control.memory import Parts
from wbc_suite.control.part.part_settings import (
    ROUNDING,
    GoalUpdate,
    InputFrame,
    InputType,
    Range,
    check_axes,
    limits_of,
)
from wbc_suite.control.poses import pose_vector, vector_pose
from wbc_suite.typing import Matrix, Vector


class HandSettings(FrozenModel):
    """Settings of controllers that move the goal of a hand, beside `PartSettings`.

    Attributes:
        input_type: `delta` steps, see `goal_update_mode`, or `absolute` goals.
        input_ref_frame: Axes of the input: those of the world; of the robot's first
            link, with which goals move; or of the hand's goal, for deltas only.
        goal_update_mode: See `PartSettings`.
        position_limits: Least and greatest coordinates of goals in the reference, m.
        orientation_limits: Least and greatest components of the rotation vector from
            the orientation at the start to a goal's, axes of the reference, rad.
    """

    input_type: InputType = "delta"
    input_ref_frame: InputFrame = "base"
    goal_update_mode: GoalUpdate = "achieved"
    position_limits: Range | None = None
    orientation_limits: Range | None = None

    @model_validator(mode="after")
    def _axes_fit(self) -> Self:
        check_axes(self.input_type, self.input_ref_frame)
        return self


class HandGoal:
    """The goal of a hand in the axes of a reference body, which actions move.

    A step goes along the reference's axes, or along those of the goal itself (`eef`).
    With `achieved` it counts from the hand, in those components that it moves: the
    others keep their goal, since a hand that sags under a load would creep down at
    every step to the side. A step of zero keeps the goal.

    Poses are vectors; see `pose_vector`.

    Raises ConfigError if limits have a wrong number of values, or are empty.

    Attributes:
        vector: The goal.
        start: The hand's pose at the start, from which turns are limited.
        limits: Least and greatest coordinates, m, and components of the rotation vector
            from `start`, rad, shape (2, 6).
    """

    def __init__(self, settings: HandSettings) -> None:
        self._in_hand = settings.input_ref_frame == "eef"
        self._from_hand = settings.goal_update_mode == "achieved"
        self.limits = np.hstack(
            [
                _limits(settings.position_limits, "position_limits"),
                _limits(settings.orientation_limits, "orientation_limits"),
            ]
        )
        self._reference_axes = np.eye(3)
        self.vector = pose_vector(pin.SE3.Identity())
        self.start = self.vector.copy()

    @property
    def memory(self) -> Parts:
        """Goal and start; views."""
        return self.vector, self.start

    @property
    def pose(self) -> pin.SE3:
        """The goal; see `set` for goals within the limits."""
        return vector_pose(self.vector)

    @pose.setter
    def pose(self, pose: pin.SE3) -> None:
        self.vector[:] = pose_vector(pose)

    def reset(self, hand: Vector) -> None:
        """Take the hand's pose as the goal."""
        self.vector[:], self.start[:] = hand, hand

    def set(self, pose: pin.SE3) -> None:
        """Set an absolute goal, moved into the limits component by component."""
        self.pose = pose
        bound_pose(self.vector, self.start, self.limits)

    def step(self, step: Vector, hand: Vector) -> None:
        """Move the goal by a step, shape (6,): linear, m, then a rotation vector."""
        if step_pose(self.vector, step, hand, self._axes(), self._from_hand):
            bound_pose(self.vector, self.start, self.limits)

    def after(self, step: Vector, hand: Vector) -> pin.SE3:
        """Return the goal after a step, without limits."""
        goal = self.vector.copy()
        step_pose(goal, step, hand, self._axes(), self._from_hand)
        return vector_pose(goal)

    def step_to(self, target: pin.SE3, hand: Vector) -> Vector:
        """Return the step that moves the goal to a target, shape (6,)."""
        start = hand if self._from_hand else self.vector
        return step_between(start, pose_vector(target), self._axes())

    def _axes(self) -> Matrix:
        """Return the axes of steps as columns, shape (3, 3)."""
        if self._in_hand:
            return self.vector[:9].reshape(3, 3).copy()
        return self._reference_axes


def step_pose(
    goal: Vector, step: Vector, hand: Vector, axes: Matrix, from_hand: bool
) -> bool:
    """Move a goal by a step along axes; return whether any component moves.

    See `HandGoal`; `from_hand` is whether components that move count from the hand.
    """
    moved = np.abs(step) > ROUNDING
    if not moved.any():
        return False
    if from_hand:
        _move(goal, moved * step_between(goal, hand, axes), axes)
    _move(goal, step, axes)
    return True


def step_between(start: Vector, target: Vector, axes: Matrix) -> Vector:
    """Return the step along axes, shape (6,), that takes a pose to another."""
    turn = pin.log3(target[:9].reshape(3, 3) @ start[:9].reshape(3, 3).T)
    return np.concatenate([(target[9:] - start[9:]) @ axes, turn @ axes])


def _move(pose: Vector, step: Vector, axes: Matrix) -> None:
    """Move a pose by a step along axes."""
    R = pose[:9].reshape(3, 3)
    R[:] = pin.exp3(axes @ step[3:]) @ R
    pose[9:] += axes @ step[:3]


def bound_pose(pose: Vector, start: Vector, limits: Matrix) -> None:
    """Move a pose into the limits of a `HandGoal`, component by component."""
    pose[9:] = np.clip(pose[9:], limits[0, :3], limits[1, :3])
    R, R_start = pose[:9].reshape(3, 3), start[:9].reshape(3, 3)
    turn = pin.log3(R @ R_start.T)
    bounded = np.clip(turn, limits[0, 3:], limits[1, 3:])
    if (bounded != turn).any():
        R[:] = pin.exp3(bounded) @ R_start


def relative_pose(R_base: Matrix, p_base: Vector, R: Matrix, p: Vector) -> Vector:
    """Return the pose (R, p) in the axes of a base, as a vector."""
    return np.concatenate([(R_base.T @ R).ravel(), (p - p_base) @ R_base])


def _limits(given: Range | None, key: str) -> Matrix:
    """Return least and greatest values, shape (2, 3), infinite where none are given."""
    return np.array(limits_of(given or (-np.inf, np.inf), 3, key))
