"""OSC_POSE and OSC_POSITION: actions move a hand's goal, which `OscLaw` tracks."""

from typing import Literal

import numpy as np
import pinocchio as pin
from pydantic import NonNegativeFloat, PositiveFloat

from wbc_suite.control.action import FULL_TURN, Axis, SliceKind, Unit
from wbc_suite.control.law.osc import OscLaw
from wbc_suite.control.memory import Parts
from wbc_suite.control.part.controller import PartController, PoseInput
from wbc_suite.control.part.hand_goal import (
    HandGoal,
    HandSettings,
    relative_pose,
)
from wbc_suite.control.part.impedance import Gains, Impedance, ImpedanceSettings
from wbc_suite.control.part.part_settings import (
    REACH,
    Numbers,
    PartSettings,
    SliceInput,
    apply_torque_settings,
    damping_of,
)
from wbc_suite.control.robot_parts import RobotPart
from wbc_suite.control.state import RobotState
from wbc_suite.errors import UnknownNameError
from wbc_suite.typing import Vector

AXES = (Axis.X, Axis.Y, Axis.Z, Axis.RX, Axis.RY, Axis.RZ)
UNITS = (*(Unit("m"),) * 3, *(Unit("rad"),) * 3)

STEP = (0.05, 0.05, 0.05, 0.5, 0.5, 0.5)
"""m and rad; steps of a full action, which are those of this field's data sets."""


class OscConfig(ImpedanceSettings, HandSettings, PartSettings):
    """The hand follows poses in operational space; see `OscLaw`.

    Critically damped, a step is within 2 % of its end after `5.83 / sqrt(kp)` seconds:
    0.29 s at the default of 400 /s^2, unless a joint reaches its greatest velocity.

    Attributes:
        type: `OSC_POSE`, or `OSC_POSITION`, which holds the orientation that the hand
            has at the start.
        kp: Stiffness, 1/s^2, for all axes or each: linear then angular, in both types.
        output_min: Step at `input_min`, m and rad.
        output_max: Step at `input_max`, m and rad.
        velocity_limits: Greatest velocities of the hand, m/s and rad/s.
        saturation: Where joints saturate in torque or velocity: each is clipped
            (`clip`), or the hand's acceleration is scaled down and keeps its direction
            (`qp`).
        posture: Joint positions for the null space; those at the start for joints that
            are not named.
        posture_kp: Stiffness of the posture, 1/s^2, critically damped.
    """

    type: Literal["OSC_POSE", "OSC_POSITION"] = "OSC_POSE"
    kp: Gains = 400.0
    kp_limits: tuple[Gains, Gains] = (0.0, 500.0)
    output_min: Numbers = tuple(-x for x in STEP)
    output_max: Numbers = STEP
    velocity_limits: tuple[PositiveFloat, PositiveFloat] | None = None
    saturation: Literal["clip", "qp"] = "qp"
    posture: dict[str, float] = {}
    posture_kp: NonNegativeFloat = 10.0

    @property
    def size(self) -> int:
        """How many values of the action move the goal."""
        return 6 if self.type == "OSC_POSE" else 3

    def outputs(self) -> tuple[Numbers, Numbers]:
        """Return the steps at `input_min` and `input_max`, those of this type."""
        low, high = self.output_min, self.output_max
        if self.size == 3:  # without the angular ones, which may be given
            low, high = (tuple(np.atleast_1d(x)[:3].tolist()) for x in (low, high))
        return low, high


