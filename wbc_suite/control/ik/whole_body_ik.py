"""Whole-body inverse kinematics over joint-position control, for any robot."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pinocchio as pin

from wbc_suite import logs
from wbc_suite.control.action import ActionLayout
from wbc_suite.control.contact.arrays import Tracked
from wbc_suite.control.contact.standing import Standing
from wbc_suite.control.ground.feasible_acceleration import greatest_leads
from wbc_suite.control.ik.backend import IkBackend
from wbc_suite.control.ik.command_lead import MAX_LEAD
from wbc_suite.control.ik.compiled_tick import TickStage, TickState, WholeBodyArrays
from wbc_suite.control.ik.config import (
    WholeBodyIKConfig,
    read_whole_body,
)
from wbc_suite.control.ik.finger_capsules import FingerCapsules
from wbc_suite.control.ik.frame_goals import FrameGoals, place_goals
from wbc_suite.control.ik.frame_targets import ControlledFrames
from wbc_suite.control.ik.qp_of_config import accelerations, limit_checker
from wbc_suite.control.ik.reduced_robot import (
    joint_indices,
    keyframe_posture,
    lock_groups,
    moved_joints,
)
from wbc_suite.control.ik.report import Commanded, IkReport
from wbc_suite.control.ik.scene_obstacles import SceneObstacles
from wbc_suite.control.ik.stack_backend import StackBackend
from wbc_suite.control.ik.waypoint_planner import Waypoint, WaypointPlanner
from wbc_suite.control.law.joint_laws import JointLaw
from wbc_suite.control.law.law import Law
from wbc_suite.control.law.spline_reference import SplineReference, window_length
from wbc_suite.control.memory import Parts
from wbc_suite.control.part.gripper import GripperController
from wbc_suite.control.part.stance_controller import feet_of, soles_of
from wbc_suite.control.state import RobotState
from wbc_suite.errors import ConfigError
from wbc_suite.kinematics import Configuration, Conversion
from wbc_suite.planning import SceneCollisionChecker
from wbc_suite.qp import ObstacleLimit
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.arms import has_few_joints
from wbc_suite.typing import Vector

LOG = logs.logger(__name__)

MIN_POINT_CONTACTS = 3
"""Fewer points of contact cannot balance a robot; soles can."""

BackendFactory = Callable[
    [RobotDescription, WholeBodyIKConfig, Configuration, ObstacleLimit], IkBackend
]


class WholeBodyIK:
    """Moves controlled frames to their goals by solving a stack of QP tasks.

    Solves at `solve_hz` on the commanded configuration, which it integrates; the joint
    law tracks it, interpolated to the physics step. A free root is commanded too.
    The control loop runs ticks itself, see `loop_ticks`; what has no kernel is
    evaluated in Python in between. The config is plain data of a `WholeBodyIKConfig`.

    Attributes:
        layout: Slices of the action: controlled frames, then grippers.
        robot: The reduced robot: grippers and locked groups are rigid.
        frames: Controlled frames, on the commanded configuration.
    """

    def __init__(
        self,
        config: Mapping[str, Any],
        state: RobotState,
        backend: BackendFactory = StackBackend,
    ) -> None:
        self.config = read_whole_body(config, state.robot, str(config.get("type")))
        self.robot = lock_groups(state.robot, self.config.locked)
        self._configuration = Configuration(self.robot.to_pinocchio())
        model = self._configuration.model
        self._conversion = Conversion(state.model, model, prefix=state.prefix)
        timestep = float(state.model.opt.timestep)
        self._steps_per_solve = max(1, round(1.0 / (self.config.solve_hz * timestep)))
        self._dt = self._steps_per_solve * timestep
        limits = accelerations(self.robot, self.config, self._configuration)
        self.frames = ControlledFrames(self.config, self._configuration, limits)
        self._planner = self._make_planner(state)
        self._grippers = [
            GripperController(gripper, synergies, state)
            for gripper, synergies in state.robot.synergies.items()
        ]
        slices = [f.behaviour.action_part(f, self.config) for f in self.config.frames]
        grippers = [part for gripper in self._grippers for part in gripper.slices]
        self.layout = ActionLayout([*slices, *grippers])
        root = -1
        if self.robot.root.kind == "free":
            root = int(state.model.joint(f"{state.prefix}root").qposadr[0])
        self._goals = FrameGoals(
            self.config, self.layout, self.robot, self._configuration, root
        )
        self._scene = SceneObstacles(
            state, self.robot, self.config, self._configuration, self._goals.correction
        )
        self._backend = backend(
            self.robot, self.config, self._configuration, self._scene.limit
        )
        self._fingers = FingerCapsules(
            state,
            self._configuration,
            self._scene.commanded,
            self._backend.self_collision,
        )
        self._make_laws(state, float(limits.max()))
        self._state = TickState.zeros()
        feet = {self.robot.link_of(held.frame) for held in self.config.held}
        robot = state.robot
        self._report = IkReport(
            self.config,
            Configuration(model),
            self._conversion,
            feet=feet,
            few={x for x in robot.hands.values() if has_few_joints(robot, x)},
        )
        self.reset(state)

    def _make_planner(self, state: RobotState) -> WaypointPlanner:
        scene = SceneCollisionChecker(state.model, state.data, self._conversion)
        kept = limit_checker(self.robot, self.config, self._configuration.model)
        return WaypointPlanner(
            self.robot,
            self.config,
            self._configuration,
            self.frames,
            clearance=lambda q: min(kept.clearance(q), scene.clearance(q)),
            distance_limits=kept.distances,
            dt=self._dt,
        )

    def _make_laws(self, state: RobotState, max_acceleration: float) -> None:
        """Make laws of all joints with a motor; those not solved for are held."""
        moved = moved_joints(self.robot, state)
        driven = {*moved, *(j for g in self._grippers for j in g.law.joints)}
        held = tuple(name for name in state.actuators if name not in driven)
        gains = self.config.joint_law
        self._law = JointLaw(state, (*moved, *held), kp=gains.kp, kd=gains.kd)
        most = greatest_leads(self.robot, gains.kp)
        leads = [min(MAX_LEAD, most.get(j, MAX_LEAD)) for j in self._law.joints]
        self._law.drives["windup_max"] = leads
        self._held_index = state.joint_addresses(held)[0]
        q_index, v_index = joint_indices(self._configuration.model, moved)
        mean = window_length(max_acceleration, self.config.limits.jerk, self._dt)
        self._reference = SplineReference(
            self._configuration,
            q_index,
            v_index,
            self._dt,
            mean=mean,
            width=len(self._law.joints),
        )
        self.laws: tuple[Law, ...] = (self._law, *(g.law for g in self._grippers))
        self.standing = None
        if self.robot.root.kind == "free":
            self.standing = self._make_standing(state)

    def _make_standing(self, state: RobotState) -> Standing:
        """Return what keeps a robot on its feet.

        Raises:
            ConfigError: If the controller holds no foot.
        """
        config, name, reference = self.config, self.robot.name, self._reference
        if not config.held:
            raise ConfigError(
                f"{name}: it has a free root, and the controller holds no foot, so it "
                "would fall. Name its feet as [[held]], or choose the root 'fixed' or "
                "'planar', or another base."
            )
        if not soles_of(config.held) and len(config.held) < MIN_POINT_CONTACTS:
            LOG.warning(
                "%s: it stands on %d feet whose soles are unknown ([[held]] sole), so "
                "nothing keeps it from tipping over when its hands move: see 'Legged "
                "robots with a free root' in docs/robots.md.",
                name,
                len(config.held),
            )
        motion = Tracked(
            joints=reference.motion,
            start=reference.start,
            root=reference.root,
            since=reference.since,
            wanted=np.zeros(6),
        )
        return Standing(
            state,
            self._law.joints,
            feet=feet_of(config.held, state),
            stiffness=config.joint_law.kp,
            motion=motion,
        )

    @property
    def memory(self) -> Parts:
        """What outlives a tick; views. A planned motion is not part of it."""
        parts = [array for gripper in self._grippers for array in gripper.memory]
        own = self._configuration.q, self._state["countdown"]
        references = *self._reference.memory, *self._goals.memory
        solved = *self._planner.memory, *self._backend.memory
        standing = self.standing.memory if self.standing else ()
        return *own, *references, *solved, *parts, *standing

    def resume(self, state: RobotState) -> None:
        """Go on from values that were written into `memory`."""
        self._configuration.refresh()
        self._goals.resume()
        self._planner.resume()
        self._backend.resume()

    def reset(self, state: RobotState) -> None:
        """Hold the robot where it is."""
        self._configuration.update(self._conversion.q_to_pinocchio(state.data.qpos))
        self._reference.reset()
        self._state["stage"], self._state["countdown"] = TickStage.DONE_IN_PYTHON, 0
        motion, held = self._reference.motion, state.data.qpos[self._held_index]
        motion[0, motion.shape[1] - len(held) :] = held
        poses = [self.frames.pose(k) for k in range(len(self.config.frames))]
        base = self._configuration.frame_pose(self.robot.links[0].name)
        self._goals.reset(poses, base)
        self._backend.reset()
        keyframe = self.config.posture.keyframe
        self._planner.reset(keyframe_posture(self.robot, self._configuration, keyframe))
        for gripper in self._grippers:
            gripper.reset(state)
        if self.standing is not None:
            self.standing.reset(state)

    @property
    def q(self) -> Vector:
        """Commanded configuration, Pinocchio's conventions, shape (nq,), a copy."""
        return self._configuration.q.copy()

    @property
    def goals(self) -> list[pin.SE3]:
        """Goal of each controlled frame, in the input's reference frame."""
        return self._goals.poses

    def set_goal(self, action: Vector, period: float = 0.05) -> None:
        """Move the goals; see `layout`."""
        if self._goals.set(action):
            self._planner.renew()
        for gripper in self._grippers:
            part = self.layout[gripper.name]
            gripper.set_goal(action[part.start : part.stop], period)

    def prepare(self, state: RobotState) -> int:
        """Run a tick; return for how many physics steps it is enough."""
        robot, qpos = self._configuration.robot, state.data.qpos
        self._backend.limit_steps(self._reference, self._law, state.data)
        place_goals(self._goals.argument, robot, self.frames.argument, qpos)
        self._scene.measure()
        self._fingers.place()
        self._follow(self._planner.next(self._backend.v))
        return self._steps_per_solve

    def loop_ticks(self) -> tuple[WholeBodyArrays, ...]:
        """Return the tick for the control loop, or none where Python has to solve."""
        stack = self._backend.loop_arrays()
        if stack is None:
            return ()
        tick = WholeBodyArrays(
            state=self._state,
            goals=self._goals.argument,
            frames=self.frames.argument,
            scene=self._scene.argument,
            fingers=self._fingers.argument,
            posture=self.frames.posture_argument,
            progress=self._planner.argument,
            qp=stack.qp,
            target=stack.target,
            motors=stack.motors,
            spline=self._reference.argument,
            v=self._backend.v,
            joint_law=self._law.index,
            steps=self._steps_per_solve,
        )
        return (tick,)

    def finish_tick(self) -> None:
        """Finish a tick that the control loop has begun, if there is one."""
        tick, backend = self._state[0], self._backend
        stage = int(tick["stage"])
        if stage in (TickStage.DONE, TickStage.DONE_IN_PYTHON):
            return
        if stage == TickStage.PLAN:
            self._follow(self._planner.respond(int(tick["event"]), backend.v))
        else:
            backend.solve(self._dt, (int(tick["status"]), int(tick["level"])))
            self._move()
        tick["countdown"] = self._steps_per_solve

    def _follow(self, waypoint: Waypoint) -> None:
        """Solve for a waypoint, and move the commanded robot."""
        if waypoint.targets is None:
            self._backend.solve_posture(waypoint.posture, self._dt)
        else:
            self._backend.set_targets(waypoint.targets)
            self._backend.set_posture(waypoint.posture)
            self._backend.solve(self._dt)
        self._move()

    def _move(self) -> None:
        """Move the commanded robot as solved, and hand the spline to the laws."""
        self._reference.extend(self._backend.v)
        self._law.aim(*self._reference.motion)
        self._state["stage"] = TickStage.DONE_IN_PYTHON

    @property
    def hold_action(self) -> Vector:
        """The action that keeps the present goals."""
        action = np.zeros(self.layout.size)
        self._goals.hold(action)
        for gripper in self._grippers:
            part = self.layout[gripper.name]
            action[part.start : part.stop] = gripper.goal
        return action

    @property
    def goals_in_world(self) -> dict[str, pin.SE3]:
        """Goal poses in the world by controlled frame."""
        names = [frame.name for frame in self.config.frames]
        return dict(zip(names, self._goals.in_world(), strict=True))

    @property
    def joint_targets(self) -> dict[str, float]:
        """Target of each driven joint at the next solve, rad or m."""
        targets = self._reference.targets()
        positions = [*targets, *self._reference.motion[0, len(targets) :]]
        return dict(zip(self._law.joints, map(float, positions), strict=True))

    def info(self, state: RobotState) -> dict[str, Any]:
        """Return `{"ik": ...}`: what is reached, by how much it is missed, and why."""
        goals, stage = self._goals.in_world(), self._state["stage"][0]
        corrected = self._corrected(goals, state)
        commanded = Commanded(self.q, corrected, self.joint_targets)
        answer = self._backend.last_step(in_loop=stage == TickStage.DONE)
        frames = self._report.frames(state, goals, answer, commanded)
        reached = all(report["reached"] for report in frames.values())
        return {"ik": {"reached": reached, "frames": frames}}

    def _corrected(self, goals: list[pin.SE3], state: RobotState) -> list[pin.SE3]:
        """Return poses in the world of the commanded root."""
        if self.robot.root.kind != "free":
            return goals
        measured = self._conversion.q_to_pinocchio(state.data.qpos)[:7]
        correction = self._goals.base * pin.XYZQUATToSE3(measured).inverse()
        return [correction * goal for goal in goals]
