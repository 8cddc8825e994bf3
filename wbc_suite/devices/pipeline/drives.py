"""What is not a limb: grippers, joints and the base's speed, each within limits."""

from collections.abc import Mapping

import numpy as np

from wbc_suite.devices.limbs import robot_of
from wbc_suite.devices.pipeline.config import PipelineConfig
from wbc_suite.devices.pipeline.motion_limit import LimitedMotion
from wbc_suite.devices.ports import JointPort, SpeedPort
from wbc_suite.typing import Vector

__all__ = ["BaseDrive", "GripDrive", "JointDrive"]


class GripDrive:
    """Closes a gripper towards a goal.

    Attributes:
        goal: Where each synergy shall go, -1 open .. 1 closed.
    """

    def __init__(self, size: int, config: PipelineConfig, dt: float) -> None:
        self._motion = LimitedMotion(size, config.grip.rates, dt)
        self.reset(np.zeros(size))

    def reset(self, values: Vector) -> None:
        """Stay at these values."""
        self.goal, self._values = values.copy(), values.copy()
        self._motion.stop()

    def aim(self, grip: Vector) -> None:
        """Take one value for all synergies, or one for each."""
        self.goal[:] = np.clip(np.resize(grip, self.goal.shape), -1.0, 1.0)

    def toggle(self) -> None:
        """Open what is more closed than open, and close the other."""
        self.aim(np.array(-1.0 if self.goal.mean() > 0.0 else 1.0))

    def update(self) -> Vector:
        """Move on by one tick; return the values of the slice."""
        self._values = self._values + self._motion.step(self.goal - self._values)
        return np.clip(self._values, -1.0, 1.0)


class JointDrive:
    """Brings joints to where a leader arm has them, each within its own limits."""

    def __init__(self, port: JointPort, config: PipelineConfig, dt: float) -> None:
        self._port = port
        rates = config.joint.rates
        self._motions = [LimitedMotion(1, rates, dt) for _ in port.joints]
        self.reset()

    def reset(self) -> None:
        """Stay where the joints are."""
        self._target = self._port.measure()
        self._goal = self._target.copy()
        for motion in self._motions:
            motion.stop()

    def aim(self, joints: Mapping[str, float]) -> bool:
        """Take positions by joint; return whether one of them is ours."""
        own = [k for k, name in enumerate(self._port.joints) if name in joints]
        for k in own:
            self._goal[k] = joints[self._port.joints[k]]
        return bool(own)

    def lift(self, step: float) -> None:
        """Raise or lower the torso by a step, m."""
        for k, name in enumerate(self._port.joints):
            if "torso" in name or "lift" in name:
                self._goal[k] += step

    def hold(self) -> None:
        """Stop where the targets are."""
        self._goal = self._target.copy()

    def update(self, pace: float) -> Vector:
        """Move on by one tick; return the values of the slice."""
        error = self._goal - self._target
        for k, motion in enumerate(self._motions):
            self._target[k] += motion.step(error[k : k + 1], pace)[0]
        return self._port.encode(self._target)


class BaseDrive:
    """Drives a base that takes velocities."""

    def __init__(self, port: SpeedPort, config: PipelineConfig, dt: float) -> None:
        self.robot = robot_of(port.name)
        self._port = port
        self._change = LimitedMotion(3, config.base_rise.rates, dt)
        self.reset()

    def reset(self) -> None:
        """Stand still."""
        self.goal: Vector = np.zeros(3)
        self._velocity: Vector = np.zeros(3)
        self._change.stop()

    def update(self) -> Vector:
        """Move on by one tick; return the values of the slice."""
        step = self._change.step(self.goal - self._velocity)
        self._velocity = self._velocity + step
        return self._port.encode(self._velocity)
