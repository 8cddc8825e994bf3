"""Hands of a robot in a scene: where they are, and what they hold."""

from collections.abc import Sequence

import mujoco
import numpy as np

from wbc_suite.control import RobotState
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Vector

__all__ = ["Hand", "hands_of"]


class Hand:
    """One hand: the site between its fingers and the bodies that can touch.

    Args:
        state: The robot in the simulation.
        name: `right`, `left`, or the frame's own name.
        frame: The frame between the fingers.
        links: Links of the gripper.
    """

    def __init__(
        self, state: RobotState, name: str, frame: str, links: Sequence[str]
    ) -> None:
        self.name, self.frame = name, frame
        self._data, self._model = state.data, state.model
        self._site = state.model.site(state.prefix + frame).id
        self._bodies = {state.model.body(state.prefix + link).id for link in links}

    @property
    def position(self) -> Vector:
        """Position of the frame in the world, m. A view."""
        return self._data.site_xpos[self._site]

    @property
    def quat_xyzw(self) -> Vector:
        """Orientation of the frame in the world."""
        quat = np.empty(4)
        mujoco.mju_mat2Quat(quat, self._data.site_xmat[self._site])
        return quat[[1, 2, 3, 0]]

    def grasps(self, geom: int) -> bool:
        """Whether two different links of the gripper touch a geom."""
        touching: set[int] = set()
        for pair in self._data.contact.geom:
            if geom in pair:
                other = int(pair[1] if pair[0] == geom else pair[0])
                body = int(self._model.geom_bodyid[other])
                if body in self._bodies:
                    touching.add(body)
        return len(touching) >= 2


def hands_of(state: RobotState) -> tuple[Hand, ...]:
    """Return a robot's hands, right before left."""
    robot = state.robot
    return tuple(
        Hand(state, side, frame, _gripper_links(robot, side, frame))
        for side, frame in robot.hands.items()
    )


def _gripper_links(robot: RobotDescription, side: str, frame: str) -> list[str]:
    """Return the links that the side's gripper moves, and the one they hang on."""
    joints = {
        joint
        for synergy in robot.synergies.get(f"{side}_gripper", ())
        for joint in synergy.open
    }
    moved: set[str] = set()
    palms: set[str] = set()
    for link in robot.links:
        joint = link.joint
        leads = joint is not None and (
            joint.name in joints
            or (joint.mimic is not None and joint.mimic.joint in joints)
        )
        if leads or (joint is None and link.parent in moved):
            moved.add(link.name)
            if link.parent is not None and link.parent not in moved:
                palms.add(link.parent)
    return [*sorted(moved | palms)] or [robot.frame(frame).link]
