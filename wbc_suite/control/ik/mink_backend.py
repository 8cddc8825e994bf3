"""Inverse kinematics by mink, on the MuJoCo model of the robot alone."""

from functools import partial

import mink
import mujoco
import numpy as np

from wbc_suite.control.ik.backend import IkBackend, IkStep
from wbc_suite.control.ik.config import (
    ControlledFrame,
    WholeBodyIKConfig,
)
from wbc_suite.control.ik.qp_of_config import TRACKING_COST, travel_costs
from wbc_suite.control.law.joint_laws import JointLaw
from wbc_suite.control.law.spline_reference import SplineReference
from wbc_suite.control.poses import pose_of
from wbc_suite.control.reasons import NoSolution, Reason
from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Configuration, Conversion
from wbc_suite.qp import ActiveLimit, LimitKind, ObstacleLimit
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Matrix, Vector

LEVEL_FACTOR = 0.03
"""mink has weights only: each level counts this much of the one above."""

POSTURE_FACTOR = 0.1
"""Further factor on the posture, which would pull frames off their targets."""


class HeldPoint(mink.Task):
    """The position of a frame as an equality; those of a FrameTask hold turns too."""

    def __init__(self, frame: str, frame_type: str, gain: float) -> None:
        super().__init__(cost=np.ones(3), gain=gain)
        self._frame, self._target = (frame, frame_type), np.zeros(3)

    def set_target_from_configuration(self, configuration: mink.Configuration) -> None:
        """Hold the frame where it is."""
        pose = configuration.get_transform_frame_to_world(*self._frame)
        self._target = pose.translation()

    def compute_error(self, configuration: mink.Configuration) -> Vector:
        """Return the distance from the target, world axes, m, shape (3,)."""
        pose = configuration.get_transform_frame_to_world(*self._frame)
        return pose.translation() - self._target

    def compute_jacobian(self, configuration: mink.Configuration) -> Matrix:
        """Return its derivative, shape (3, nv)."""
        pose = configuration.get_transform_frame_to_world(*self._frame)
        J_local = configuration.get_frame_jacobian(*self._frame)
        return pose.rotation().as_matrix() @ J_local[:3]


