"""Goals of a hand: absolute poses, or steps from the hand or the last goal."""

from typing import Self

import numpy as np
import pinocchio as pin
from pydantic import BaseModel, model_validator

from wbc_suite.compiling import compiled
from wbc_suite.control.loop.rigid_body import matrix_product
from wbc_suite.control.part.part_settings import (
    ROUNDING,
    GoalUpdate,
    InputFrame,
    InputType,
    Range,
    check_axes,
    limits_of,
)
from wbc_suite.qp.lie import exp3, log3
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
        flat: Rotation, row by row, and position, shape (12,). A buffer.
        position_limits: Least and greatest coordinates, m, shape (2, 3).
    """

    def __init__(self, settings: HandSettings) -> None:
        self._in_hand = settings.input_ref_frame == "eef"
        self._from_hand = settings.goal_update_mode == "achieved"
        self.position_limits = _limits(settings.position_limits, "position_limits")
        self._turn_limits = _limits(settings.orientation_limits, "orientation_limits")
        self.flat: Vector = np.concatenate([np.eye(3).ravel(), np.zeros(3)])
        self._rotation, self._position = self.flat[:9].reshape(3, 3), self.flat[9:]
        self.start: Matrix = np.eye(3)

    @property
    def pose(self) -> pin.SE3:
        """The goal."""
        return pin.SE3(self._rotation, self._position)

    @pose.setter
    def pose(self, pose: pin.SE3) -> None:
        self._rotation[:], self._position[:] = pose.rotation, pose.translation

    def reset(self, rotation: Matrix, position: Vector) -> None:
        """Take the hand's pose as the goal; turns are limited from its orientation."""
        self._rotation[:], self._position[:] = rotation, position
        self.start = self._rotation.copy()

    def set(self, rotation: Matrix, position: Vector) -> None:
        """Set an absolute goal; limits apply."""
        self._rotation[:], self._position[:] = rotation, position
        self._limit()

    def step(self, step: Vector, rotation: Matrix, position: Vector) -> None:
        """Move the goal by a step, shape (6,); limits apply.

        The step is linear, m, then a rotation vector, rad; the pose is the hand's.
        """
        if not np.abs(step).max() > ROUNDING:
            return
        axes = self._rotation.copy() if self._in_hand else np.eye(3)
        R, p, R_hand = self._rotation, self._position, np.ascontiguousarray(rotation)
        move_goal(R, p, step, axes, R_hand, position, self._from_hand)
        self._limit()

    def step_to(self, target: pin.SE3, hand: pin.SE3) -> Vector:
        """Return the step that moves the goal to a target, shape (6,)."""
        start = hand if self._from_hand else self.pose
        axes = self._rotation if self._in_hand else np.eye(3)
        shift = axes.T @ (target.translation - start.translation)
        turn = axes.T @ pin.log3(target.rotation @ start.rotation.T)
        return np.concatenate([shift, turn])

    def _limit(self) -> None:
        """Move the goal into its limits, component by component."""
        np.clip(self._position, *self.position_limits, out=self._position)
        if np.isinf(self._turn_limits).all():
            return
        turn = pin.log3(self._rotation @ self.start.T)
        bounded = np.clip(turn, *self._turn_limits)
        if (bounded != turn).any():
            self._rotation[:] = pin.exp3(bounded) @ self.start


@compiled
def move_goal(
    R: Matrix,
    p: Vector,
    step: Vector,
    axes: Matrix,
    R_hand: Matrix,
    p_hand: Vector,
    from_hand: bool,
) -> None:
    """Move a goal (R, p) by a step along axes, in place.

    Args:
        R: Its rotation, shape (3, 3).
        p: Its position, shape (3,).
        step: Linear, then a rotation vector, shape (6,).
        axes: Axes of the step, shape (3, 3).
        R_hand: The hand's rotation, shape (3, 3).
        p_hand: The hand's position, shape (3,).
        from_hand: Whether components that the step moves count from the hand.
    """
    if from_hand:
        offset, turned = np.zeros(6), np.empty((3, 3))
        matrix_product(R_hand, R.T, turned)
        log3(turned, offset[3:])
        offset[:3] = p_hand - p
        origin = np.zeros(6)
        for i in range(6):
            if abs(step[i]) > ROUNDING:
                half = i - i % 3
                for j in range(3):
                    origin[i] += axes[j, i % 3] * offset[half + j]
        _move(R, p, origin, axes)
    _move(R, p, step, axes)


@compiled
def _move(R: Matrix, p: Vector, step: Vector, axes: Matrix) -> None:
    """Turn and shift a pose in place, by a step along axes."""
    shift, turn, rotation = np.zeros(3), np.zeros(3), np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            shift[i] += axes[i, j] * step[j]
            turn[i] += axes[i, j] * step[3 + j]
    exp3(turn[0], turn[1], turn[2], rotation)
    matrix_product(rotation, R.copy(), R)
    p += shift


def _limits(given: Range | None, key: str) -> Matrix:
    """Return least and greatest values, shape (2, 3), infinite where none are given."""
    return np.array(limits_of(given or (-np.inf, np.inf), 3, key))
