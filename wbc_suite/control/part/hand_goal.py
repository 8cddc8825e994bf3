"""Goals of a hand: absolute poses, or steps from the hand or the last goal."""

from typing import Self

import numpy as np
import pinocchio as pin
from pydantic import BaseModel, model_validator

from wbc_suite.control.part.part_settings import (
    ROUNDING,
    GoalUpdate,
    InputFrame,
    InputType,
    Range,
    check_axes,
    limits_of,
)
from wbc_suite.tomlfile import FROZEN
from wbc_suite.typing import Matrix, Vector


class HandSettings(BaseModel):
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

    model_config = FROZEN

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

    Raises ConfigError if limits have a wrong number of values, or are empty.

    Attributes:
        start: Orientation of the hand at the start, from which turns are limited.
        position_limits: Least and greatest coordinates, m, shape (2, 3).
    """

    def __init__(self, settings: HandSettings) -> None:
        self._in_hand = settings.input_ref_frame == "eef"
        self._from_hand = settings.goal_update_mode == "achieved"
        self.position_limits = _limits(settings.position_limits, "position_limits")
        self._turn_limits = _limits(settings.orientation_limits, "orientation_limits")
        self._turns_are_limited = bool(np.isfinite(self._turn_limits).any())
        self._reference_axes = np.eye(3)
        self.pose, self.start = pin.SE3.Identity(), np.eye(3)

    def reset(self, hand: pin.SE3) -> None:
        """Take the hand's pose as the goal."""
        self.pose, self.start = hand.copy(), hand.rotation.copy()

    def set(self, pose: pin.SE3) -> None:
        """Set an absolute goal, moved into the limits component by component."""
        low, high = self.position_limits
        position = np.minimum(np.maximum(pose.translation, low), high)
        rotation = pose.rotation
        if self._turns_are_limited:
            turn = pin.log3(rotation @ self.start.T)
            bounded = np.clip(turn, *self._turn_limits)
            if (bounded != turn).any():
                rotation = pin.exp3(bounded) @ self.start
        self.pose = pin.SE3(rotation, position)

    def step(self, step: Vector, hand: pin.SE3) -> None:
        """Move the goal by a step, shape (6,): linear, m, then a rotation vector."""
        if any(abs(x) > ROUNDING for x in step.tolist()):
            self.set(self.after(step, hand))

    def after(self, step: Vector, hand: pin.SE3) -> pin.SE3:
        """Return the goal after a step, without limits."""
        moves = [abs(x) > ROUNDING for x in step.tolist()]
        start, axes = self.pose, self._axes()
        if self._from_hand and all(moves):
            start = hand
        elif self._from_hand:
            to_hand = _step_between(start, hand, axes)
            start = _moved(start, np.where(moves, to_hand, 0.0), axes)
        return _moved(start, step, axes)

    def step_to(self, target: pin.SE3, hand: pin.SE3) -> Vector:
        """Return the step that moves the goal to a target, shape (6,)."""
        return _step_between(
            hand if self._from_hand else self.pose, target, self._axes()
        )

    def _axes(self) -> Matrix:
        return self.pose.rotation if self._in_hand else self._reference_axes


def _step_between(start: pin.SE3, target: pin.SE3, axes: Matrix) -> Vector:
    """Return the step along axes, shape (6,), that takes a pose to another."""
    shift = axes.T @ (target.translation - start.translation)
    turn = axes.T @ pin.log3(target.rotation @ start.rotation.T)
    return np.concatenate([shift, turn])


def _moved(pose: pin.SE3, step: Vector, axes: Matrix) -> pin.SE3:
    """Return a pose moved by a step along axes."""
    rotation = pin.exp3(axes @ step[3:]) @ pose.rotation
    return pin.SE3(rotation, pose.translation + axes @ step[:3])


def _limits(given: Range | None, key: str) -> Matrix:
    """Return least and greatest values, shape (2, 3), infinite where none are given."""
    return np.array(limits_of(given or (-np.inf, np.inf), 3, key))
