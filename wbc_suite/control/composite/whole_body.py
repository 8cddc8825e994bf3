"""Whole-body inverse kinematics over joint-position control, for any robot."""

import logging
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pinocchio as pin

from wbc_suite.control.action import ActionLayout
from wbc_suite.control.collision_check import CollisionCheck
from wbc_suite.control.composite.backend import IkBackend, IkStep
from wbc_suite.control.composite.clearance import Clearance
from wbc_suite.control.composite.config import WholeBodyIKConfig
from wbc_suite.control.composite.frames import ControlledFrames
from wbc_suite.control.composite.goals import (
    action_of_pose,
    action_part,
    bounded_pose,
    pose_of_action,
    shift_pose,
)
from wbc_suite.control.composite.hindrance import lagging_joint, touches
from wbc_suite.control.composite.names import read_whole_body
from wbc_suite.control.composite.planner import Planner, Waypoint
from wbc_suite.control.composite.reduced import lock_groups
from wbc_suite.control.composite.report import Body, IkReport, WallTime
from wbc_suite.control.composite.tasks import accelerations, soles_of
from wbc_suite.control.part.balance import BalanceLaw
from wbc_suite.control.part.gripper import GripperController
from wbc_suite.control.part.joint import JointLaw
from wbc_suite.control.part.law import Law, commands
from wbc_suite.control.part.reference import Reference, mean_over
from wbc_suite.control.part.stance import StanceContact, StanceLaw
from wbc_suite.control.state import RobotState
from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Configuration, Conversion
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Indices, Matrix, Vector

__all__ = ["WholeBodyIK"]

LOG = logging.getLogger(__name__)

LEAST_LEGS = 3
"""So many points of support are a stool; with fewer, pressure must move under soles."""

BackendFactory = Callable[
    [RobotDescription, WholeBodyIKConfig, Configuration], IkBackend
]


