"""One limb's way through the pipeline: follow, bound, smooth, limit."""

import numpy as np
import pinocchio as pin

from wbc_suite.devices.limbs import LimbPort
from wbc_suite.devices.pipeline.bounds import Bound, LeashBound, WorkspaceBound
from wbc_suite.devices.pipeline.clutch import Clutch
from wbc_suite.devices.pipeline.config import PipelineConfig
from wbc_suite.devices.pipeline.motion_limit import MotionLimit
from wbc_suite.devices.pipeline.one_euro import OneEuroFilter
from wbc_suite.devices.state import LimbInput
from wbc_suite.typing import Vector

__all__ = ["LimbPipeline"]


class LimbPipeline:
    """Turns what a device says about a limb into its target.

    Args:
        port: The limb.
        config: Which stages there are.
        dt: Time between two ticks, s.

    Attributes:
        home: Where the limb was at the last reset.
        clutch: Couples the input to what is asked for, before bounds and limits.
        acting: What stages did to the last target, in words.
    """

    def __init__(self, port: LimbPort, config: PipelineConfig, dt: float) -> None:
        self.port, self._config, self._dt = port, config, dt
        self._bounds = _bounds(config)
        smooth = config.one_euro
        self._filter = None if smooth is None else OneEuroFilter(smooth, dt)
        self._limit = MotionLimit(config.linear.rates, config.angular.rates, dt)
        self.reset()

    def reset(self) -> None:
        """Stay where the limb is."""
        self.home: pin.SE3 = self.port.measure()
        self.clutch = Clutch(self.home, self._config.scale)
        self._heard: pin.SE3 | None = None
        self._ground = None if self.port.ground is None else self.port.ground()
        self._limit.reset(self.home)
        if self._filter is not None:
            self._filter.reset(self.home)
        self.acting: tuple[str, ...] = ()
        self._told = ""

    @property
    def target(self) -> pin.SE3:
        """The last target, in the world."""
        return self._limit.pose.copy()

    def release(self) -> None:
        """Let go of the input; the limb stays where its target is."""
        self.clutch.release()
        self._heard = None

    def go_home(self) -> None:
        """Let go of the input, and head for where the limb started."""
        self.place(self.home)

    def update(self, said: LimbInput | None, pace: float = 1.0) -> Vector:
        """Move on by one tick; return the values of the limb's slice.

        Args:
            said: What the device says; None for nothing new.
            pace: Fraction of the greatest speeds that is allowed now.
        """
        if said is not None:
            self.follow(said)
        self._ride()
        words = [self._told]
        self._told = ""
        measured, target = self.port.measure(), self.clutch.target
        for bound in self._bounds:
            target = bound.apply(target, measured)
            words.append(bound.acting)
        self.clutch.slip(target)
        if self._filter is not None:
            target = self._filter.apply(target, measured)
        self._limit.pace = pace
        target = self._limit.apply(target, measured)
        words.append(self._limit.acting)
        self.acting = tuple(filter(None, words))
        return self.port.encode(target)

    def follow(self, said: LimbInput) -> None:
        """Move the clutch as a device says; may be called often between two ticks."""
        if not said.engaged:
            self.release()
            self._told = "clutch is out"
            return
        if said.twist is not None:
            self.clutch.place(_moved(self.clutch.target, said.twist * self._dt))
            self._heard = None
        if said.pose is None:
            return
        jumped = self._heard is not None and self._jumped(self._heard, said.pose)
        self._heard = said.pose
        if self._config.mode == "absolute":
            self.clutch.place(self._absolute(said.pose))
            return
        if jumped or not self.clutch.engaged:
            self.clutch.engage(said.pose)
            self._told = "the input jumped: latched anew" if jumped else ""
        self.clutch.move(said.pose)

    def place(self, T_target: pin.SE3) -> None:
        """Let go of the input, and head for a pose in the world."""
        self._heard = None
        self.clutch.place(T_target)

    def carry(self, T_step: pin.SE3) -> None:
        """Move the target along with what it stands on; it stays engaged."""
        self.clutch.slip(T_step * self.clutch.target)

    def _ride(self) -> None:
        """Move all targets along with what they stand on."""
        if self.port.ground is None or self._ground is None:
            return
        ground = self.port.ground()
        step, self._ground = ground * self._ground.inverse(), ground
        self.carry(step)
        self._limit.pose = step * self._limit.pose

    def _jumped(self, before: pin.SE3, now: pin.SE3) -> bool:
        moved = float(np.linalg.norm(now.translation - before.translation))
        return self._config.jump is not None and moved > self._config.jump

    def _absolute(self, pose: pin.SE3) -> pin.SE3:
        origin = self.home.translation
        away = self._config.scale * (pose.translation - origin)
        return pin.SE3(pose.rotation, origin + away)


def _bounds(config: PipelineConfig) -> tuple[Bound, ...]:
    bounds: list[Bound] = []
    if config.workspace is not None:
        bounds.append(WorkspaceBound(config.workspace.low, config.workspace.high))
    if config.leash is not None:
        bounds.append(LeashBound(config.leash.distance, config.leash.angle))
    return tuple(bounds)


def _moved(pose: pin.SE3, step: Vector) -> pin.SE3:
    """Return a pose moved and turned by a step in world axes, shape (6,)."""
    return pin.SE3(pin.exp3(step[3:]) @ pose.rotation, pose.translation + step[:3])