class MinkBackend(IkBackend):
    """`IkBackend` over mink's weighted tasks and limits, solved by daqp.

    Levels become weights; there is no limit of accelerations and none of obstacles.
    """

    def __init__(
        self,
        robot: RobotDescription,
        config: WholeBodyIKConfig,
        commanded: Configuration,
        obstacles: ObstacleLimit | None = None,
    ) -> None:
        if config.tasks or config.more_limits:
            raise ConfigError(
                "WHOLE_BODY_MINK_IK takes no [[task]] or [[limit]]: use WHOLE_BODY_IK."
            )
        self._config, self._commanded = config, commanded
        self._model = robot.to_mjspec().compile()
        self._conversion = Conversion(self._model, commanded.model)
        self.v: Vector = np.zeros(commanded.nv)
        self._last = IkStep(v=self.v)
        self._configuration = mink.Configuration(self._model)
        self._sites = {self._model.site(i).name for i in range(self._model.nsite)}
        self._tasks = [self._task(frame) for frame in config.frames]
        self._posture = mink.PostureTask(
            self._model, self._posture_costs(), gain=config.posture.gain
        )
        self._joints = mink.PostureTask(self._model, self._joint_costs(robot))
        self._held = [self._hold(held.frame, held.contact) for held in config.held]
        self._limits = self._make_limits(robot)

    def reset(self) -> None:
        """Hold feet where they are."""
        self.v[:], self._last = 0.0, IkStep(v=np.zeros_like(self.v))
        self.resume()

    def resume(self) -> None:
        """Hold feet where they are commanded."""
        self._place()
        for task in self._held:
            task.set_target_from_configuration(self._configuration)

    def set_targets(self, targets: Matrix) -> None:
        """Set the targets of all controlled frames."""
        for task, pose in zip(self._tasks, map(pose_of, targets), strict=True):
            if isinstance(task, mink.ComTask):
                task.set_target(pose.translation)
            else:
                task.set_target(mink.SE3.from_matrix(pose.homogeneous))

    def set_posture(self, q: Vector) -> None:
        """Set the posture to prefer."""
        self._posture.set_target(self._conversion.q_to_mujoco(q))

    def solve(self, dt: float, left: tuple[int, int] | None = None) -> None:
        """Solve one tick; hold still where mink finds no solution."""
        self._take(self._solve([*self._tasks, self._posture], dt))

    def solve_posture(self, posture: Vector, dt: float) -> None:
        """Solve one tick without frames."""
        self._joints.set_target(self._conversion.q_to_mujoco(posture))
        self._take(self._solve([self._joints], dt))

    def limit_steps(
        self, reference: SplineReference, law: JointLaw, data: mujoco.MjData
    ) -> None:
        """Do nothing: mink's commands may lead their joints."""

    def last_step(self, *, in_loop: bool) -> IkStep:
        """Return the answer of the last tick."""
        return self._last

    def _take(self, step: IkStep) -> None:
        self.v[:], self._last = step.v, step

    def _place(self) -> None:
        """Move mink's robot to the commanded configuration."""
        self._configuration.update(self._conversion.q_to_mujoco(self._commanded.q))

    def _solve(self, tasks: list[mink.Task], dt: float) -> IkStep:
        self._place()
        try:
            v = mink.solve_ik(
                self._configuration,
                tasks,
                dt,
                "daqp",
                damping=1e-6,
                limits=self._limits,
                constraints=self._held or None,
            )
        except mink.MinkError:
            v = np.full(self._model.nv, np.nan)
        if not np.isfinite(v).all():
            still = np.zeros(len(self._conversion.v_index))
            return IkStep(v=still, limits=lambda: (NoSolution(),), ok=False)
        qpos = self._configuration.q
        return IkStep(
            v=self._conversion.v_to_pinocchio(qpos, v),
            limits=partial(self._active, qpos.copy(), v, dt),
        )

    def _task(self, frame: ControlledFrame) -> mink.FrameTask | mink.ComTask:
        weight = LEVEL_FACTOR**frame.level
        if frame.frame is None:
            return mink.ComTask(weight * frame.position_cost, gain=frame.gain)
        position, orientation = frame.behaviour.costs(frame)
        return mink.FrameTask(
            frame.frame,
            self._frame_type(frame.frame),
            position_cost=weight * position,
            orientation_cost=weight * orientation,
            gain=frame.gain,
            lm_damping=1e-3,
        )

    def _frame_type(self, frame: str) -> str:
        return "site" if frame in self._sites else "body"

    def _posture_costs(self) -> Vector:
        posture = self._config.posture
        factor = POSTURE_FACTOR * LEVEL_FACTOR**posture.level
        costs = np.full(self._model.nv, factor * posture.cost)
        for k in range(self._model.njnt):
            joint = self._model.joint(k)
            first = joint.dofadr[0]
            if joint.name in posture.costs:
                costs[first] = factor * posture.costs[joint.name]
            if joint.name.startswith("root"):
                costs[first : first + (6 if joint.type[0] == 0 else 1)] = 0.0
        return costs

    def _joint_costs(self, robot: RobotDescription) -> Vector:
        costs = np.zeros(self._model.nv)  # a free root's stay
        for joint, cost in travel_costs(robot, TRACKING_COST).items():
            costs[self._model.joint(joint).dofadr[0]] = cost
        return costs

    def _hold(self, frame: str, contact: str) -> mink.FrameTask | HeldPoint:
        kind, gain = self._frame_type(frame), self._config.frames[0].gain
        if contact != "point":
            turning = [float(contact == "surface"), 1.0, 1.0]
            return mink.FrameTask(frame, kind, 1.0, turning, gain=gain)
        return HeldPoint(frame, kind, gain)

    def _make_limits(self, robot: RobotDescription) -> list[mink.Limit]:
        limits = self._config.limits
        known = {j.name: j.velocity for j in robot.joints if j.velocity is not None}
        speeds = {name: limits.velocity_scale * v for name, v in known.items()}
        linear, angular = robot.root.velocity
        if robot.root.kind == "planar":
            speeds |= {"root_x": linear, "root_y": linear, "root_yaw": angular}
        position = mink.ConfigurationLimit(
            self._model, min_distance_from_limits=limits.position_margin
        )
        return [position, mink.VelocityLimit(self._model, speeds)]

    def _active(self, q: Vector, v: Vector, dt: float) -> tuple[Reason, ...]:
        """Return joints that the step brings to a position limit."""
        found: list[Reason] = []
        margin = self._config.limits.position_margin + 1e-6
        for k in np.flatnonzero(self._model.jnt_limited).tolist():
            dof, place = self._model.jnt_dofadr[k], self._model.jnt_qposadr[k]
            reached = q[place] + dt * v[dof]
            low, high = self._model.jnt_range[k]
            if low + margin < reached < high - margin:
                continue
            slides = self._model.jnt_type[k] == mujoco.mjtJoint.mjJNT_SLIDE
            limit = ActiveLimit(
                kind=LimitKind.POSITION,
                subject=self._model.joint(k).name,
                side="lower" if reached <= low + margin else "upper",
                is_joint=True,
                unit="m" if slides else "rad",
                multiplier=0.0,  # mink returns none
            )
            found.append(limit)
        return tuple(found)