class OscController(PartController[OscLaw]):
    """Moves a hand's goal by actions; gains have slices of their own.

    Raises:
        ConfigError: If a number of values is wrong, or a range is empty.
        UnknownNameError: If the posture names a joint that the arm does not have.
    """

    needs_hand = True

    def __init__(self, part: RobotPart, config: OscConfig, state: RobotState) -> None:
        assert part.hand is not None
        self.config, self._state, size = config, state, config.size
        self._impedance = Impedance(part.name, AXES, config)
        self._goal, self._step = HandGoal(config), np.zeros(6)
        low, high = self._goal.limits[:, :3]
        turn = np.full(3, FULL_TURN)
        least = np.concatenate([np.maximum(low, -REACH), -turn])[:size]
        greatest = np.concatenate([np.minimum(high, REACH), turn])[:size]
        self._input = SliceInput(
            part.name,
            SliceKind.POSE if size == 6 else SliceKind.POSITION,
            labels=AXES[:size],
            units=UNITS[:size],
            config=config,
            outputs=config.outputs(),
            limits=(least, greatest),
        )
        self.slices = (self._input.action, *self._impedance.slices)
        for joint in config.posture:
            if joint not in part.joints:
                raise UnknownNameError(f"joint of '{part.name}'", joint, part.joints)
        self.law = self._make_law(part.joints, part.hand)
        self._frames = self.law.frames(state)
        self._write_gains()
        self.reset(state)

    def _make_law(self, joints: tuple[str, ...], site: str) -> OscLaw:
        config, state = self.config, self._state
        law = OscLaw(state, joints, site)
        apply_torque_settings(law, config)
        law.keep_limits(state)
        law.drives["kp"] = config.posture_kp
        law.drives["kd"] = damping_of(config.posture_kp, 1.0)
        law.record["speed"] = config.velocity_limits or np.inf
        law.record["keep_direction"] = float(config.saturation == "qp")
        if config.input_ref_frame != "world":
            base = state.prefix + state.robot.links[0].name
            law.record["reference"] = state.model.body(base).id
        return law

    def _write_gains(self) -> None:
        self.law.record["kp"] = self._impedance.kp
        self.law.record["kd"] = self._impedance.kd

    def reset(self, state: RobotState) -> None:
        """Hold the hand where it is, and the posture that it has."""
        posture = state.data.qpos[self.law.drives["qpos"]]
        for k, joint in enumerate(self.law.joints):
            posture[k] = self.config.posture.get(joint, posture[k])
        self.law.drives["position"] = posture
        self._goal.reset(self._hand())
        self.law.set_goal(self._goal.vector)

    def set_goal(self, values: Vector, period: float) -> None:
        """Take a step or a goal, shape (6,) or (3,), and gains as the mode has them."""
        size, ramp = self.config.size, self.config.ramp(period)
        if self._impedance.slices:
            self._impedance.take(values[size:])
            self._write_gains()
        start = self.law.target_pose()[0] if ramp > 0.0 else None
        if self._input.scaled:
            self._step[:size] = self._input.scaling(values[:size])
            self._goal.step(self._step, self._hand())
        else:
            self._goal.set(self._pose_of(values[:size]))
        self.law.set_goal(self._goal.vector, start=start, duration=ramp)

    @property
    def memory(self) -> Parts:
        """Goal, the pose from which turns are limited, and gains that actions set."""
        gains = self.law.gains if self._impedance.slices else ()
        return *self._goal.memory, *self._impedance.memory, *gains

    @property
    def goal(self) -> pin.SE3:
        """Pose to hold, in the reference's axes."""
        return self._goal.pose

    @goal.setter
    def goal(self, pose: pin.SE3) -> None:
        self._goal.pose = pose

    @property
    def hold_action(self) -> Vector:
        """The action that keeps the goal."""
        scaled = self._input.scaled
        motion = self._input.neutral if scaled else self._absolute(self.goal)
        return np.concatenate([motion, self._impedance.hold_action])

    def pose_input(self) -> PoseInput:
        """Return how to send the hand to a pose in the world.

        Steps are counted as `set_goal` counts them, so the goal becomes the target
        wherever that is within a full step.
        """
        action, site = self._input.action, int(self.law.record["site"][0])
        R_body, p_body, R_site, p_site = self._frames

        def reference() -> pin.SE3:
            return pin.SE3(R_body.copy(), p_body.copy())

        def measure() -> pin.SE3:
            return pin.SE3(R_site.copy(), p_site.copy())

        def encode(target: pin.SE3) -> Vector:
            goal = reference().actInv(target)
            if self._input.scaled:
                step = self._goal.step_to(goal, self._hand())
                values = self._input.scaling.inverse(step[: self.config.size])
            else:
                values = self._absolute(goal)
            return np.clip(values, action.low, action.high)

        def decode(values: Vector) -> pin.SE3:
            if self._input.scaled:
                step = np.zeros(6)
                step[: self.config.size] = self._input.scaling(values)
                return reference() * self._goal.after(step, self._hand())
            return reference() * self._pose_of(values)

        fixed = self._state.robot.root.kind == "fixed"
        return PoseInput(
            action=action,
            body=int(self._state.model.site_bodyid[site]),
            measure=measure,
            encode=encode,
            decode=decode,
            reference=None if fixed else reference,
        )

    def _absolute(self, pose: pin.SE3) -> Vector:
        """Return the absolute values that command a pose."""
        values = np.concatenate([pose.translation, pin.log3(pose.rotation)])
        return values[: self.config.size]

    def _pose_of(self, values: Vector) -> pin.SE3:
        """Return the pose that absolute values command."""
        if len(values) == 6:
            return pin.SE3(pin.exp3(values[3:]), values[:3])
        return pin.SE3(self._goal.start[:9].reshape(3, 3), values)

    def _hand(self) -> Vector:
        """Return the pose of the hand in the reference; see `HandGoal`."""
        return relative_pose(*self._frames)