class WholeBodyIK:
    """Moves controlled frames to their goals by solving a stack of QP tasks.

    Solves at `solve_hz` on the commanded configuration, which it integrates; the joint
    law tracks it, interpolated to the physics step. A free root is commanded too, and
    goals are corrected by how far the measured root is from the commanded one, so that
    hands arrive although legs give way.

    Args:
        config: Plain data of a `WholeBodyIKConfig`.
        state: The robot in the simulation.
        backend: Makes the solver.

    Attributes:
        layout: Slices of the action: controlled frames, then grippers.
        robot: The robot that is solved for: grippers and locked groups are rigid.
        frames: Controlled frames, on the commanded configuration.
        q: Commanded configuration, Pinocchio's conventions, shape (nq,).
        goals: Goal of each controlled frame, in the input's reference frame.
        solved_at: When the present joint targets were found, on `time.perf_counter`'s
            clock, s.
    """

    def __init__(
        self, config: Mapping[str, Any], state: RobotState, backend: BackendFactory
    ) -> None:
        name = str(config.get("type"))
        self.config = read_whole_body(config, state.robot, name)
        self.robot = lock_groups(state.robot, self.config.locked)
        self._configuration = Configuration(self.robot.to_pinocchio())
        self._backend = backend(self.robot, self.config, self._configuration)
        model = self._configuration.model
        self.frames = ControlledFrames(self.config, self._configuration)
        self._conversion = Conversion(state.model, model, prefix=state.prefix)
        self._grippers = [
            GripperController(gripper, synergies, state)
            for gripper, synergies in state.robot.synergies.items()
        ]
        self.layout = ActionLayout(
            [
                *(action_part(frame, self.config) for frame in self.config.frames),
                *(part for gripper in self._grippers for part in gripper.slices),
            ]
        )
        moved = _moved_joints(self.robot, state)
        rigid = _rigid_joints(state, {*moved, *self._gripper_joints()})
        gains = self.config.joint_law
        self._law = JointLaw(state, (*moved, *rigid), kp=gains.kp, kd=gains.kd)
        self._stance = _stance_law(self._law.joints, self.config, state)
        self._rigid: Vector = np.zeros(len(rigid))
        self._motion: Matrix = np.zeros((4, len(self._law.joints)))
        self._rigid_index = state.joint_addresses(rigid)[0]
        self._q_index, self._v_index = _joint_indices(model, moved)
        period = 1.0 / (self.config.solve_hz * state.model.opt.timestep)
        self._steps_per_solve = max(1, round(period))
        self._dt = self._steps_per_solve * float(state.model.opt.timestep)
        most = float(accelerations(self.robot, self.config, self._configuration).max())
        mean = mean_over(most, self.config.limits.jerk, self._dt)
        self._reference = Reference(
            model, self._q_index, self._v_index, self._dt, mean=mean
        )
        check = CollisionCheck(state, self._conversion)
        clearance = Clearance(self.robot, self.config)
        self._planner = Planner(
            self.robot,
            self.config,
            self._configuration,
            self.frames,
            room=lambda q: min(clearance.room(q), check.room(q)),
            apart=clearance.limits,
            dt=self._dt,
        )
        servos = tuple(gripper.law for gripper in self._grippers)
        stances = () if self._stance is None else (self._stance,)
        self.laws: tuple[Law, ...] = (self._law, *servos, *stances)
        self._feet = {self.robot.link_of(held.frame) for held in self.config.held}
        kind = self.robot.root.kind
        self._follows_root = kind == "free" or (kind == "planar" and self._in_base())
        self._report = IkReport(self.config, Configuration(model))
        self.reset(state)

    def reset(self, state: RobotState) -> None:
        """Hold the robot where it is."""
        self.solve_time, self.solved_at = 0.0, 0.0
        self.q: Vector = self._conversion.q_to_pinocchio(state.data.qpos)
        self._reference.reset(self.q)
        self._answer = IkStep(v=np.zeros(self._configuration.nv))
        self._rigid = state.data.qpos[self._rigid_index]
        self._motion[0, len(self._q_index) :] = self._rigid
        self._base = self._root_pose()
        self.goals = [self._to_input(self.frames.pose(k)) for k in self._frames()]
        self._homes = [self._to_world(goal) for goal in self.goals]
        self._aims = self._bounded_goals()
        self._backend.reset()
        self._planner.reset(self._preferred_posture())
        for gripper in self._grippers:
            gripper.reset(state)

    def set_goal(self, action: Vector, period: float = 0.05) -> None:
        """Move the goals; see `layout`."""
        before = list(self.goals)
        for k in self._frames():
            frame = self.config.frames[k]
            part = self.layout.slices[k]
            values = action[part.start : part.stop]
            if self.config.input_type == "absolute":
                now = self.goals[k]
                self.goals[k] = pose_of_action(frame.kind, values, now)
            else:
                self.goals[k] = shift_pose(
                    frame.kind, values, self.goals[k], self._delta_axes(k)
                )
        if not all(
            a.isApprox(b, 1e-9) for a, b in zip(before, self.goals, strict=True)
        ):
            self._planner.renew()
        self._aims = self._bounded_goals()
        for gripper in self._grippers:
            part = self.layout[gripper.name]
            gripper.set_goal(action[part.start : part.stop], period)

    def prepare(self, state: RobotState) -> int:
        """Solve; return for how many physics steps the answer is good."""
        self._solve(state)
        self._reference.write(self._motion)
        self._law.follow(self._motion)
        if self._stance is not None:
            self._stance.aim(*self._motion)
            self._stance.lead(self._reference.root_motion())
        return self._steps_per_solve

    @property
    def looks(self) -> bool:
        """Whether `prepare` reads more than joints: a subclass's own may."""
        return type(self).prepare is not WholeBodyIK.prepare

    def compute(self, state: RobotState) -> Vector:
        """Return actuator commands by the readable forms of the laws."""
        return commands(state, self.laws)

    @property
    def hold_action(self) -> Vector:
        """The action that keeps the present goals."""
        action = np.zeros(self.layout.size)
        if self.config.input_type == "absolute":
            for k in self._frames():
                part = self.layout.slices[k]
                kind = self.config.frames[k].kind
                action[part.start : part.stop] = action_of_pose(kind, self.goals[k])
        for gripper in self._grippers:
            part = self.layout[gripper.name]
            action[part.start : part.stop] = gripper.goal
        return action

    @property
    def goals_in_world(self) -> dict[str, pin.SE3]:
        """Goal poses in the world by controlled frame."""
        return {
            frame.name: self._to_world(goal)
            for frame, goal in zip(self.config.frames, self.goals, strict=True)
        }

    @property
    def joint_targets(self) -> dict[str, float]:
        """Where each driven joint is told to be at the next solve, rad or m."""
        targets = self._reference.targets()
        positions = np.concatenate([targets, self._rigid]).tolist()
        return dict(zip(self._law.joints, positions, strict=True))

    def info(self, state: RobotState) -> dict[str, Any]:
        """Return `{"ik": ...}`: what is reached, by how much it is missed, and why."""
        q = self._conversion.q_to_pinocchio(state.data.qpos)
        goals = list(self.goals_in_world.values())
        body = Body(
            commanded=self.q,
            goals=self._corrected(goals, state),
            speed=lambda: self._speed(state),
            touches=lambda: touches(state, apart_from=self._feet),
            lagging=lambda: lagging_joint(
                state, self._law.joints, np.fromiter(self.joint_targets.values(), float)
            ),
        )
        frames = self._report.frames(q, goals, self._answer, body)
        return {
            "ik": {
                "reached": all(report["reached"] for report in frames.values()),
                "solve_time": WallTime(self.solve_time),
                "frames": frames,
            }
        }

    def _speed(self, state: RobotState) -> float:
        """Return the speed of the fastest joint, rad/s or m/s."""
        v = self._conversion.v_to_pinocchio(state.data.qpos, state.data.qvel)
        return float(np.abs(v).max(initial=0.0))

    def _solve(self, state: RobotState) -> None:
        began = time.perf_counter()
        self._configuration.update(self.q)
        if self._follows_root:
            self._base = self._root_pose()
            self._aims = self._corrected(self._bounded_goals(), state)
        waypoint = self._planner.next(self._aims, self._answer.v)
        self._answer = self._step_towards(waypoint)
        self.q = self._reference.extend(self._answer.v)
        self.solved_at = time.perf_counter()
        self.solve_time = self.solved_at - began

    def _bounded_goals(self) -> list[pin.SE3]:
        """Return where frames may be sent, in the world."""
        return [
            bounded_pose(self._to_world(goal), home, frame.range)
            for goal, home, frame in zip(
                self.goals, self._homes, self.config.frames, strict=True
            )
        ]

    def _step_towards(self, waypoint: Waypoint) -> IkStep:
        if waypoint.targets is None:
            return self._backend.solve_posture(waypoint.posture, self._dt)
        self._backend.set_targets(waypoint.targets)
        self._backend.set_posture(waypoint.posture)
        return self._backend.solve(self._dt)

    def _corrected(self, goals: list[pin.SE3], state: RobotState) -> list[pin.SE3]:
        """Return poses in the world of the commanded root."""
        if self.robot.root.kind != "free":
            return goals
        measured = self._conversion.q_to_pinocchio(state.data.qpos)[:7]
        correction = self._base * pin.XYZQUATToSE3(measured).inverse()
        return [correction * goal for goal in goals]

    def _root_pose(self) -> pin.SE3:
        """Return the pose of the first link at the commanded configuration."""
        self._configuration.update(self.q)
        return self._configuration.frame_pose(self.robot.links[0].name)

    def _gripper_joints(self) -> set[str]:
        return {joint for gripper in self._grippers for joint in gripper.law.joints}

    def _frames(self) -> range:
        return range(len(self.config.frames))

    def _to_input(self, pose: pin.SE3) -> pin.SE3:
        return self._base.actInv(pose) if self._in_base() else pose

    def _to_world(self, pose: pin.SE3) -> pin.SE3:
        return self._base * pose if self._in_base() else pose

    def _in_base(self) -> bool:
        return self.config.input_ref_frame == "base"

    def _delta_axes(self, k: int) -> np.ndarray:
        if self.config.input_ref_frame == "eef":
            return self.goals[k].rotation
        return np.eye(3)

    def _preferred_posture(self) -> Vector:
        """Return the preferred posture; the root stays where it is."""
        model, q = self._configuration.model, self.q.copy()
        if self.config.posture.keyframe in self.robot.keyframes:
            for joint, value in self.robot.keyframe(
                self.config.posture.keyframe
            ).items():
                q[model.joints[model.getJointId(joint)].idx_q] = value
        return q


