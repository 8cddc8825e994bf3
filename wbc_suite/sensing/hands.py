"""Hands of a robot in a scene: positions and grasps."""

import itertools
from collections.abc import Collection, Iterable, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from wbc_suite.control import RobotState
from wbc_suite.robot import RobotDescription
from wbc_suite.typing import Matrix, Vector

_ANGLES = np.arange(8) * np.pi / 4
EDGES = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])
"""Directions of the edges of the pyramids inside the friction cones."""
ARM = 0.03
"""Length by which moments are divided to be compared with forces, m."""
BALANCED = 1e-9
"""Residual of balanced wrenches, as a share of the normal forces."""


def pairs_in_contact(data: mujoco.MjData) -> list[list[int]]:
    """Return the two geoms of each contact."""
    return data.contact.geom.tolist() if data.ncon else []


class GripContact(NamedTuple):
    """A contact of a hand with an object, world axes.

    Attributes:
        point: Where it is, m, shape (3,).
        edges: Edges of a pyramid inside its friction cone; 1 along the normal, (8, 3).
        force: Normal force, N.
        mu: Coefficient of friction.
    """

    point: Vector
    edges: Matrix
    force: float
    mu: float


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
        """Whether links touch an object from opposite sides.

        These are two, the normals of whose contacts are at least an angle apart, rad,
        or three: what those can hold depends on more than two normals, see `bear`.
        """
        touching: list[tuple[int, Vector]] = []
        for pair, frame in zip(
            pairs_in_contact(self._data), self._data.contact.frame, strict=True
        ):
            for own, other, side in ((*pair, 1.0), (*pair[::-1], -1.0)):
                if own in self._body_of and other in geoms:
                    touching.append((self._body_of[own], side * frame[:3]))
        return len({link for link, _ in touching}) > 2 or any(
            a != b and float(n @ m) < np.cos(angle)
            for (a, n), (b, m) in itertools.combinations(touching, 2)
        )

    def bears(self, geoms: Collection[int], load: float) -> bool:
        """Whether its grip of an object can bear a load, N, in any direction."""
        return bear([self], geoms, load)

    def friction(self, geoms: Collection[int]) -> float:
        """Return the friction that the hand can exert on an object, sum mu F_n, N."""
        return sum(contact.mu * contact.force for contact in self.contacts(geoms))

    def contacts(self, geoms: Collection[int]) -> list[GripContact]:
        """Return contacts with an object."""
        data, found, force = self._data, list[GripContact](), np.zeros(6)
        for k, (a, b) in enumerate(pairs_in_contact(data)):
            side = (b in geoms and self.owns(a)) - (a in geoms and self.owns(b))
            if not side:
                continue
            mujoco.mj_contactForce(self._model, data, k, force)
            normal, *tangents = side * data.contact.frame[k].reshape(3, 3)
            mu = data.contact.friction[k, :2]
            edges = normal + mu * EDGES @ np.array(tangents)
            found.append(
                GripContact(data.contact.pos[k], edges, force.item(0), float(mu[0]))
            )
        return found

    def slip(self, body: int) -> float:
        """Return the speed of a body's centre of mass relative to the hand, m/s.

        With v and w the hand's velocities at its frame p, it is |v_b - v - w x (b - p)|
        for a centre b.
        """
        hand, other = self._velocities(body)
        turned = np.cross(hand[:3], self._data.xipos[body] - self.position)
        return float(np.linalg.norm(other[3:] - hand[3:] - turned))

    def spin(self, body: int) -> float:
        """Return the angular speed of a body relative to the hand, rad/s."""
        hand, other = self._velocities(body)
        return float(np.linalg.norm(other[:3] - hand[:3]))

    def _velocities(self, body: int) -> Matrix:
        """Return angular and linear velocities of hand and body, world axes. A view."""
        model, data, kinds = self._model, self._data, mujoco.mjtObj
        hand, other = self._twists
        mujoco.mj_objectVelocity(model, data, kinds.mjOBJ_SITE, self.site, hand, 0)
        mujoco.mj_objectVelocity(model, data, kinds.mjOBJ_BODY, body, other, 0)
        return self._twists


def bear(hands: Iterable[Hand], geoms: Collection[int], load: float) -> bool:
    """Whether hands can together bear a load at an object in any direction, N.

    They can if forces in the friction cones of their contacts balance the load, whose
    normal parts sum to no more than now. With p_k and e_k the point and the edges of
    the cones, c the middle of the contacts and d each of +-x, +-y, +-z,

        sum l_k e_k = -load d,  sum l_k (p_k - c) x e_k = 0,
        l_k >= 0,  sum l_k <= sum F_n

    has a solution. The load acts at the middle of the contacts: the object may swing.

    Source: Ferrari and Canny (1992), "Planning Optimal Grasps", ICRA.
    """
    from scipy.optimize import nnls  # takes 0.1 s to import

    contacts = [contact for hand in hands for contact in hand.contacts(geoms)]
    total = sum(contact.force for contact in contacts)
    if total <= 0.0:
        return False
    middle = sum(x.point * x.force for x in contacts) / total
    edges = np.vstack([x.edges for x in contacts])
    arms = np.repeat([x.point - middle for x in contacts], len(EDGES), axis=0)
    A = np.ones((7, len(edges) + 1))
    A[:3, :-1], A[3:6, :-1] = edges.T, np.cross(arms, edges).T / ARM
    A[:6, -1] = 0.0
    for way in (*np.eye(3), *-np.eye(3)):
        wanted = np.array([*(load / total * way), 0.0, 0.0, 0.0, 1.0])
        if nnls(A, wanted)[1] > BALANCED:
            return False
    return True


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
