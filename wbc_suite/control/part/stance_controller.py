"""STANCE: legs that keep a robot with a free root on its feet."""

from collections.abc import Sequence
from typing import Literal

import mujoco
import numpy as np
import pinocchio as pin
from pydantic import model_validator

from wbc_suite.config_files import FrozenModel
from wbc_suite.control.contact.arrays import Foot, WholeBodyDynamics
from wbc_suite.control.contact.standing import Standing, make_foot
from wbc_suite.control.law.joint_laws import JointLaw, JointLawConfig
from wbc_suite.control.memory import Parts
from wbc_suite.control.part.controller import UNTIL_NEXT_ACTION, PartController
from wbc_suite.control.robot_parts import RobotPart, motors
from wbc_suite.control.state import RobotState
from wbc_suite.errors import ConfigError, UnknownNameError
from wbc_suite.qp import Sole
from wbc_suite.robot import RobotDescription
from wbc_suite.robot.adopt.soles import ball_radius, guess_sole
from wbc_suite.robot.elements import Name
from wbc_suite.typing import Matrix, Vector

INSET = 0.005
"""m; distance of pressure from the edges of a sole."""
ROLLING_STEPS = 5  # physics steps between two poses over rolling wheels


class HeldFrame(FrozenModel):
    """A frame in contact that must not move, such as a foot.

    Attributes:
        frame: Frame or link of the robot.
        contact: `point` resists forces, `surface` torques as well, `line` all but that
            about its x axis: the blade of a leg whose ankle does not roll.
        sole: Edges of these two in the frame's axes, m: heel, toes (along x), right,
            left (along y). With all soles known the robot is kept from tipping over.
    """

    frame: Name
    contact: Literal["point", "line", "surface"] = "point"
    sole: tuple[float, float, float, float] | None = None

    @model_validator(mode="after")
    def _sole_is_a_rectangle(self) -> "HeldFrame":
        if self.sole is not None:
            heel, toes, right, left = self.sole
            if self.contact == "point" or not (heel < toes and right < left):
                raise ValueError(
                    "'sole' is [heel, toes, right, left] of a 'surface' or 'line', "
                    "with heel < toes and right < left"
                )
        return self


class StanceConfig(FrozenModel):
    """Legs that carry the root while the other parts move; see `Standing`.

    Attributes:
        held: Frames on the ground; the robot's feet when empty, as soles of a biped
            and as points otherwise.
        joint_law: Gains of root and legs.
        gripper: Legs have none.
    """

    type: Literal["STANCE"] = "STANCE"
    held: tuple[HeldFrame, ...] = ()
    joint_law: JointLawConfig = JointLawConfig(kp=400.0)
    gripper: None = None


def held_frames(config: StanceConfig, robot: RobotDescription) -> tuple[HeldFrame, ...]:
    """Return the frames that a robot stands on.

    Raises:
        ConfigError: If neither config nor robot names a foot, or the root is not free.
    """
    if robot.root.kind != "free":
        raise ConfigError(
            f"{robot.name} has a {robot.root.kind} root and cannot fall: STANCE has "
            "nothing to do. Give the part a joint controller, such as JOINT_POSITION."
        )
    feet = [f.name for f in robot.frames if f.role == "foot"]
    contact = "surface" if len(feet) < 3 else "point"
    found = config.held or tuple(HeldFrame(frame=f, contact=contact) for f in feet)
    if not found:
        raise ConfigError(
            f"{robot.name}: STANCE finds no foot. Name the feet in 'held', or give "
            "frames of the robot the role 'foot'."
        )
    return found


def soles_of(held: Sequence[HeldFrame]) -> list[Sole]:
    """Return the soles of held frames; none unless all are known."""
    soles = [
        Sole(frame=h.frame, x=h.sole[:2], y=h.sole[2:])
        for h in held
        if h.sole is not None
    ]
    return soles if len(soles) == len(held) else []


def feet_of(held: Sequence[HeldFrame], state: RobotState) -> list[Foot]:
    """Return held frames as feet; what is not told is that of their shapes."""
    return [_foot(frame, state) for frame in held]


def _foot(held: HeldFrame, state: RobotState) -> Foot:
    robot, name = state.robot, held.frame
    if held.contact == "point":
        return make_foot(state, name, radius=ball_radius(robot, name))
    guess = None if held.sole else guess_sole(robot, name)
    edges, height = guess or (held.sole, 0.0)
    if edges is None:
        return make_foot(state, name)
    heel, toes, right, left = edges
    x, y = min(INSET, 0.25 * (toes - heel)), min(INSET, 0.25 * (left - right))
    sole = heel + x, toes - x, right + y, left - y
    return make_foot(state, name, sole, height=height, rolls=held.contact == "line")


