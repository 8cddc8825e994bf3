"""STANCE: the part that keeps a robot with a free root on its feet."""

from typing import Literal

import numpy as np
import pinocchio as pin

from wbc_suite.control.action import ActionPart
from wbc_suite.control.composite.config import HeldFrame
from wbc_suite.control.part.balance import BalanceLaw
from wbc_suite.control.part.controller import WHENEVER
from wbc_suite.control.part.joint import JointLaw, JointLawConfig
from wbc_suite.control.part.stance import RootMotion, StanceContact, StanceLaw
from wbc_suite.control.state import RobotState
from wbc_suite.errors import ConfigError
from wbc_suite.qp import Sole
from wbc_suite.robot import RobotDescription
from wbc_suite.tomlfile import FrozenModel
from wbc_suite.typing import Vector

__all__ = ["StanceConfig", "StanceController", "held_frames"]


class StanceConfig(FrozenModel):
    """Legs that carry the root while the other parts move; see `StanceLaw`.

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
    """Return what a robot stands on.

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
            f"{robot.name}: STANCE knows no foot. Name the feet in 'held', or give "
            "frames of the robot the role 'foot'."
        )
    return found


class StanceController:
    """Holds root and legs where they are at reset, whatever the other parts do.

    It has no slice of the action. What other parts' laws ask of their joints decides
    what the feet have to give, see `StanceLaw` for points and `BalanceLaw` for soles.

    Args:
        config: Feet and gains.
        state: The robot in the simulation.
        joints: Joints of the legs.
        motors: All joints with a motor, theirs included.

    Attributes:
        law: What holds the legs' joints where the feet leave them free.
        stance: What the feet give, for all laws.
        slices: None.
    """

    def __init__(
        self,
        config: StanceConfig,
        state: RobotState,
        joints: tuple[str, ...],
        motors: tuple[str, ...],
    ) -> None:
        gains = config.joint_law
        self.law = JointLaw(state, joints, kp=gains.kp, kd=gains.kd)
        self.slices: tuple[ActionPart, ...] = ()
        held = held_frames(config, state.robot)
        contacts = [
            StanceContact(
                site=state.model.site(state.prefix + h.frame).id, kind=h.contact
            )
            for h in held
        ]
        soles = [
            Sole(frame=h.frame, x=h.sole[:2], y=h.sole[2:])
            for h in held
            if h.sole is not None
        ]
        if len(soles) == len(held):
            self.stance: StanceLaw = BalanceLaw(state, motors, contacts, gains, soles)
        else:
            self.stance = StanceLaw(state, motors, contacts, gains)
        self.reset(state)

    def reset(self, state: RobotState) -> None:
        """Stand as the robot stands."""
        data = state.data
        self.law.aim(data.qpos[self.law.drives["qpos"]])
        self.stance.aim(data.qpos[self.stance.drives["qpos"]])
        self.stance.lead(RootMotion.still(pin.XYZQUATToSE3(state.q[:7])))

    def set_goal(self, values: Vector, period: float) -> None:
        """Do nothing: there are no values."""

    def prepare(self, state: RobotState) -> int:
        """Do nothing: the law acts at every step."""
        return WHENEVER

    @property
    def hold_action(self) -> Vector:
        """No values."""
        return np.zeros(0)
