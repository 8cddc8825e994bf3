"""Interpolation of goals."""

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

from wbc_suite.compat.robosuite.utils.transform_utils import (
    axisangle2quat,
    quat2axisangle,
    quat_slerp,
)


class Interpolator(ABC):
    """Returns goals on the way to the last one."""

    @abstractmethod
    def get_interpolated_goal(self) -> Any:
        """Return the next goal."""


class LinearInterpolator(Interpolator):
    """Goals at equal distances, reached after `ramp_ratio` of an action's period.

    Orientations (`ori_interpolate`: `quat` or `euler`, which are axis times angle) take
    the shortest way.
    """

    def __init__(
        self,
        ndim: int,
        controller_freq: float,
        policy_freq: float,
        ramp_ratio: float = 0.2,
        use_delta_goal: bool = False,
        ori_interpolate: str | None = None,
    ) -> None:
        self.dim, self.ori_interpolate = ndim, ori_interpolate
        self.total_steps = int(np.ceil(ramp_ratio * controller_freq / policy_freq))
        self.use_delta_goal, self.order, self.step = use_delta_goal, 1, 0
        self.set_states(dim=ndim, ori=ori_interpolate)

    def set_states(self, dim: int | None = None, ori: str | None = None) -> None:
        """Change the number of values, or what they are."""
        self.dim = self.dim if dim is None else dim
        self.ori_interpolate = self.ori_interpolate if ori is None else ori
        start = np.zeros(self.dim)
        if self.ori_interpolate == "quat":
            start[-1] = 1.0
        self.start = self.goal = start

    def set_goal(self, goal: Any) -> None:
        """Start towards a goal from the last one."""
        goal = np.array(goal, dtype=np.float64)
        if goal.shape[0] != self.dim:
            raise ValueError(f"A goal has {self.dim} values, not {goal.shape[0]}.")
        self.start = np.zeros(self.dim) if self.use_delta_goal else self.goal
        self.goal, self.step = goal, 0

    def get_interpolated_goal(self) -> Any:
        """Return the next goal."""
        if self.step < self.total_steps:
            self.step += 1
        share = self.step / max(self.total_steps, 1)
        if self.ori_interpolate == "quat":
            return quat_slerp(self.start, self.goal, share)
        if self.ori_interpolate == "euler":
            start, goal = (axisangle2quat(x) for x in (self.start, self.goal))
            return quat2axisangle(quat_slerp(start, goal, share))
        return self.start + share * (self.goal - self.start)
