"""Whole-body inverse dynamics: robots stand, walk or drive, and use their hands."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin

from wbc_suite.control.action import ActionLayout, ActionPart, Axis, SliceKind, Unit
from wbc_suite.control.contact.arrays import (
    QpStage,
    make_dynamics,
    memory_of,
    plan_nothing,
)
from wbc_suite.control.contact.qp_fallback import QpFallback
from wbc_suite.control.contact.standing import chain, limits_of, make_foot
from wbc_suite.control.ground.records import LawKind
from wbc_suite.control.ik.frame_goals import FrameGoals
from wbc_suite.control.ik.reduced_robot import lock_groups, moved_joints
from wbc_suite.control.law.law import Law
from wbc_suite.control.memory import Parts
from wbc_suite.control.part.base_velocity import (
    BaseVelocityConfig,
    BaseVelocityController,
)
from wbc_suite.control.part.controller import UNTIL_NEXT_ACTION
from wbc_suite.control.part.gripper import GripperController
from wbc_suite.control.robot_parts import RobotPart
from wbc_suite.control.state import RobotState
from wbc_suite.control.walking.config import (
    WholeBodyIDConfig,
    read_dynamics,
)
from wbc_suite.control.walking.report import BalanceReport
from wbc_suite.kinematics import Configuration
from wbc_suite.locomotion import GAITS, TrotConfig, begin_gait, make_gait
from wbc_suite.locomotion.gait import Mode
from wbc_suite.qp.solution import Fallback
from wbc_suite.typing import Indices, Vector

BASE_WEIGHT = 100.0
"""Of the accelerations of a base, above those of hands: it drives as commanded."""


class WholeBodyID:
    """Moves a robot by one QP for contact forces and joint accelerations.

    At every physics step the gait planner says which feet stand, where the others swing
    and how the centre of mass accelerates; the QP finds forces and accelerations, and
    the loop turns them into torques. All of it is compiled. A robot with a fixed or
    planar root has no feet; its base, if it has one, follows `walk` as BASE_VELOCITY.

    Args:
        config: Plain data of a `WholeBodyIDConfig`.
        state: The robot in the simulation.

    Attributes:
        layout: Slices of the action: hands, `walk` unless the root is fixed, `height`
            of a robot on its feet, grippers.
        dynamics: What the law reads and writes.
        sensors: Where the state of the robot comes from.
        fallback: What the last QP took whose active set was not found.
    """

    def __init__(self, config: Mapping[str, Any], state: RobotState) -> None:
        self.config = read_dynamics(config, state.robot, str(config.get("type")))
        self.sensors = self.config.sensors
        self._robot = lock_groups(state.robot, ())
        self._law = Law(LawKind.DYNAMICS, state, moved_joints(self._robot, state))
        self._law.keep_limits(state)
        self._grippers = [
            GripperController(gripper, synergies, state)
            for gripper, synergies in state.robot.synergies.items()
        ]
        self._base = _driven_base(state)
        hands = [f.behaviour.action_part(f, self.config) for f in self.config.frames]
        grippers = [part for gripper in self._grippers for part in gripper.slices]
        base = self._base.slices if self._base else _walk_parts(self.config)
        self.layout = ActionLayout([*hands, *base, *grippers])
        self._goals = FrameGoals(
            self.config,
            self.layout,
            self._robot,
            Configuration(self._robot.to_pinocchio()),
            -1,
        )
        self.dynamics = self._make_dynamics(state)
        self._report = BalanceReport(
            self.config,
            self.dynamics,
            law=self._law,
            moves=self._chains(state),
            links=[_link(state, foot.frame) for foot in self.config.feet],
        )
        self._fallback = QpFallback(self.dynamics.qp)
        self.fallback = Fallback.NONE
        others = [g.law for g in self._grippers]
        if self._base is not None:  # it asks; the torques are those of the QP
            others = [self._base.law, *others]
        self.laws: tuple[Law, ...] = (self._law, *others)
        self.reset(state)

    def _make_dynamics(self, state: RobotState) -> Any:
        config, drives = self.config, self._law.drives
        gait = config.gait
        root, place = np.full(6, -1), 0
        if config.feet:
            joint = state.model.joint(f"{state.prefix}root")
            root, place = joint.dofadr[0] + np.arange(6), joint.qposadr[0]
        feet = [
            make_foot(
                state,
                x.frame,
                x.sole,
                height=x.height,
                radius=x.radius,
                rolls=x.rolls,
            )
            for x in config.feet
        ]
        edges = np.array([foot.sole or (0.0,) * 4 for foot in feet])
        is_base = np.isin(self._law.joints, self._base.law.joints if self._base else ())
        dynamics = make_dynamics(
            feet=feet,
            gait=make_gait(gait or TrotConfig(), edges.reshape(-1, 4)),
            planner=plan_nothing if gait is None else GAITS[gait.type].plan,
            qpos=drives["qpos"],
            dofs=np.concatenate([root, drives["dof"]]),
            nv=state.model.nv,
            hands=_sites(state, [str(f.frame) for f in config.frames]),
            is_arm=self._arms(state) * ~is_base,
            hand_weight=np.array(
                [(f.position_cost, f.orientation_cost) for f in config.frames]
            ).reshape(-1, 2),
            goal=self._goals.rows,
            upright=np.array(
                [_link(state, u.frame) for u in config.upright], dtype=np.int64
            ),
            upright_weight=np.array([u.weight for u in config.upright]),
            posture_weight=np.where(is_base, BASE_WEIGHT, self._posture_weights()),
            follows=is_base.astype(np.int64),
            limits=limits_of(drives),
        )
        own = dynamics.state
        own["root_qpos"], own["root_dof"] = place, root[0]
        own["body"] = _link(state, state.robot.links[0].name)
        own["friction"], own["dt"] = config.friction, state.model.opt.timestep
        rate = 2.0 * np.pi * config.cutoff
        own["trust"] = 1.0 - np.exp(-rate * state.model.opt.timestep)
        own["hand_frame"] = config.input_ref_frame == "base"
        return dynamics

    def _chains(self, state: RobotState) -> Indices:
        """Return which joints move each hand, (h, n)."""
        chains = [
            chain(state.model, _link(state, str(frame.frame)))
            for frame in self.config.frames
        ]
        rows = [[d in moved for d in self._law.drives["dof"]] for moved in chains]
        return np.array(rows, dtype=np.int64).reshape(-1, len(self._law.joints))

    def _arms(self, state: RobotState) -> Indices:
        """Return which joints move each hand, and no other hand or foot, (h, n)."""
        model, ends = state.model, [*self.config.frames, *self.config.feet]
        chains = [chain(model, _link(state, str(end.frame))) for end in ends]
        hands = len(self.config.frames)
        return np.array(
            [
                [
                    dof in chains[k] and sum(dof in moved for moved in chains) == 1
                    for dof in self._law.drives["dof"]
                ]
                for k in range(hands)
            ],
            dtype=np.int64,
        ).reshape(hands, len(self._law.joints))

    def _posture_weights(self) -> Vector:
        posture, robot = self.config.posture, self._robot
        weights = {
            joint: weight
            for group, weight in posture.weights.items()
            for joint in robot.groups.get(group, ())
        }
        return np.array([weights.get(j, posture.weight) for j in self._law.joints])

    @property
    def memory(self) -> Parts:
        """What outlives a tick; views."""
        others = (*self._grippers, *([self._base] if self._base else []))
        parts = [array for part in others for array in part.memory]
        return *memory_of(self.dynamics), *self._goals.memory, *parts

    def resume(self, state: RobotState) -> None:
        """Go on from values that were written into `memory`."""
        self._goals.resume()

    def reset(self, state: RobotState) -> None:
        """Stand where the robot is."""
        self._law.reset(state)
        own, data = self.dynamics, state.data
        record = own.state[0]
        record["ticks"] = record["unsolved"] = record["stage"] = 0
        record["fell"] = -1.0
        body = int(record["body"])
        R = data.xmat[body].reshape(3, 3)
        yaw = float(np.arctan2(R[1, 0], R[0, 0]))
        if self.config.feet:
            self._begin_standing(state, yaw)
        else:
            gait = own.gait.state[0]
            own.terms.com[:] = data.xpos[body]
            gait["yaw"], gait["ground"], gait["mode"] = (
                yaw,
                data.xpos[body, 2],
                Mode.STEP,
            )
        own.command[:] = 0.0
        own.load[:] = 0.0
        own.qp.side[:] = 0
        heading = pin.utils.rotate("z", yaw)
        for k, link in enumerate(own.upright):
            own.upright_pose[k] = (heading.T @ data.xmat[link].reshape(3, 3)).ravel()
        ready = state.robot.keyframes.get(self.config.posture.keyframe, {})
        now = data.qpos[own.qpos]
        own.posture[:] = [
            ready.get(j, q) for j, q in zip(self._law.joints, now, strict=True)
        ]
        poses = [
            pin.SE3(data.site_xmat[i].reshape(3, 3).copy(), data.site_xpos[i].copy())
            for i in own.hand
        ]
        self._goals.reset(poses, pin.SE3(heading, own.terms.com.copy()))
        own.start[:] = own.reference[:] = own.goal
        for part in (*self._grippers, *([self._base] if self._base else [])):
            part.reset(state)

    def _begin_standing(self, state: RobotState, yaw: float) -> None:
        """Stand on the feet where they are, with a heading, rad."""
        own, data = self.dynamics, state.data
        record, measured = own.state[0], own.measured
        measured.com[:] = own.terms.com[:] = data.subtree_com[int(record["body"])]
        for k, site in enumerate(own.site):
            R = data.site_xmat[site].reshape(3, 3)
            middle = R @ own.middle[k] if own.is_sole[k] else own.middle[k]
            measured.foot[k] = data.site_xpos[site] + middle
            measured.foot_yaw[k] = np.arctan2(R[1, 0], R[0, 0])
        begin_gait(own.gait, measured, yaw)
        ground = float(own.gait.state["ground"][0])
        record["trunk_height"] = data.xpos[int(record["body"]), 2] - ground

    def set_goal(self, action: Vector, period: float = 0.05) -> None:
        """Move hands' goals, and take commands; see `layout`."""
        self._goals.set(action)
        self._time_references(period)
        if self._base is not None:
            part = self.layout["walk"]
            self._base.set_goal(action[part.start : part.stop], period)
        for name, first in (("walk", 0), ("height", 3)) if self.config.feet else ():
            part = self.layout[name]
            values = action[part.start : part.stop]
            self.dynamics.command[first : first + len(values)] = values
        for gripper in self._grippers:
            part = self.layout[gripper.name]
            gripper.set_goal(action[part.start : part.stop], period)

    def _time_references(self, period: float) -> None:
        """Let references of hands move to the goals, no faster than they may."""
        own = self.dynamics
        own.start[:] = own.reference
        for k, frame in enumerate(self.config.frames):
            start, goal = own.start[k].reshape(3, 4), own.goal[k].reshape(3, 4)
            way = float(np.linalg.norm(goal[:, 3] - start[:, 3]))
            turn = float(np.linalg.norm(pin.log3(goal[:, :3] @ start[:, :3].T)))
            slowest = max(way / frame.max_linear_speed, turn / frame.max_angular_speed)
            own.travel[k] = 0.0, max(period, slowest)

    def prepare(self, state: RobotState) -> int:
        """Do nothing: the loop does it all."""
        return UNTIL_NEXT_ACTION

    def finish_tick(self) -> None:
        """Solve the QP if the loop has stated it and not found its active set."""
        record = self.dynamics.state[0]
        if record["stage"] == QpStage.UNSOLVED:
            self.fallback = self._fallback.solve(self.dynamics.qp)
            record["stage"] = QpStage.SOLVED

    @property
    def heading(self) -> pin.SE3:
        """The frame of hands' goals with `input_ref_frame = "base"`, in the world.

        Its x axis is the heading of the robot, its origin the centre of mass, at the
        commanded height; without feet the origin of the base.
        """
        gait, com = self.dynamics.gait.state[0], self.dynamics.terms.com
        height = float(gait["ground"] + gait["height"])
        return pin.SE3(
            pin.utils.rotate("z", float(gait["yaw"])), np.array([*com[:2], height])
        )

    @property
    def hold_action(self) -> Vector:
        """The action that keeps the hands' goals and stands still."""
        action = np.zeros(self.layout.size)
        self._goals.hold(action)
        if self.config.feet:
            action[self.layout["height"].start] = self.dynamics.command[3]
        for gripper in self._grippers:
            part = self.layout[gripper.name]
            action[part.start : part.stop] = gripper.goal
        return action

    def info(self, state: RobotState) -> dict[str, Any]:
        """Return `{"balance": ..., "ik": ...}`.

        `balance` has `stance`, names of the feet that stand; `margin`, the distance of
        the capture point from the edge of what the robot stands on, m; `loads`, the
        observed forces on hands and feet, N; `footstep`, where the next foot lands, m;
        `fell`, a `Fall` or None. `ik` has errors and reasons of hands, as that of
        WHOLE_BODY_IK, and all that there is without feet.
        """
        return self._report.info(state)


