"""Inverse kinematics of one part, relative to the link that carries it."""

from functools import partial

import numpy as np
import pinocchio as pin
from pydantic import Field, NonNegativeFloat, PositiveFloat

from wbc_suite.control.part.approach import approach_pose
from wbc_suite.control.part.feasible_acceleration import feasible_accelerations
from wbc_suite.control.part.spline_reference import SplineReference, window_length
from wbc_suite.control.reasons import LazyReasons, Reason
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
from wbc_suite.typing import Matrix

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


class PartIk:
    """Moves the joint references of a part so that its hand goes to a pose.

    A task stack over these joints alone; all others enter by the measured pose of the
    link that carries the part:

        minimise    || J dq - gain e ||^2,  then  || q + dq - q_rest ||^2
        subject to  limits of position, velocity and acceleration

    Args:
        state: The robot in the simulation.
        joints: Joints of the part, from its root on.
        hand: Frame to move.
        motion: How to move.
        period: Time between two solves, s.
    """

    def __init__(
        self,
        state: RobotState,
        joints: tuple[str, ...],
        hand: str,
        *,
        motion: IkMotion,
        period: float,
    ) -> None:
        self._hand, self._motion, self._period = hand, motion, period
        self._site = state.model.site(state.prefix + hand).id
        self._configuration = Configuration(_only(state.robot.to_pinocchio(), joints))
        model = self._configuration.model
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
        self._task = FrameTask(
            hand,
            gain=motion.gain,
            max_linear_speed=UNLIMITED,
            max_angular_speed=UNLIMITED,
        )
        self._posture = PostureTask(
            motion.posture_cost, gain=motion.posture_gain, level=1
        )
        self._stack = TaskStack(
            self._configuration,
            [self._task, self._posture],
            limits=[
                PositionLimit(margin=1e-3),
                VelocityLimit(),
                AccelerationLimit(
                    motion.acceleration, joints={j: feasible[j] for j in joints}
                ),
            ],
            escape=False,
        )
        most = max(feasible[joint] for joint in joints)
        self._reference = SplineReference(
            self._configuration,
            self._places,
            speeds,
            period,
            mean=window_length(most, motion.jerk, period),
        )

    def reset(self, state: RobotState) -> None:
        """Start from rest; the present posture becomes the preferred one."""
        self._configuration.q[self._places] = state.data.qpos[self._addresses]
        self._configuration.refresh()
        self._stack.reset()
        self._posture.set_target(self._configuration.q)
        self._reference.reset()

    def solve(self, state: RobotState, goal: pin.SE3) -> Matrix:
        """Plan the next period towards a pose in the world.

        Returns:
            Motion of the joints until the next solve, see `SplineReference`: a buffer.
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
        self._reference.extend(self._stack.solve(self._period).v)
        return self._reference.motion

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


def _only(model: pin.Model, joints: tuple[str, ...]) -> pin.Model:
    """Return the model with all joints fixed but these."""
    others = [i for i, name in enumerate(model.names) if i and name not in joints]
    return pin.buildReducedModel(model, others, pin.neutral(model))
