"""IK_POSE: actions are poses of the hand; inverse kinematics gives joint references."""

from functools import partial
from typing import Annotated, Any, Literal

import numpy as np
import pinocchio as pin
from pydantic import Field, NonNegativeFloat, PositiveFloat

from wbc_suite.control.action import ActionPart, Axis, SliceKind, Unit
from wbc_suite.control.law.joint_laws import JointLaw
from wbc_suite.control.law.pose_interpolation import pose_vector
from wbc_suite.control.memory import Parts
from wbc_suite.control.part.approach import approach_pose
from wbc_suite.control.part.controller import PartController
from wbc_suite.control.part.feasible_acceleration import feasible_accelerations
from wbc_suite.control.part.hand_goal import HandGoal, HandSettings
from wbc_suite.control.part.part_settings import (
    REACH,
    ROUNDING,
    InputScaling,
    Numbers,
    PartSettings,
    apply_torque_settings,
    damping_of,
)
from wbc_suite.control.part.spline_reference import SplineReference, window_length
from wbc_suite.control.reasons import LazyReasons, Reason
from wbc_suite.control.robot_parts import RobotPart
from wbc_suite.control.state import RobotState
from wbc_suite.kinematics import Configuration
from wbc_suite.qp import (
    AccelerationLimit,
    FrameTask,
    PositionLimit,
    PostureTask,
    TaskStack,
    TickRecord,
    VelocityLimit,
)
from wbc_suite.tomlfile import FrozenModel
from wbc_suite.typing import Matrix, Vector

AXES = (Axis.X, Axis.Y, Axis.Z, Axis.QX, Axis.QY, Axis.QZ, Axis.QW)

UNLIMITED = 1e3
"""m/s and rad/s; velocities are limited by `approach_pose`."""


class IkMotion(FrozenModel):
    """Motion of a hand to its goal.

    Attributes:
        gain: Part of the error that one solve removes, (0, 1].
        speed: Greatest speeds, m/s and rad/s.
        braking: Decelerations towards the goal, m/s^2 and rad/s^2.
        acceleration: Greatest acceleration of a joint, rad/s^2 or m/s^2.
        jerk: Greatest jerk of a joint's target, rad/s^3 or m/s^3.
        effort_share: Part of a motor's effort that acceleration may take.
        posture_cost: Pull to the posture at reset, [cost]/rad, after the hand.
        posture_gain: Part of the difference that one solve removes.
    """

    gain: float = Field(default=0.5, gt=0.0, le=1.0)
    speed: tuple[PositiveFloat, PositiveFloat] = (1.0, 3.0)
    braking: tuple[PositiveFloat, PositiveFloat] = (4.0, 12.0)
    acceleration: PositiveFloat = 50.0
    jerk: float = Field(default=5000.0, ge=100.0)
    effort_share: float = Field(default=0.6, gt=0.0, le=1.0)
    posture_cost: NonNegativeFloat = 0.1
    posture_gain: float = Field(default=0.05, gt=0.0, le=1.0)


class IkPoseConfig(HandSettings, PartSettings):
    """Joints follow the inverse kinematics of poses of the hand.

    Attributes:
        output_min: Step at `input_min`, m.
        output_max: Step at `input_max`, m.
        turn_limit: Greatest turn of a step, rad.
        solve_hz: Solves per second.
        motion: How the hand goes to its goal.
        kp: Stiffness of the joints, 1/s^2.
        damping_ratio: 1 is critically damped.
        tolerance: Errors below which the goal counts as reached, m and rad.
    """

    type: Literal["IK_POSE"] = "IK_POSE"
    output_min: Numbers = -0.05
    output_max: Numbers = 0.05
    turn_limit: PositiveFloat = 0.5
    solve_hz: Annotated[float, Field(ge=10.0, le=1000.0)] = 100.0
    motion: IkMotion = IkMotion()
    kp: PositiveFloat = 900.0
    damping_ratio: NonNegativeFloat = 1.0
    tolerance: tuple[PositiveFloat, PositiveFloat] = (1e-3, 3.5e-3)