class _Wheels:
    """The wheels of a robot that stands on them: root and feet move as one body.

    Its place, heading and velocity are the mean ones of the wheels. So they may roll,
    and legs neither yield when wheels scrub nor brake them.
    """

    def __init__(self, held: Sequence[HeldFrame], state: RobotState) -> None:
        names = [state.prefix + frame.frame for frame in held]
        self._sites = [state.model.site(name).id for name in names]
        self._feet, self._root = np.zeros((len(names), 3)), np.zeros((4, 4))
        self.reset(state)

    @property
    def memory(self) -> Parts:
        """Where wheels and root were at the reset; views."""
        return self._feet, self._root

    def reset(self, state: RobotState) -> None:
        """Take the present pose of the root over the wheels."""
        self._feet[:] = state.data.site_xpos[self._sites]
        self._root[:] = state.root_pose.homogeneous

    def write(self, dynamics: WholeBodyDynamics, state: RobotState) -> None:
        """Write poses and velocities of root and feet."""
        tracked, plan = dynamics.tracked, dynamics.plan
        feet, moves = state.data.site_xpos[self._sites], self._velocities(state)
        middle, velocity = feet.mean(axis=0), moves.mean(axis=0)
        before, away = self._feet - self._feet.mean(axis=0), feet - middle
        sine = float(np.cross(before, away)[:, 2].sum())
        cosine = float((before[:, :2] * away[:, :2]).sum())
        R = pin.utils.rotate("z", np.arctan2(sine, cosine))
        turn = np.cross(away, moves)[:, 2].sum() / (away[:, :2] ** 2).sum()
        spin = np.array([0.0, 0.0, turn])
        lever = R @ (self._root[:3, 3] - self._feet.mean(axis=0))
        rotation = R @ self._root[:3, :3]
        tracked.start[:2] = (middle + lever)[:2]
        tracked.start[2] = self._root[2, 3]
        tracked.start[3:7] = pin.Quaternion(rotation).coeffs()
        tracked.since[:], tracked.root[:] = 0.0, 0.0
        level = (velocity + np.cross(spin, lever)) * (1.0, 1.0, 0.0)
        tracked.root[1] = np.append(rotation.T @ level, rotation.T @ spin)
        plan.position[:] = middle + before @ R.T
        plan.velocity[:] = velocity + np.cross(spin, before @ R.T)

    def _velocities(self, state: RobotState) -> Matrix:
        """Return the velocities of the wheels' centres in the world, shape (n, 3)."""
        twists = np.zeros((len(self._sites), 6))
        for site, twist in zip(self._sites, twists, strict=True):
            kind = mujoco.mjtObj.mjOBJ_SITE
            mujoco.mj_objectVelocity(state.model, state.data, kind, site, twist, 0)
        return twists[:, 3:]


class StanceController(PartController[JointLaw]):
    """Holds root and legs at their pose of reset while the other parts move.

    It has no slice of the action. On wheels that pose moves with them. The
    accelerations of all laws determine the contact forces; see `Standing`.

    Args:
        part: The legs.
        config: Feet and gains.
        state: The robot in the simulation.

    Attributes:
        law: Holds the legs' joints where the contacts leave them free.
        standing: Finds the contact forces, for all laws.
        slices: None.
    """

    holds_root = True

    def __init__(
        self, part: RobotPart, config: StanceConfig, state: RobotState
    ) -> None:
        gains = config.joint_law
        self.law = JointLaw(state, part.joints, kp=gains.kp, kd=gains.kd)
        self.slices = ()
        held = held_frames(config, state.robot)
        self.standing = Standing(
            state, motors(state.robot), feet=feet_of(held, state), stiffness=gains.kp
        )
        self._wheels = _Wheels(held, state) if state.robot.wheels else None
        self.standing.dynamics.state["glides"] = self._wheels is not None
        self.reset(state)

    @classmethod
    def check(
        cls, config: StanceConfig, part: RobotPart, robot: RobotDescription
    ) -> None:
        """Raise ConfigError if the robot cannot fall, or lacks a frame."""
        sites = {frame.name for frame in robot.frames}
        for held in held_frames(config, robot):
            if held.frame not in sites:
                raise ConfigError(str(UnknownNameError("frame", held.frame, sites)))

    def reset(self, state: RobotState) -> None:
        """Stand in the present pose."""
        self.law.aim(state.data.qpos[self.law.drives["qpos"]])
        if self._wheels is not None:
            self._wheels.reset(state)

    @property
    def memory(self) -> Parts:
        """Where it stood at the reset, if on wheels; views."""
        return self._wheels.memory if self._wheels is not None else ()

    def prepare(self, state: RobotState) -> int:
        """Move the pose to hold with the wheels that the robot stands on, if any."""
        if self._wheels is None or self.standing is None:
            return UNTIL_NEXT_ACTION
        self._wheels.write(self.standing.dynamics, state)
        return ROLLING_STEPS

    def set_goal(self, values: Vector, period: float) -> None:
        """Do nothing: there are no values."""

    @property
    def hold_action(self) -> Vector:
        """No values."""
        return np.zeros(0)