def _moved_joints(robot: RobotDescription, state: RobotState) -> tuple[str, ...]:
    """Return the joints that the IK moves and a motor drives."""
    candidates = robot.joint_names
    if robot.root.kind == "planar":
        candidates = (*robot.root_joint_names, *candidates)
    return tuple(name for name in candidates if name in state.actuators)


def _rigid_joints(state: RobotState, driven: set[str]) -> tuple[str, ...]:
    """Return the joints with a motor that nothing else drives: they are held."""
    return tuple(name for name in state.actuators if name not in driven)


def _stance_law(
    joints: tuple[str, ...], config: WholeBodyIKConfig, state: RobotState
) -> StanceLaw | None:
    if state.robot.root.kind != "free":
        return None
    if not config.held:
        raise ConfigError(
            f"{state.robot.name}: it is free to fall, and the controller holds no foot "
            "([[held]]). Name its feet there, or let it stand on something: "
            "root 'fixed' or 'planar', or another base."
        )
    contacts = [
        StanceContact(
            site=state.model.site(state.prefix + held.frame).id, kind=held.contact
        )
        for held in config.held
    ]
    soles = soles_of(config)
    if not soles and len(contacts) < LEAST_LEGS:
        LOG.warning(
            "%s: it stands on %d feet whose soles nobody has told ([[held]] sole), so "
            "nothing keeps it from tipping over when its hands move: see 'On its own "
            "feet' in docs/robots.md.",
            state.robot.name,
            len(contacts),
        )
    if soles:
        return BalanceLaw(state, joints, contacts, config.joint_law, soles)
    return StanceLaw(state, joints, contacts, config.joint_law)


def _joint_indices(
    model: pin.Model, joints: tuple[str, ...]
) -> tuple[Indices, Indices]:
    found = [model.joints[model.getJointId(name)] for name in joints]
    q = np.array([joint.idx_q for joint in found], dtype=np.int64)
    v = np.array([joint.idx_v for joint in found], dtype=np.int64)
    return q, v
