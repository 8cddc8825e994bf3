"""Stages of one limb: clutch, workspace, leash, filter and motion limit."""

import math

import numpy as np
import pinocchio as pin

from wbc_suite.devices.action_ports import LimbPort
from wbc_suite.devices.pipeline.clutch import Clutch
from wbc_suite.devices.pipeline.config import (
    Leash,
    OneEuro,
    PipelineConfig,
    WorkspaceBox,
)
from wbc_suite.devices.pipeline.motion_limit import MotionLimit
from wbc_suite.devices.state import LimbInput
from wbc_suite.typing import Vector

ROUNDING = 1e-9  # m or rad
SPEED_CUTOFF = 1.0  # Hz, of the one-euro filter's own filter of speed, as in its source


class LimbPipeline:
    """Compute the target of a limb from the input of a device.

    `dt` is the time between two ticks, s.

    Attributes:
        home: Pose of the limb at the last reset.
        clutch: Couples the input to the requested target, before bounds and limits.
        acting: What stages did to the last target.
        rides: Whether the target moves with the base, if there is one.
        moved: Whether an input has moved the target since the reset.
    """

    def __init__(self, port: LimbPort, config: PipelineConfig, dt: float) -> None:
        self.port, self._config, self._dt = port, config, dt
        smooth = config.one_euro
        self._filter = None if smooth is None else OneEuroFilter(smooth, dt)
        self._limit = MotionLimit(config.linear, config.angular, dt)
        self.rides = True
        self.reset()

    def reset(self) -> None:
        """Set the target to the pose of the limb."""
        self.home: pin.SE3 = self.port.measure()
        self.clutch = Clutch(self.home, self._config.scale)
        self._last_input: pin.SE3 | None = None
        self._ground = None if self.port.ground is None else self.port.ground()
        self._limit.reset(self.home)
        if self._filter is not None:
            self._filter.reset(self.home)
        self.acting: tuple[str, ...] = ()
        self._clutch_note, self.moved = "", False

    @property
    def target(self) -> pin.SE3:
        """The last target, in the world."""
        return self._limit.pose.copy()

    def release(self) -> None:
        """Release the clutch; the limb stays at its target."""
        self.clutch.release()
        self._last_input = None

    def go_home(self) -> None:
        """Release the clutch, and move to where the limb was at the reset."""
        self.place(self.home)

    def update(self, given: LimbInput | None, pace: float = 1.0) -> Vector:
        """Advance by one tick; return the values of the limb's slice.

        `given` is a new input of the device, `pace` the permitted share of its speed.
        """
        if given is not None:
            self.follow(given)
        self._move_with_ground()
        notes, self._clutch_note = [self._clutch_note], ""
        measured, target = self.port.measure(), self.clutch.target
        if self._config.workspace is not None:
            target, clipped = clip_to_box(target, self._config.workspace)
            notes.append("at the workspace limit" if clipped else "")
        if self._config.leash is not None:
            target, clipped = clip_to_leash(target, measured, self._config.leash)
            notes.append("limited by the leash" if clipped else "")
        self.clutch.slip(target)
        if self._filter is not None:
            target = self._filter.apply(target)
        target = self._limit.apply(target, pace)
        notes.append("at the speed limit" if self._limit.at_speed_limit else "")
        self.acting = tuple(filter(None, notes))
        return self.port.encode(target)

    def follow(self, given: LimbInput, *, by_hand: bool = False) -> None:
        """Move the clutch by an input; may be called often between two ticks.

        A slow page sends a drag `by_hand` in few, long steps: they are no jumps.
        """
        if not given.engaged:
            self.release()
            self._clutch_note = "clutch disengaged"
            return
        turns = given.twist is not None and bool(given.twist.any())
        self.moved = self.moved or turns or given.pose is not None
        if given.twist is not None:
            before, step = self.clutch.target, given.twist * self._dt
            turned = pin.exp3(step[3:]) @ before.rotation
            self.place(pin.SE3(turned, before.translation + step[:3]))
        if given.pose is None:
            return
        jumped = not by_hand and self._jumps(given.pose)
        self._last_input = given.pose
        if self._config.mode == "absolute":
            origin, pose = self.home.translation, given.pose
            offset = self._config.scale * (pose.translation - origin)
            self.clutch.place(pin.SE3(pose.rotation, origin + offset))
            return
        if jumped or not self.clutch.engaged:
            self.clutch.engage(given.pose)
            self._clutch_note = "input jumped: clutch latched again" if jumped else ""
        self.clutch.move(given.pose)

    def place(self, T_target: pin.SE3) -> None:
        """Release the clutch, and move to a pose in the world."""
        self._last_input = None
        self.clutch.place(T_target)

    def carry(self, T_step: pin.SE3) -> None:
        """Move the target with the base that it stands on; it stays engaged."""
        self.clutch.slip(T_step * self.clutch.target)

    def _move_with_ground(self) -> None:
        if self.port.ground is None or self._ground is None:
            return
        ground = self.port.ground()
        step, self._ground = ground * self._ground.inverse(), ground
        if self.rides:
            self.carry(step)
            self._limit.pose = step * self._limit.pose

    def _jumps(self, pose: pin.SE3) -> bool:
        last, settings = self._last_input, self._config
        if last is None:
            return False
        step = np.linalg.norm(pose.translation - last.translation)
        angle = np.linalg.norm(pin.log3(last.rotation.T @ pose.rotation))
        far = settings.jump is not None and step > settings.jump
        turned = settings.jump_angle is not None and angle > settings.jump_angle
        return bool(far or turned)


