"""Hands of a robot in a scene: positions and grasps."""

import itertools
from collections.abc import Collection, Sequence

import mujoco
import numpy as np

from wbc_suite.control import RobotState
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Vector


def pairs_in_contact(data: mujoco.MjData) -> list[list[int]]:
    """Return the two geoms of each contact."""
    return data.contact.geom.tolist() if data.ncon else []


class Hand:
    """One hand: the frame between its fingers, and the links of its gripper.

    Attributes:
        name: `right`, `left`, or the frame's own name.
        site: The frame's site in the simulation.
        position: Position of the frame in the world, m. A view.
        gripper_bodies: Bodies of the gripper, with the one it is mounted on.
    """

    def __init__(
        self, state: RobotState, name: str, frame: str, links: Sequence[str]
    ) -> None:
        model, self._data = state.model, state.data
        self._model, self._twists = model, np.zeros((2, 6))
        self.name, self.frame = name, frame
        self.site: int = model.site(state.prefix + frame).id
        self.position: Vector = state.data.site_xpos[self.site]
        bodies = {int(model.body(state.prefix + link).id) for link in links}
        self.gripper_bodies = frozenset(bodies)
        self._body_of = {
            geom: int(body)
            for geom, body in enumerate(model.geom_bodyid)
            if body in bodies
        }

    def owns(self, geom: int) -> bool:
        """Whether a geom belongs to the gripper."""
        return geom in self._body_of

    def grasps(self, geoms: Collection[int]) -> bool:
        """Whether two different links of the gripper touch geoms of an object."""
        touching = {
            self._body_of.get(b if a in geoms else a)
            for a, b in pairs_in_contact(self._data)
            if a in geoms or b in geoms
        }
        return len(touching - {None}) >= 2

    def clamps(self, geoms: Collection[int], angle: float) -> bool:
        """Whether two links touch an object from sides at least an angle apart, rad."""
        touching: list[tuple[int, Vector]] = []
        for pair, frame in zip(
            pairs_in_contact(self._data), self._data.contact.frame, strict=True
        ):
            for own, other, side in ((*pair, 1.0), (*pair[::-1], -1.0)):
                if own in self._body_of and other in geoms:
                    touching.append((self._body_of[own], side * frame[:3]))
        return any(
            a != b and float(n @ m) < np.cos(angle)
            for (a, n), (b, m) in itertools.combinations(touching, 2)
        )

    def friction(self, geoms: Collection[int]) -> float:
        """Return the friction that the gripper can exert on an object, N.

        It is the sum of mu F_n over their contacts.
        """
        most, force = 0.0, np.zeros(6)
        for k, (a, b) in enumerate(pairs_in_contact(self._data)):
            if (self.owns(a) and b in geoms) or (self.owns(b) and a in geoms):
                mujoco.mj_contactForce(self._model, self._data, k, force)
                most += self._data.contact.friction.item(k, 0) * force.item(0)
        return most

    def slip(self, body: int) -> float:
        """Return the speed of a body's centre of mass relative to the hand, m/s.

        With v and w the hand's velocities at its frame p, it is |v_b - v - w x (b - p)|
        for a centre b.
        """
        model, data, kinds = self._model, self._data, mujoco.mjtObj
        hand, other = self._twists
        mujoco.mj_objectVelocity(model, data, kinds.mjOBJ_SITE, self.site, hand, 0)
        mujoco.mj_objectVelocity(model, data, kinds.mjOBJ_BODY, body, other, 0)
        turned = np.cross(hand[:3], data.xipos[body] - self.position)
        return float(np.linalg.norm(other[3:] - hand[3:] - turned))


def hands_of(state: RobotState) -> tuple[Hand, ...]:
    """Return a robot's hands, right before left."""
    robot = state.robot
    return tuple(
        Hand(state, side, frame, gripper_links(robot, side, frame))
        for side, frame in robot.hands.items()
    )


def gripper_links(robot: RobotDescription, side: str, frame: str) -> list[str]:
    """Return the links moved by the gripper of a side, and those that carry them."""
    joints = {
        joint
        for synergy in robot.synergies.get(f"{side}_gripper", ())
        for joint in synergy.open
    }
    moved: set[str] = set()
    carriers: set[str] = set()
    for link in robot.links:  # parents before children
        joint = link.joint
        movers = {joint.name, joint.mimic and joint.mimic.joint} if joint else set()
        if movers & joints or (joint is None and link.parent in moved):
            moved.add(link.name)
            if link.parent is not None:
                carriers.add(link.parent)
    return sorted(moved | carriers) or [robot.frame(frame).link]