def _driven_base(state: RobotState) -> BaseVelocityController | None:
    """Return what drives the base of a robot with a planar root."""
    if state.robot.root.kind != "planar":
        return None
    part = RobotPart(name="walk", joints=state.robot.root_joint_names)
    config = BaseVelocityConfig(input_type="absolute")
    return BaseVelocityController(part, config, state)


def _walk_parts(config: WholeBodyIDConfig) -> list[ActionPart]:
    """Return the slices of a robot on its feet; none without feet."""
    if not config.feet:
        return []
    low, high = config.height
    walk = ActionPart(
        name="walk",
        kind=SliceKind.VELOCITY,
        labels=(Axis.FORWARD, Axis.SIDEWAYS, Axis.TURN),
        units=(Unit("m/s"), Unit("m/s"), Unit("rad/s")),
        low=tuple(-x for x in config.max_walk),
        high=config.max_walk,
    )
    height = ActionPart(
        name="height",
        kind=SliceKind.POSITION,
        labels=(Axis.Z,),
        units=(Unit("m"),),
        low=(low,),
        high=(high,),
    )
    return [walk, height]


def _sites(state: RobotState, names: list[str]) -> Indices:
    ids = [state.model.site(state.prefix + name).id for name in names]
    return np.array(ids, dtype=np.int64)


def _link(state: RobotState, name: str) -> int:
    """Return the body of a frame or link."""
    return int(state.model.body(state.prefix + state.robot.link_of(name)).id)
