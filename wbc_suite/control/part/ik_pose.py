"""IK_POSE: actions are poses of the hand; inverse kinematics gives joint references."""

from dataclasses import replace
from functools import partial
from typing import Annotated, Any, Literal

import numpy as np
import pinocchio as pin
from pydantic import Field, NonNegativeFloat, PositiveFloat

from wbc_suite.config_files import FrozenModel
from wbc_suite.control.action import ActionPart, Axis, SliceKind, Unit
from wbc_suite.control.ground.feasible_acceleration import feasible_accelerations
from wbc_suite.control.law.joint_laws import JointLaw
from wbc_suite.control.law.spline_reference import SplineReference, window_length
from wbc_suite.control.memory import Parts
from wbc_suite.control.part.controller import PartController
from wbc_suite.control.part.hand_goal import HandGoal, HandSettings, relative_pose
from wbc_suite.control.part.ik_tick import HandIk, HandState
from wbc_suite.control.part.part_settings import (
    REACH,
    ROUNDING,
    Numbers,
    PartSettings,
    SliceInput,
    apply_torque_settings,
    damping_of,
)
from wbc_suite.control.poses import row_of, vector_pose
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
from wbc_suite.qp.tick import TickStatus
from wbc_suite.robot.arms import FEW_JOINTS, has_few_joints
from wbc_suite.typing import Vector

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
    and one of length 0 is no turn. A stack of QP tasks over the joints of the part
    moves their references, in the control loop (`ik_tick`), so that the hand goes to
    the goal:

        minimise    || J dq - gain e ||^2,  then  || q + dq - q_rest ||^2
        subject to  limits of position, velocity and acceleration

    References are smooth between two solves.
    """

    needs_hand = True

    def __init__(
        self, part: RobotPart, config: IkPoseConfig, state: RobotState
    ) -> None:
        assert part.hand is not None
        self.config, self._state, self._hand = config, state, part.hand
        self._has_few = has_few_joints(state.robot, part.hand)
        site = state.model.site(state.prefix + part.hand).id
        kd = damping_of(config.kp, config.damping_ratio)
        self.law = JointLaw(state, part.joints, kp=config.kp, kd=kd)
        apply_torque_settings(self.law, config)
        self.law.keep_limits(state)
        self._base = state.model.body(state.prefix + state.robot.links[0].name).id
        if config.input_ref_frame == "world":
            self._base = 0
        data = state.data
        self._frames = (
            data.xmat[self._base].reshape(3, 3),
            data.xpos[self._base],
            data.site_xmat[site].reshape(3, 3),
            data.site_xpos[site],
        )
        self._input = SliceInput(
            part.name,
            SliceKind.POSE,
            labels=AXES[:3],
            units=(Unit("m"),) * 3,
            config=config,
            outputs=(config.output_min, config.output_max),
            limits=(np.full(3, -REACH), np.full(3, REACH)),
        )
        self.slices = (_with_quaternion(self._input.action),)
        self._goal = HandGoal(config)
        self._tick = HandState.zeros()
        self._make_stack(part)

    def _make_stack(self, part: RobotPart) -> None:
        """Make the stack and the spline of the part alone; other joints are fixed."""
        robot, motion = self._state.robot, self.config.motion
        whole, joints = robot.to_pinocchio(), part.joints
        others = [i for i, name in enumerate(whole.names) if i and name not in joints]
        model = pin.buildReducedModel(whole, others, pin.neutral(whole))
        self._configuration = Configuration(model)
        found = [model.joints[self._configuration.joint_id(name)] for name in joints]
        self._places = np.array([joint.idx_q for joint in found], dtype=np.int64)
        speeds = np.array([joint.idx_v for joint in found], dtype=np.int64)
        feasible = feasible_accelerations(
            robot, most=motion.acceleration, effort_share=motion.effort_share
        )
        own = {joint: feasible[joint] for joint in joints}
        hand = FrameTask(
            self._hand,
            orientation_cost=FEW_JOINTS if self._has_few else 1.0,
            gain=motion.gain,
            max_linear_speed=UNLIMITED,
            max_angular_speed=UNLIMITED,
        )
        self._posture = PostureTask(
            motion.posture_cost, gain=motion.posture_gain, level=1
        )
        limits = (
            PositionLimit(margin=1e-3),
            VelocityLimit(),
            AccelerationLimit(motion.acceleration, joints=own),
        )
        self._stack = TaskStack(
            self._configuration, [hand, self._posture], limits=limits, escape=False
        )
        step = float(self._state.model.opt.timestep)
        self._steps = max(1, round(1.0 / (self.config.solve_hz * step)))
        self._period = self._steps * step
        mean = window_length(max(own.values()), motion.jerk, self._period)
        self._spline = SplineReference(
            self._configuration, self._places, speeds, self._period, mean=mean
        )
        self._rest = self._configuration.q.copy()
        carrier = next(
            link.parent
            for link in robot.links
            if link.joint is not None and link.joint.name == joints[0]
        )
        self._carrier = str(carrier)
        self._carrier_pose = row_of(self._configuration.frame_pose(self._carrier))

    def loop_tick(self) -> HandIk:
        """Return the tick for the control loop, once the law is in its table."""
        motion, state, model = (
            self.config.motion,
            self._state,
            self._configuration.model,
        )
        hand = model.frames[self._configuration.frame_id(self._hand)]
        return HandIk(
            state=self._tick,
            goal=self._goal.vector,
            base=self._base,
            carrier=state.model.body(state.prefix + self._carrier).id,
            carrier_pose=self._carrier_pose,
            joint=int(hand.parentJoint),
            offset=row_of(hand.placement),
            gain=motion.gain,
            speed=np.array(motion.speed),
            braking=np.array(motion.braking),
            qp=self._stack.arrays,
            target=self._stack.target_of(self._stack.tasks[0]),
            spline=self._spline.argument,
            law=self.law.index,
            steps=self._steps,
        )

    def finish_tick(self) -> None:
        """Finish a tick that the control loop has begun, if there is one."""
        tick = self._tick[0]
        if tick.status != TickStatus.SOLVED and tick.countdown <= 0:
            status, level = int(tick.status), int(tick.level)
            self._spline.extend(self._stack.complete(self._period, status, level).v)
            self.law.aim(*self._spline.motion)
            tick.countdown = self._steps

    @property
    def goal(self) -> pin.SE3:
        """Pose to go to, in the reference's axes."""
        return self._goal.pose

    @property
    def memory(self) -> Parts:
        """Goal, steps until the next tick, and what the last one left; views."""
        own = self._tick["countdown"], self._configuration.q, self._rest
        return *self._goal.memory, *own, *self._spline.memory, *self._stack.memory

    def resume(self, state: RobotState) -> None:
        """Take the posture that is preferred, and the configuration solved last."""
        self._configuration.refresh()
        self._posture.set_target(self._rest)

    def reset(self, state: RobotState) -> None:
        """Hold the hand where it is; the present posture becomes the preferred one."""
        q = state.data.qpos[self.law.drives["qpos"]]
        self._configuration.q[self._places] = q
        self._configuration.refresh()
        self._stack.reset()
        self._rest[:] = self._configuration.q
        self._posture.set_target(self._rest)
        self._spline.reset()
        self._goal.reset(relative_pose(*self._frames))
        self.law.aim(q)
        self._tick["status"], self._tick["countdown"] = TickStatus.SOLVED, 0

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
        step = np.concatenate([self._input.scaling(values[:3]), rotation])
        self._goal.step(step, relative_pose(*self._frames))

    @property
    def hold_action(self) -> Vector:
        """The action that keeps the goal."""
        if self.config.input_type == "delta":
            return np.concatenate([self._input.neutral, [0.0, 0.0, 0.0, 1.0]])
        return pin.SE3ToXYZQUAT(self.goal)

    def report(self, state: RobotState) -> dict[str, Any]:
        """Return whether the goal is reached, by how much it is missed, and why.

        The keys are those of a `TaskReport`.
        """
        error = vector_pose(relative_pose(*self._frames)).actInv(self.goal)
        position = float(np.linalg.norm(error.translation))
        angle = float(np.linalg.norm(pin.log3(error.rotation)))
        linear, angular = self.config.tolerance
        near = position <= linear and angle <= angular
        return {
            "name": self.slices[0].name,
            "position_error": position,
            "orientation_error": angle,
            "reached": near,
            "reasons": () if near else self._reasons(),
        }

    def _reasons(self) -> LazyReasons:
        """Return why the hand is not at its goal; computed when first read."""
        in_loop = self._tick["status"][0] == TickStatus.SOLVED
        record = self._stack.solution().record if in_loop else self._stack.record()
        return LazyReasons(partial(_explain, record, self._hand))


def _with_quaternion(position: ActionPart) -> ActionPart:
    """Return the slice of a position with a quaternion after it."""
    return replace(
        position,
        labels=AXES,
        units=(*position.units, *(Unit("quaternion"),) * 4),
        low=(*position.low, *(-1.0,) * 4),
        high=(*position.high, *(1.0,) * 4),
        wraps=True,
    )


def _explain(record: TickRecord, hand: str) -> tuple[Reason, ...]:
    reports = record.explain(position_tolerance=0.0, orientation_tolerance=0.0)
    return reports[hand].reasons if hand in reports else ()