class IkPoseController(PartController[JointLaw]):
    """Moves a hand's goal by actions of a position and a quaternion, x y z w.

    The quaternion is the pose's, or in delta mode that of the turn; it is normalised,
    and one of length 0 is no turn. The law tracks joint references that are smooth
    between two solves.
    """

    needs_hand = True

    def __init__(
        self, part: RobotPart, config: IkPoseConfig, state: RobotState
    ) -> None:
        assert part.hand is not None
        self.config, self._state = config, state
        kd = damping_of(config.kp, config.damping_ratio)
        self.law = JointLaw(state, part.joints, kp=config.kp, kd=kd)
        apply_torque_settings(self.law, config)
        self.law.keep_limits(state)
        step = float(state.model.opt.timestep)
        self._steps = max(1, round(1.0 / (config.solve_hz * step)))
        self._ik = _PartIk(state, part, config.motion, self._steps * step)
        self._base = state.model.body(state.prefix + state.robot.links[0].name).id
        if config.input_ref_frame == "world":
            self._base = 0
        self._scaling = InputScaling(3, config, config.output_min, config.output_max)
        self.slices = (_pose_part(part.name, config, self._scaling),)
        self._goal = HandGoal(config)
        self._due = np.zeros(1)  # time of the next solve, s

    @property
    def goal(self) -> pin.SE3:
        """Pose to go to, in the reference's axes."""
        return self._goal.pose

    @property
    def memory(self) -> Parts:
        """Goal, the time of the next solve, and what the last one left."""
        return *self._goal.memory, self._due, *self._ik.memory

    def resume(self, state: RobotState) -> None:
        """Take the posture that is preferred, and the configuration solved last."""
        self._ik.resume()

    def reset(self, state: RobotState) -> None:
        """Hold the hand where it is, and the posture that it has."""
        self._ik.reset(state)
        self._goal.reset(pose_vector(self._hand()))
        self.law.aim(state.data.qpos[self.law.drives["qpos"]])
        self._due[:] = state.time

    def set_goal(self, values: Vector, period: float) -> None:
        """Take a position and a quaternion, x y z w, shape (7,)."""
        turn = None
        if float(np.linalg.norm(values[3:])) >= ROUNDING:
            turn = pin.Quaternion(*values[[6, 3, 4, 5]]).normalized().matrix()
        if self.config.input_type == "absolute":
            rotation = self.goal.rotation if turn is None else turn
            self._goal.set(pin.SE3(rotation, values[:3]))
            return
        rotation = np.zeros(3) if turn is None else pin.log3(turn)
        angle = float(np.linalg.norm(rotation))
        rotation = rotation * min(1.0, self.config.turn_limit / max(angle, ROUNDING))
        step = np.concatenate([self._scaling(values[:3]), rotation])
        self._goal.step(step, pose_vector(self._hand()))

    def prepare(self, state: RobotState) -> int:
        """Solve when it is time to; return how many physics steps are left."""
        step = float(state.model.opt.timestep)
        left = round((self._due.item() - state.time) / step)
        if left > 0:
            return left
        self._due[:] = state.time + self._steps * step
        self.law.aim(*self._ik.solve(state, self._reference() * self.goal))
        return self._steps

    @property
    def hold_action(self) -> Vector:
        """The action that keeps the goal."""
        if self.config.input_type == "delta":
            return np.concatenate([self._scaling.neutral, [0.0, 0.0, 0.0, 1.0]])
        return pin.SE3ToXYZQUAT(self.goal)

    def report(self, state: RobotState) -> dict[str, Any]:
        """Return whether the goal is reached, by how much it is missed, and why.

        The keys are those of a `TaskReport`.
        """
        goal, hand = self._reference() * self.goal, self._ik.measured(state)
        position = float(np.linalg.norm(goal.translation - hand.translation))
        angle = float(np.linalg.norm(pin.log3(hand.rotation.T @ goal.rotation)))
        linear, angular = self.config.tolerance
        near = position <= linear and angle <= angular
        return {
            "name": self.slices[0].name,
            "position_error": position,
            "orientation_error": angle,
            "reached": near,
            "reasons": () if near else self._ik.reasons(),
        }

    def _hand(self) -> pin.SE3:
        """Return the measured pose of the hand in the goals' axes."""
        return self._reference().actInv(self._ik.measured(self._state))

    def _reference(self) -> pin.SE3:
        """Return the pose of the goals' axes in the world."""
        data = self._state.data
        R = data.xmat[self._base].reshape(3, 3)
        return pin.SE3(R.copy(), data.xpos[self._base].copy())


def _pose_part(name: str, config: IkPoseConfig, scaling: InputScaling) -> ActionPart:
    """Return the action slice: x y z, and a quaternion."""
    units, high = (Unit("m"),) * 3, np.full(3, REACH)
    low = -high
    if config.input_type == "delta":
        low, high, units = scaling.low, scaling.high, scaling.units(units)
    return ActionPart(
        name=name,
        kind=SliceKind.POSE,
        labels=AXES,
        units=(*units, *(Unit("quaternion"),) * 4),
        low=(*low.tolist(), *(-1.0,) * 4),
        high=(*high.tolist(), *(1.0,) * 4),
        wraps=True,
    )


