"""HYBRID_MOBILE_BASE: BASIC on a mobile base; hands hold in the base or the world."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin

from wbc_suite.control.action import ActionLayout, ActionPart, SliceKind, Unit
from wbc_suite.control.composite.basic import BasicConfig, BasicController, check_basic
from wbc_suite.control.part.osc_controller import OscController
from wbc_suite.control.state import RobotState
from wbc_suite.errors import ConfigError
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Vector

WORLD = 0
"""MuJoCo's body of that name."""

MODE = ActionPart(
    name="base_mode",
    kind=SliceKind.BASE,
    labels=("hands_keep_to",),
    units=(Unit("-1 base .. 1 world"),),
    low=(-1.0,),
    high=(1.0,),
)


class HybridMobileBase(BasicController):
    """Drives parts as BASIC does; one more value sets the frame that hands hold in.

    `base_mode`, the last value of the action: up to 0 goals move with the base, as in
    BASIC with `input_ref_frame = "base"`; above 0 they stay in the world while the base
    drives. A change of the mode does not move a goal, nor change the meaning of the
    input (`input_ref_frame`).
    """

    def __init__(self, config: Mapping[str, Any], state: RobotState) -> None:
        check_hybrid(config, state.robot, str(config.get("type")))
        self._state, self._in_world = state, False
        self._base = int(state.model.body(state.prefix + state.robot.links[0].name).id)
        self._hands: list[tuple[OscController, int]] = []
        super().__init__(config, state)
        self._hands = [
            (part, int(part.law.record["reference"][0]))
            for part in self.parts.values()
            if isinstance(part, OscController)
        ]
        self.layout = ActionLayout((*self.layout.slices, MODE))
        self.reset(state)

    def resume(self, state: RobotState) -> None:
        """Go on from values that were written into `memory`; laws name the frame."""
        super().resume(state)
        records = [hand.law.record for hand, _ in self._hands]
        self._in_world = any(record["reference"][0] == WORLD for record in records)

    def reset(self, state: RobotState) -> None:
        """Hold every part where it is, hands relative to the base."""
        for hand, own in self._hands:
            hand.law.record["reference"] = own
        super().reset(state)
        self._keep_to_mode(in_world=False)

    def set_goal(self, action: Vector, period: float = 0.05) -> None:
        """Set the goals in the frame of the input, then move them to the mode's."""
        for hand, own in self._hands:
            keep_with(hand, own, self._state)
        super().set_goal(action[:-1], period)
        self._keep_to_mode(in_world=bool(action[-1] > 0.0))

    @property
    def hold_action(self) -> Vector:
        """The action that keeps all goals, and the mode."""
        return np.append(super().hold_action, 1.0 if self._in_world else -1.0)

    def _keep_to_mode(self, *, in_world: bool) -> None:
        self._in_world = in_world
        for hand, _ in self._hands:
            keep_with(hand, WORLD if in_world else self._base, self._state)


def keep_with(hand: OscController, body: int, state: RobotState) -> None:
    """Express a goal, and a reference on its way there, in the axes of a body."""
    record = hand.law.record[0]
    if record["reference"] == body:
        return
    T_bo = _pose(body, state).actInv(_pose(int(record["reference"]), state))
    R = T_bo.rotation
    start = record["start"].copy()
    record["start"][:9] = (R @ start[:9].reshape(3, 3)).ravel()
    record["start"][9:] = T_bo.act(start[9:])
    record["shift"] = R @ record["shift"]
    record["reference"] = body
    hand.goal = T_bo * hand.goal


def _pose(body: int, state: RobotState) -> pin.SE3:
    data = state.data
    return pin.SE3(data.xmat[body].reshape(3, 3), data.xpos[body])


def check_hybrid(
    config: Mapping[str, Any], robot: RobotDescription | None, source: str
) -> BasicConfig:
    """Return the config as a model.

    Raises:
        ConfigError: See `check_basic`, or the robot has no base that drives.
    """
    read = check_basic(config, robot, source)
    if robot is not None and not (robot.root.kind == "planar" and robot.root.actuated):
        raise ConfigError(
            f"{source}: {robot.name} has no base that drives, which HYBRID_MOBILE_BASE "
            "needs. Use BASIC, or load it on one, such as base='OmronMobileBase'."
        )
    return read
