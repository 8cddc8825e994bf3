"""Goals of a hand: steps from where it is or was to be, and limits."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from wbc_suite.typing import Matrix, Vector

__all__ = ["GoalLimits", "step_origin", "stepped"]

NOTHING = 1e-12
"""m or rad; rounding of a step that is none."""


@dataclass(frozen=True, kw_only=True, slots=True)
class GoalLimits:
    """Where goals may be, in the reference's axes.

    Attributes:
        position: Least and greatest coordinates, m, shape (2, 3).
        turn: Least and greatest components of the rotation vector from the orientation
            at the start, rad, shape (2, 3).
    """

    position: Matrix
    turn: Matrix

    def nearest(self, goal: pin.SE3, start: Matrix) -> pin.SE3:
        """Return a goal within the limits, component by component.

        Args:
            goal: Any goal.
            start: The orientation at the start, shape (3, 3).
        """
        rotation = goal.rotation
        if np.isfinite(self.turn).any():
            turn = pin.log3(rotation @ start.T)
            bounded = np.clip(turn, *self.turn)
            if (bounded != turn).any():
                rotation = pin.exp3(bounded) @ start
        return pin.SE3(rotation, np.clip(goal.translation, *self.position))


def step_origin(goal: pin.SE3, now: pin.SE3, step: Vector, axes: Matrix) -> pin.SE3:
    """Return what a step counts from: the hand where the step moves, else its goal.

    Axes along or about which there is no step keep their goal: a hand that sags under
    a load would creep down otherwise, at every step aside.

    Args:
        goal: The last goal.
        now: Where the hand is.
        step: Linear and angular step, shape (6,).
        axes: The step's axes in the reference, shape (3, 3).
    """
    moved = (np.abs(step) > NOTHING).astype(np.float64)
    away = axes.T @ (now.translation - goal.translation)
    turn = axes.T @ pin.log3(now.rotation @ goal.rotation.T)
    return stepped(goal, np.concatenate([moved[:3] * away, moved[3:] * turn]), axes)


def stepped(pose: pin.SE3, step: Vector, axes: Matrix) -> pin.SE3:
    """Return a pose moved by a linear step and turned by a rotation vector.

    Args:
        pose: Where it is.
        step: Linear and angular step, shape (6,).
        axes: The step's axes in the reference, shape (3, 3).
    """
    return pin.SE3(
        pin.exp3(axes @ step[3:]) @ pose.rotation,
        pose.translation + axes @ step[:3],
    )