class _PartIk:
    """Moves the joint references of a part so that its hand goes to a pose.

    A task stack over these joints alone; all others enter by the measured pose of the
    link that carries the part:

        minimise    || J dq - gain e ||^2,  then  || q + dq - q_rest ||^2
        subject to  limits of position, velocity and acceleration

    The period is the time between two solves, s.
    """

    def __init__(
        self, state: RobotState, part: RobotPart, motion: IkMotion, period: float
    ) -> None:
        self._hand, self._motion, self._period = str(part.hand), motion, period
        self._site = state.model.site(state.prefix + self._hand).id
        joints, whole = part.joints, state.robot.to_pinocchio()
        others = [i for i, name in enumerate(whole.names) if i and name not in joints]
        model = pin.buildReducedModel(whole, others, pin.neutral(whole))
        self._configuration = Configuration(model)
        found = [model.joints[self._configuration.joint_id(name)] for name in joints]
        self._places = np.array([joint.idx_q for joint in found], dtype=np.int64)
        speeds = np.array([joint.idx_v for joint in found], dtype=np.int64)
        self._addresses = state.joint_addresses(joints)[0]
        carrier = next(
            link.parent
            for link in state.robot.links
            if link.joint is not None and link.joint.name == joints[0]
        )
        self._carrier = state.model.body(f"{state.prefix}{carrier}").id
        self._T_oc = self._configuration.frame_pose(str(carrier))
        feasible = feasible_accelerations(
            state.robot, most=motion.acceleration, effort_share=motion.effort_share
        )
        own = {joint: feasible[joint] for joint in joints}
        self._task = FrameTask(
            self._hand,
            gain=motion.gain,
            max_linear_speed=UNLIMITED,
            max_angular_speed=UNLIMITED,
        )
        self._rest = self._configuration.q.copy()
        self._posture = PostureTask(
            motion.posture_cost, gain=motion.posture_gain, level=1
        )
        self._stack = TaskStack(
            self._configuration,
            [self._task, self._posture],
            limits=[
                PositionLimit(margin=1e-3),
                VelocityLimit(),
                AccelerationLimit(motion.acceleration, joints=own),
            ],
            escape=False,
        )
        mean = window_length(max(own.values()), motion.jerk, period)
        self._spline = SplineReference(
            self._configuration, self._places, speeds, period, mean=mean
        )

    @property
    def memory(self) -> Parts:
        """Configuration, spline, QP and preferred posture; views."""
        q, rest = self._configuration.q, self._rest
        return q, rest, *self._spline.memory, *self._stack.memory

    def resume(self) -> None:
        """Compute what follows from values that were written into `memory`."""
        self._configuration.refresh()
        self._posture.set_target(self._rest)

    def reset(self, state: RobotState) -> None:
        """Start from rest; the present posture becomes the preferred one."""
        self._configuration.q[self._places] = state.data.qpos[self._addresses]
        self._configuration.refresh()
        self._stack.reset()
        self._rest[:] = self._configuration.q
        self._posture.set_target(self._rest)
        self._spline.reset()

    def solve(self, state: RobotState, goal: pin.SE3) -> Matrix:
        """Plan the next period towards a pose in the world; return the spline's motion.

        It is a buffer.
        """
        R = state.data.xmat[self._carrier].reshape(3, 3)
        T_wc = pin.SE3(R, state.data.xpos[self._carrier])
        target = approach_pose(
            self._configuration.frame_pose(self._hand),
            self._T_oc * T_wc.actInv(goal),
            dt=self._period,
            gain=self._motion.gain,
            speed=self._motion.speed,
            acceleration=self._motion.braking,
        )
        self._task.set_target(target)
        self._spline.extend(self._stack.solve(self._period).v)
        return self._spline.motion

    def measured(self, state: RobotState) -> pin.SE3:
        """Return the pose of the hand in the world."""
        data = state.data
        R = data.site_xmat[self._site].reshape(3, 3)
        return pin.SE3(R.copy(), data.site_xpos[self._site].copy())

    def reasons(self) -> LazyReasons:
        """Return why the hand is not at its goal; computed when first read."""
        return LazyReasons(partial(_reasons, self._stack.record(), self._hand))


def _reasons(record: TickRecord, hand: str) -> tuple[Reason, ...]:
    reports = record.explain(position_tolerance=0.0, orientation_tolerance=0.0)
    return reports[hand].reasons if hand in reports else ()
