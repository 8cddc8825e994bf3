"""Targets of grippers and joints, each within its limits."""

from collections.abc import Mapping, Sequence

import numpy as np

from wbc_suite.devices.action_ports import JointPort
from wbc_suite.devices.pipeline.config import PipelineConfig
from wbc_suite.devices.pipeline.motion_limit import LimitedMotion
from wbc_suite.typing import Vector


class GripTarget:
    """The closing of a gripper, which moves to a goal.

    Attributes:
        labels: Names of the synergies.
        goal: Requested closing of each synergy, -1 open .. 1 closed.
    """

    def __init__(
        self, labels: Sequence[str], config: PipelineConfig, dt: float
    ) -> None:
        self.labels, size = tuple(labels), len(labels)
        self._motion = LimitedMotion(size, config.grip, dt)
        self.reset(np.zeros(size))

    def reset(self, values: Vector) -> None:
        """Stop at these values."""
        self.goal, self._values = values.copy(), values.copy()
        self._motion.stop()

    def aim(self, grip: Vector) -> None:
        """Set the goal: one value for all synergies, or one for each."""
        self.goal[:] = np.clip(np.resize(grip, self.goal.shape), -1.0, 1.0)

    def toggle(self) -> None:
        """Open the gripper if it is more closed than open; else close it."""
        self.aim(np.array(-1.0 if self.goal.mean() > 0.0 else 1.0))

    def update(self) -> Vector:
        """Advance by one tick; return the values of the slice."""
        self._values = self._values + self._motion.step(self.goal - self._values)
        return np.clip(self._values, -1.0, 1.0)


class JointTargets:
    """Positions of joints, each of which moves to that of a leader arm."""

    def __init__(self, port: JointPort, config: PipelineConfig, dt: float) -> None:
        self._port = port
        self._motions = [LimitedMotion(1, config.joint, dt) for _ in port.joints]
        self.reset()

    def reset(self) -> None:
        """Stop at the measured positions."""
        self._target = self._port.measure()
        self._goal = self._target.copy()
        for motion in self._motions:
            motion.stop()

    def aim(self, joints: Mapping[str, float]) -> bool:
        """Set goals by joint; return whether the slice has one of these joints."""
        own = [k for k, name in enumerate(self._port.joints) if name in joints]
        for k in own:
            self._goal[k] = joints[self._port.joints[k]]
        return bool(own)

    @property
    def lifts(self) -> bool:
        """Whether one of the joints lifts the torso."""
        return bool(self._port.lifting)

    def lift(self, step: float) -> None:
        """Move the torso's goal by a step, m."""
        self._goal[list(self._port.lifting)] += step

    def hold(self) -> None:
        """Stop at the current targets."""
        self._goal = self._target.copy()

    def update(self, pace: float) -> Vector:
        """Advance by one tick; return the values of the slice."""
        error = self._goal - self._target
        for k, motion in enumerate(self._motions):
            self._target[k] += motion.step(error[k : k + 1], pace)[0]
        return self._port.encode(self._target)