def clip_to_box(target: pin.SE3, box: WorkspaceBox) -> tuple[pin.SE3, bool]:
    """Return the nearest target inside a box, and whether it is at its boundary."""
    inside = np.clip(target.translation, box.low, box.high)
    distance = np.minimum(inside - box.low, box.high - inside).min()
    return pin.SE3(target.rotation, inside), bool(distance < ROUNDING)


def clip_to_leash(
    target: pin.SE3, measured: pin.SE3, leash: Leash
) -> tuple[pin.SE3, bool]:
    """Return the target, moved to within the leash of the limb, and if it is tight."""
    offset = target.translation - measured.translation
    turn = pin.log3(target.rotation @ measured.rotation.T)
    distance, angle = float(np.linalg.norm(offset)), float(np.linalg.norm(turn))
    tight = distance > leash.distance - ROUNDING or angle > leash.angle - ROUNDING
    position, rotation = target.translation, target.rotation
    if distance > leash.distance:
        position = measured.translation + leash.distance / distance * offset
    if angle > leash.angle:
        rotation = pin.exp3(leash.angle / angle * turn) @ measured.rotation
    return pin.SE3(rotation, position), tight


class OneEuroFilter:
    """Low-pass filter of a pose with a cutoff that rises with its speed.

        cutoff = cutoff_0 + rise * speed,   alpha = 1 / (1 + 1 / (2 pi cutoff dt))

    Orientations are filtered along the shortest arc.

    Source: Casiez, Roussel and Vogel (2012), "1 Euro Filter", CHI.
    """

    def __init__(self, config: OneEuro, dt: float) -> None:
        self._config, self._dt = config, dt
        self.reset(pin.SE3.Identity())

    def reset(self, pose: pin.SE3) -> None:
        """Start at rest at a pose."""
        self._pose, self._before = pose.copy(), pose.copy()
        self._speed = np.zeros(2)

    def apply(self, target: pin.SE3) -> pin.SE3:
        """Return the smoothed target."""
        moved = target.translation - self._before.translation
        turned = pin.log3(target.rotation @ self._before.rotation.T)
        speed = np.array([np.linalg.norm(moved), np.linalg.norm(turned)]) / self._dt
        self._speed += self._alpha(SPEED_CUTOFF) * (speed - self._speed)
        self._before = target.copy()
        config = self._config
        linear = self._alpha(config.cutoff + config.linear_rise * self._speed[0])
        angular = self._alpha(config.cutoff + config.angular_rise * self._speed[1])
        here = self._pose
        offset = target.translation - here.translation
        turn = pin.log3(target.rotation @ here.rotation.T)
        self._pose = pin.SE3(
            pin.exp3(angular * turn) @ here.rotation, here.translation + linear * offset
        )
        return self._pose

    def _alpha(self, cutoff: float) -> float:
        return 1.0 / (1.0 + 1.0 / (2.0 * math.pi * cutoff * self._dt))
